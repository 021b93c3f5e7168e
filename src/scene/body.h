#pragma once

#include <cstdint>
#include <memory>

#include "adaptive_bvh/scene.h"
#include "ccd/frame_motion.h"
#include "dispatch/query_object.h"

// The bodies of a scene, and the boxes and spheres around them.
namespace adaptive_bvh {

/// An axis-aligned box in the world; unbounded if a coordinate is not finite.
struct WorldBox {
  fcl::Vector3d low = fcl::Vector3d::Zero(), high = fcl::Vector3d::Zero();

  bool isBounded() const { return low.allFinite() && high.allFinite(); }
};

/// The distance of two boxes, rounded down: a lower bound of the distance of their contents.
inline double gapOf(const WorldBox& a, const WorldBox& b) {
  const fcl::Vector3d gap = (a.low - b.high).cwiseMax(b.low - a.high).cwiseMax(0);
  return gap.norm() * (1 - 1e-14);
}

/// The box around two boxes.
inline WorldBox aroundBoth(const WorldBox& a, const WorldBox& b) {
  return {a.low.cwiseMin(b.low), a.high.cwiseMax(b.high)};
}

/// How far a matrix that requireRigid accepts may be from a rotation, plus rounding.
constexpr double kTurnError = 2e-6;

/// Half the sides of the axis-aligned box around a rotated box, given half the sides of that.
inline fcl::Vector3d rotatedHalf(const fcl::Matrix3d& rotation, const fcl::Vector3d& half) {
  return rotation.cwiseAbs() * half;
}

/// Refers to the caller's mesh, shape or octree.
class BodyGeometry {
 public:
  /// Throws std::invalid_argument if the geometry is none of these.
  explicit BodyGeometry(const fcl::CollisionGeometryd& geometry);

  ObjectKind kind() const { return kind_; }
  bool isMesh() const { return kind_ == ObjectKind::Mesh; }
  const MeshState& mesh() const;                     ///< for meshes only
  QueryObject at(const fcl::Transform3d& tf) const;  ///< the geometry in a pose
  const fcl::CollisionGeometryd& given() const { return *geometry_; }

 private:
  ObjectKind kind_;
  const fcl::CollisionGeometryd* geometry_;
};

/// A distance that was found: the answer while nothing changes (SceneState::epoch), and later a
/// witness, the bodies and elements where the next search starts.
struct KeptDistance {
  SceneDistance found = {};
  std::uint64_t epoch = 0;  ///< when it was the answer
};

/// A body of a scene, with its bounds of the last update.
struct Body {
  BodyId id;
  BodyGeometry geometry;
  BodyOptions options;
  fcl::Transform3d tf;
  /// Null if the scene only refers to the geometry.
  std::shared_ptr<const fcl::CollisionGeometryd> owned = {};
  fcl::Transform3d start_tf = tf;  ///< pose at the start of the step

  // State of the last update.
  WorldBox box = {};
  fcl::Vector3d middle = fcl::Vector3d::Zero();  ///< centre of the bounding sphere, in the world
  double radius = 0;                             ///< of that sphere
  bool has_current_bounds = false;               ///< whether the bounds of a mesh are those of `tf`
  std::uint64_t mesh_version = 0;                ///< MeshState::version of the bounds

  KeptDistance nearest = {};  ///< what Scene::nearest found last

  bool isMesh() const { return geometry.isMesh(); }
  bool isOctree() const { return geometry.kind() == ObjectKind::Octree; }
  const MeshState& mesh() const { return geometry.mesh(); }
  PlacedMesh placedMesh() const { return {mesh(), tf}; }
  PlacedMesh inBodyFrame() const { return {mesh(), fcl::Transform3d::Identity()}; }
  QueryObject object() const { return geometry.at(tf); }
};

/// Boxes in the world around what moves with a frame.
class FrameBoxes {
 public:
  explicit FrameBoxes(const FrameMotion& motion);

  /// The box around all points that are at most `radius` from a box, which is given by its middle
  /// and half its sides, both in the frame.
  WorldBox around(const fcl::Vector3d& middle, const fcl::Vector3d& half, double radius) const;

 private:
  /// On a screw, points leave the line between their positions at two of the times by an arc.
  static constexpr int kParts = 8;

  const FrameMotion motion_;
  FrameAt at_[kParts + 1];
  const int parts_;
};

/// The box around the motion of a body in the step; unbounded for a plane or half-space.
WorldBox sweptBox(const Body& body, FramePath path);

/// Computes the box and the bounding sphere of a body. Skips a mesh if neither it nor its transform
/// has changed; shapes and octrees have no version, so their bounds are always computed. The box of
/// a plane or half-space is unbounded.
void updateBounds(Body& body);

}  // namespace adaptive_bvh
