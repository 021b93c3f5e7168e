#pragma once

#include <algorithm>

#include "base/rigid.h"
#include "query/placed_mesh.h"
#include "triangles/convex_distance.h"

namespace adaptive_bvh {

/// The local boxes of two meshes (FCL's aabb_local), in double precision: lower bounds of the
/// distance that take no time. The boxes of many parts are flat where the parts are.
template <typename S>
class LocalBoxes {
 public:
  LocalBoxes(const PlacedMesh<S>& first, const PlacedMesh<S>& second,
             const RelativePlacement& to_first)
      : first_(*first.geometry), second_(*second.geometry), to_first_(to_first) {}

  fcl::Vector3d middle1() const { return middleOf(first_); }
  fcl::Vector3d middle2() const { return middleOf(second_); }
  /// How far beyond a point `from` the boxes reach along a direction; both in the mesh's frame.
  double reach1(const fcl::Vector3d& from, const fcl::Vector3d& along) const {
    return along.dot(corner(first_, along) - from);
  }
  double reach2(const fcl::Vector3d& from, const fcl::Vector3d& along) const {
    return along.dot(corner(second_, along) - from);
  }
  /// The direction from the first box to the second between their nearest points, in the first
  /// mesh's frame; zero where they touch.
  fcl::Vector3d line() const {
    const fcl::Vector3d origin = middle1();
    const Difference difference(*this, origin);
    const ConvexGap gap =
        convexGap({fcl::Vector3d::Zero(), fcl::Vector3d::Zero(), fcl::Vector3d::Zero()},
                  difference);
    return gap.distance > 0 ? gap.points.second.stableNormalized() : fcl::Vector3d::Zero();
  }

 private:
  using Geometry = fcl::CollisionGeometry<S>;

  /// The second box less the first.
  class Difference final : public ConvexSet {
   public:
    Difference(const LocalBoxes& boxes, const fcl::Vector3d& origin)
        : boxes_(boxes), origin_(origin) {}
    fcl::Vector3d support(const fcl::Vector3d& direction) const override {
      const RelativePlacement& place = boxes_.to_first_;
      return place(corner(boxes_.second_, place.R.transpose() * direction)) - origin_ -
             (corner(boxes_.first_, -direction) - origin_);
    }

   private:
    const LocalBoxes& boxes_;
    const fcl::Vector3d origin_;
  };

  static fcl::Vector3d middleOf(const Geometry& geometry) {
    return geometry.aabb_center.template cast<double>();
  }
  static fcl::Vector3d corner(const Geometry& geometry, const fcl::Vector3d& along) {
    const fcl::AABB<S>& box = geometry.aabb_local;
    fcl::Vector3d corner;
    for (int k = 0; k < 3; ++k) corner[k] = double(along[k] > 0 ? box.max_[k] : box.min_[k]);
    return corner;
  }

  const Geometry &first_, &second_;
  const RelativePlacement& to_first_;
};

}  // namespace adaptive_bvh
