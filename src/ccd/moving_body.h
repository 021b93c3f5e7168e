#pragma once

#include <vector>

#include "ccd/frame_motion.h"
#include "deformable/mesh_state.h"
#include "solids/flat.h"
#include "triangles/triangle_contact.h"

namespace adaptive_bvh {

/// A mesh or a shape that moves from t = 0 to 1. A view, apart from its frame.
class MovingBody {
 public:
  /// A mesh whose vertices move from `start` to `end` in its frame. Throws std::invalid_argument if
  /// a position is not finite, or too large.
  MovingBody(const MeshState& mesh, const fcl::Vector3d* start, const fcl::Vector3d* end,
             const FrameMotion& frame);
  /// A mesh with its present positions.
  MovingBody(const MeshState& mesh, const FrameMotion& frame);
  /// A shape, or a cell of an octree with its number.
  MovingBody(const Solid& solid, const FrameMotion& frame, int cell = -1);

  /// Null for a shape.
  const MeshState* mesh() const { return mesh_; }
  /// Null for a mesh.
  const Solid* solid() const { return solid_; }
  int cell() const { return cell_; }  ///< -1 for a mesh or a shape
  /// The plane or half-space; null for other bodies.
  const FlatSolid* flat() const { return solid_ ? solid_->flat() : nullptr; }
  const FrameMotion& frame() const { return frame_; }
  /// Whether vertices do not move in the frame, and have the mesh's present positions.
  bool isUndeformed() const { return is_undeformed_; }

  /// A point in time, and the frame then.
  struct At {
    double t;
    FrameAt frame;
  };
  At at(double t) const {
    if (t == 0) return {0, from_};
    if (t == 1) return {1, to_};
    return {t, frame_.at(t)};
  }
  fcl::Vector3d vertex(std::size_t v, const At& at) const {
    if (is_undeformed_ && frame_.isRigid()) return at.frame(start_[v]);
    if (at.t == 0) return from_(start_[v]);
    if (at.t == 1) return to_(end_[v]);
    if (frame_.isScrew()) return at.frame((1 - at.t) * start_[v] + at.t * end_[v]);
    return (1 - at.t) * from_(start_[v]) + at.t * to_(end_[v]);
  }
  /// A triangle's corners, by its index in the order of the leaves.
  TrianglePoints triangle(unsigned leaf_index, const At& at) const {
    const Int4& v = mesh_->tree.corners(leaf_index);
    return {vertex(std::size_t(v[0]), at), vertex(std::size_t(v[1]), at),
            vertex(std::size_t(v[2]), at)};
  }
  /// The farthest point of a shape.
  fcl::Vector3d support(const At& at, const fcl::Vector3d& direction) const {
    return at.frame(solid_->support(at.frame.linear.transpose() * direction));
  }

  /// Upper bound of how far points are, within a time `length` long, from the straight line that
  /// they follow between the positions at its ends.
  double arc(double length) const { return acceleration_ * length * length / 8; }
  /// The second derivative of positions is at most this.
  double acceleration() const { return acceleration_; }
  /// Upper bound of how far vertices are at time t, in the world, from where the mesh's present
  /// positions would be.
  double deviation(double t) const { return (1 - t) * deviations_[0] + t * deviations_[1]; }
  /// Bound of the rounding error of positions.
  double error() const { return 0x1p-46 * magnitude_; }
  /// Bound of the coordinates, in the frame and in the world. Of a plane or half-space, of its
  /// offset and its frame.
  double magnitude() const { return magnitude_; }
  /// All points of the body are at most `radius` from `middle`, both in the frame; at all times.
  const fcl::Vector3d& middle() const { return middle_; }
  double radius() const { return radius_; }

 private:
  void setBounds(const fcl::Vector3d& low, const fcl::Vector3d& high, double speed);
  void setAcceleration(double speed);

  const MeshState* mesh_ = nullptr;
  const Solid* solid_ = nullptr;
  int cell_ = -1;
  const fcl::Vector3d *start_ = nullptr, *end_ = nullptr;
  FrameMotion frame_;
  FrameAt from_, to_;
  bool is_undeformed_ = true;
  double acceleration_ = 0, magnitude_ = 0, radius_ = 0;
  double deviations_[2] = {0, 0};  ///< at the start and the end
  fcl::Vector3d middle_ = fcl::Vector3d::Zero();
};

}  // namespace adaptive_bvh
