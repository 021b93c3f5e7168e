#pragma once

#include <cmath>
#include <limits>

#include "fcl/mesh_pairs.h"
#include "fcl/solid_shape.h"
#include "query/depth_meshes.h"
#include "query/signed_distance.h"

namespace adaptive_bvh {

/// A short motion of a shape that takes it out of a closed mesh. If there is one of the length l,
/// no point of either surface is deeper than l in the other body. docs/bounds.md, 19.
template <typename S>
class SeparatingMotion {
 public:
  SeparatingMotion(const MeshObject<S>& mesh, const PlacedGeometry<S>& shape,
                   const SolidShape& solid, const DepthPrecision& precision)
      : mesh_(mesh),
        shape_(shape),
        solid_(solid),
        precision_(precision),
        to_mesh_(mesh.tf, shape.tf),
        target_(mesh.placed),
        deepest_(DepthBounds::from(precision.error())) {}

  /// A depth that is certain, of any surface in the other body: less does not matter.
  void raiseTo(double depth) {
    if (!(depth > deepest_.lower)) return;
    const std::size_t searches = deepest_.searches;
    deepest_ = DepthBounds::from(depth);
    deepest_.searches = searches;
  }
  /// Whether a motion is found that is longer than a known depth by no more than the tolerance.
  /// Tries the mesh's outward directions where the shape reaches into it, the first time against
  /// `n`, of length 1, in the mesh's frame. May find that the shape is deeper than was known.
  bool isFound(fcl::Vector3d n) {
    constexpr int kMostTries = 3;
    constexpr double kSame = 1 - 1e-12;
    for (int i = 0; i < kMostTries && !n.isZero(0); ++i) {
      const fcl::Vector3d last = n;
      n = outwardNear(n);
      if (isApartMoved(n)) return true;
      if (n.dot(last) > kSame) break;
    }
    return false;
  }
  /// The deepest point of the shape in the mesh that was measured, if it is deeper than what was
  /// known. The upper bound holds for both bodies once a motion is found.
  const DepthBounds& deepest() const { return deepest_; }

 private:
  /// Measures the shape's farthest point against n. Returns the mesh's outward direction there.
  fcl::Vector3d outwardNear(const fcl::Vector3d& n) {
    constexpr double kShort = 1e-8;
    DepthPoint<int> point;
    point.x = to_mesh_(solid_.support(to_mesh_.R.transpose() * -n));
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
  /// Whether the shape, moved along n by what counts, neither touches the mesh nor is inside of it.
  bool isApartMoved(const fcl::Vector3d& n) {
    constexpr double kShare = 15. / 16;  // room for the placement's rounding to S
    const double most = deepest_.lower + precision_.tolerance(),
                 length = deepest_.lower + kShare * precision_.tolerance();
    PlacedGeometry<S> moved = shape_;
    moved.tf.translation() += (mesh_.placed.tf.linear() * (length * n)).template cast<S>();
    const double travel =
        (moved.tf.translation() - shape_.tf.translation()).template cast<double>().norm();
    const RelativePlacement to_mesh(mesh_.tf, moved.tf);
    if (!(travel <= most) || target_.isInside(to_mesh(solid_.inner)) || isNear(moved)) return false;
    deepest_.upper = std::max(travel, deepest_.lower);
    return true;
  }
  /// Whether the shape is not certainly apart from the mesh's surface.
  bool isNear(const PlacedGeometry<S>& moved) const {
    const fcl::DistanceRequest<S> request;
    const auto near = static_cast<S>(2 * precision_.error());
    if (!(near > 0)) return true;  // it underflows
    fcl::DistanceResult<S> result(near);
    meshShapeDistance<S>(mesh_, moved, {request, result}, near);
    return result.o1 != nullptr;
  }

  const MeshObject<S>& mesh_;
  const PlacedGeometry<S>& shape_;
  const SolidShape& solid_;
  const DepthPrecision& precision_;
  const RelativePlacement to_mesh_;
  MeshTarget target_;
  DepthBounds deepest_;
};

}  // namespace adaptive_bvh
