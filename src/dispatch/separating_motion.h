#pragma once

#include <cmath>
#include <limits>

#include "dispatch/shape_search.h"
#include "query/depth/depth_meshes.h"
#include "query/depth/signed_distance.h"

namespace adaptive_bvh {

/// Searches for a short translation that separates a shape from a closed mesh. If there is one of
/// length l, no point of either surface is deeper than l in the other body: docs/bounds.md, 19.
class SeparatingMotion {
 public:
  /// `core`: that of the shape.
  SeparatingMotion(const PlacedMesh& mesh, const PlacedSolid& shape, const ShapeCore& core,
                   const DepthPrecision& precision)
      : mesh_(mesh),
        shape_(shape),
        core_(core),
        precision_(precision),
        to_mesh_(mesh.tf, shape.tf),
        target_(mesh),
        deepest_(DepthBounds::from(precision.error())) {}

  /// Raises the known depth. `depth`: that of some point of either surface in the other body.
  void raiseTo(double depth) {
    if (!(depth > deepest_.lower)) return;
    const std::size_t searches = deepest_.searches;
    deepest_ = DepthBounds::from(depth);
    deepest_.searches = searches;
  }
  /// Whether a translation is found that exceeds the known depth by at most the tolerance. Tries
  /// the mesh's outward directions at points of the shape: first at its farthest point against the
  /// unit vector `n`, in the mesh's frame. May raise the known depth.
  bool isFound(fcl::Vector3d n) {
    constexpr int kMostTries = 3;
    constexpr double kSame = 1 - 1e-12;  // cosine of directions that count as equal
    for (int i = 0; i < kMostTries && !n.isZero(0); ++i) {
      const fcl::Vector3d last = n;
      n = outwardNear(n);
      if (separates(n)) return true;
      if (n.dot(last) > kSame) break;
    }
    return false;
  }
  /// The deepest measured point of the shape in the mesh, if it is deeper than the known depth.
  /// Once a translation is found, the upper bound is valid for both bodies.
  const DepthBounds& deepest() const { return deepest_; }

 private:
  /// Measures the shape's farthest point against n. Returns the mesh's outward direction there.
  fcl::Vector3d outwardNear(const fcl::Vector3d& n) {
    constexpr double kShort = 1e-8;  // of the size: the direction to the surface is rounding only
    DepthPoint<int> point;
    point.x = to_mesh_(shape_.solid.support(to_mesh_.R.transpose() * -n));
    target_.measure(point, 0);
    const bool is_inside = point.distance > 0 && target_.isInside(point.x);
    DepthBounds found;
    target_.findNearest(point, found);
    found.searches = deepest_.searches + 1;
    found.x = point.x;
    found.lower = found.upper = point.distance;
    found.is_found = is_inside && point.distance > deepest_.lower;
    deepest_.searches = found.searches;
    if (found.is_found) deepest_ = found;
    if (point.distance <= kShort * precision_.size()) return found.outward;
    return (is_inside ? 1 : -1) / point.distance * (found.nearest - point.x);
  }
  /// Whether the shape, translated along n by the known depth and tolerance, is out of the mesh.
  bool separates(const fcl::Vector3d& n) {
    constexpr double kShare = 15. / 16;  // a reserve for the rounding of the pose
    const double most = deepest_.lower + precision_.tolerance(),
                 length = deepest_.lower + kShare * precision_.tolerance();
    PlacedSolid moved = shape_;
    moved.tf.translation() += mesh_.tf.linear() * (length * n);
    const double moved_by = (moved.tf.translation() - shape_.tf.translation()).norm();
    const RelativePlacement to_mesh(mesh_.tf, moved.tf);
    const fcl::Vector3d inner = to_mesh(shape_.solid.innerPoint());
    if (!(moved_by <= most) || target_.isInside(inner) || isNear(moved)) return false;
    deepest_.upper = std::max(moved_by, deepest_.lower);
    return true;
  }
  /// Whether the shape may touch the mesh's surface.
  bool isNear(const PlacedSolid& moved) const {
    const double near = 2 * precision_.error();
    return !(near > 0) || isNearer(mesh_, moved, core_, near);  // `near` may underflow to 0
  }

  const PlacedMesh& mesh_;
  const PlacedSolid shape_;
  const ShapeCore& core_;
  const DepthPrecision& precision_;
  const RelativePlacement to_mesh_;
  MeshTarget target_;
  DepthBounds deepest_;  ///< `lower` is the known depth
};

}  // namespace adaptive_bvh
