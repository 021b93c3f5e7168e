#pragma once

#include <algorithm>

#include "base/rigid.h"
#include "query/placed_mesh.h"
#include "triangles/convex_distance.h"

namespace adaptive_bvh {

/// Returns the vector between the nearest points of two convex sets, from the first to the second,
/// in the first's frame; zero if they touch or are less than `least` apart. farthest1(d),
/// farthest2(d): support functions, the point of each set that is farthest along d, in its frame.
template <typename Farthest1, typename Farthest2>
fcl::Vector3d vectorBetween(const RelativePlacement& to_first, const Farthest1& farthest1,
                            const Farthest2& farthest2, double least = 0) {
  // The Minkowski difference of the sets: its nearest point to the origin is the vector.
  class Difference final : public ConvexSet {
   public:
    Difference(const RelativePlacement& to_first, const Farthest1& farthest1,
               const Farthest2& farthest2)
        : to_first_(to_first), farthest1_(farthest1), farthest2_(farthest2) {}
    fcl::Vector3d support(const fcl::Vector3d& along) const override {
      return to_first_(fcl::Vector3d(farthest2_(to_first_.R.transpose() * along))) -
             farthest1_(-along);
    }

   private:
    const RelativePlacement& to_first_;
    const Farthest1& farthest1_;
    const Farthest2& farthest2_;
  };
  constexpr double kError = 0x1p-49;  // GapSearch::error: above the rounding error
  constexpr int kMostSteps = 32;
  const fcl::Vector3d origin = fcl::Vector3d::Zero();
  const ConvexGap gap =
      convexGap({origin, origin, origin}, Difference(to_first, farthest1, farthest2),
                {kError, kMostSteps, false, least});
  return gap.distance > 0 && gap.distance >= least ? gap.points.second : origin;
}

/// The bounding boxes of two meshes, each along the axes of its own frame (FCL's aabb_local), in
/// double precision. They give lower bounds of the distance at no cost, which are often tight: many
/// mechanical parts have flat faces in the faces of their boxes.
class LocalBoxes {
 public:
  LocalBoxes(const PlacedMesh& first, const PlacedMesh& second, const RelativePlacement& to_first)
      : first_(first.bounds()), second_(second.bounds()), to_first_(to_first) {}

  /// The centre of each box, in its mesh's frame.
  fcl::Vector3d middle1() const { return middleOf(first_); }
  fcl::Vector3d middle2() const { return middleOf(second_); }
  /// Returns how far the box of the first (extent1) or second mesh (extent2) extends from a point
  /// along a direction, both in that mesh's frame.
  double extent1(const fcl::Vector3d& from, const fcl::Vector3d& along) const {
    return along.dot(corner(first_, along) - from);
  }
  double extent2(const fcl::Vector3d& from, const fcl::Vector3d& along) const {
    return along.dot(corner(second_, along) - from);
  }
  /// The direction between the boxes' nearest points, in the first's frame; zero if they touch.
  fcl::Vector3d line() const {
    return vectorBetween(
               to_first_, [&](const fcl::Vector3d& along) { return corner(first_, along); },
               [&](const fcl::Vector3d& along) { return corner(second_, along); })
        .stableNormalized();
  }

 private:
  using Bounds = LocalBounds;

  static fcl::Vector3d middleOf(const Bounds& bounds) { return bounds.aabb_center; }
  /// The corner of a box that is farthest along a direction.
  static fcl::Vector3d corner(const Bounds& bounds, const fcl::Vector3d& along) {
    const fcl::AABBd& box = bounds.aabb_local;
    fcl::Vector3d corner;
    for (int k = 0; k < 3; ++k) corner[k] = double(along[k] > 0 ? box.max_[k] : box.min_[k]);
    return corner;
  }

  const Bounds &first_, &second_;
  const RelativePlacement& to_first_;
};

}  // namespace adaptive_bvh
