#pragma once

#include <array>
#include <cstdint>

#include "adaptive_bvh/scene.h"
#include "dispatch/query_object.h"
#include "query/single_precision.h"

namespace adaptive_bvh {

/// All points between two corners, along the axes of the world.
struct WorldBox {
  fcl::Vector3d low = fcl::Vector3d::Zero(), high = fcl::Vector3d::Zero();

  bool isBounded() const { return low.allFinite() && high.allFinite(); }
};

/// The gap of two boxes, a lower bound of the distance of what is in them.
inline double gapOf(const WorldBox& a, const WorldBox& b) {
  const fcl::Vector3d gap = (a.low - b.high).cwiseMax(b.low - a.high).cwiseMax(0);
  return gap.norm() * (1 - 1e-14);
}

/// What a body is: a mesh, a shape or an octree of the user's, in either number type. Refers to it.
/// Its numbers are read in double precision.
class BodyGeometry {
 public:
  /// Throws std::invalid_argument on geometry that a scene cannot hold.
  explicit BodyGeometry(const fcl::CollisionGeometryf& geometry);
  explicit BodyGeometry(const fcl::CollisionGeometryd& geometry);

  ObjectKind kind() const { return kind_; }
  bool isMesh() const { return kind_ == ObjectKind::Mesh; }
  /// Of a mesh.
  const MeshState& mesh() const;
  /// As an object of a query.
  QueryObject at(const fcl::Transform3d& tf) const;
  /// The object that contacts name.
  ContactObject reported() const;
  /// The sine of an angle that rounding of transforms makes of none.
  double parallel() const { return single_ ? kParallelIn<float> : kParallelIn<double>; }

 private:
  ObjectKind kind_;
  const fcl::CollisionGeometryf* single_ = nullptr;
  const fcl::CollisionGeometryd* double_ = nullptr;
};

/// A body of a scene.
struct Body {
  BodyId id;
  BodyGeometry geometry;
  BodyOptions options;
  fcl::Transform3d tf;
  fcl::Transform3d start_tf = tf;  ///< where the step began

  // State of the last update.
  WorldBox box = {};
  fcl::Vector3d middle = fcl::Vector3d::Zero();  ///< of a ball around it, in the world
  double radius = 0;
  bool is_placed = false;       ///< whether a mesh's are of the present transform
  std::uint64_t positions = 0;  ///< MeshState::version

  /// The body that was nearest last, with the nearest elements.
  struct Witness {
    bool exists = false;
    BodyId other = 0;
    std::array<int, 2> elements = {-1, -1};
  } witness = {};

  bool isMesh() const { return geometry.isMesh(); }
  /// Of a mesh.
  const MeshState& mesh() const { return geometry.mesh(); }
  PlacedMesh placedMesh() const { return {mesh(), tf}; }
  PlacedMesh inItsFrame() const { return {mesh(), fcl::Transform3d::Identity()}; }
  QueryObject object() const { return geometry.at(tf); }
};

/// A box around a body, other than a mesh, placed by a transform; unbounded of a plane and a
/// half-space. `turn_error`: how far a rotation of the scene may be from one.
WorldBox boxAround(const Body& body, const fcl::Transform3d& tf, double turn_error);

/// Computes the box and the ball of a body in its present state: of a mesh where it or its
/// transform has changed, of others, which have no version, always. They are unbounded of a plane
/// and a half-space.
void bound(Body& body, double turn_error);

}  // namespace adaptive_bvh
