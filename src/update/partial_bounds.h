#pragma once

#include <algorithm>
#include <limits>

#include "tree/box_tree.h"
#include "tree/topology.h"

namespace adaptive_bvh {

/// Box, centre and radius after a few vertices moved: the same numbers as updateLocalBounds gives.
/// A vertex that was farthest out may have moved inwards. The one that is farthest now is then
/// searched in the box tree, so the work depends on what moved and on the depth of the tree, not on
/// the size of the mesh.
template <typename BV>
class PartialBounds {
 public:
  using S = typename BV::S;
  using Point = fcl::Vector3<S>;

  explicit PartialBounds(fcl::BVHModel<BV>& model) : model_(model) {}

  /// Before the position is written.
  void move(const Point& from, const Point& to) {
    const fcl::AABB<S>& box = model_.aabb_local;
    low_.move(-from, -to, -box.min_);
    high_.move(from, to, box.max_);
    left_radius_ |= !((from - model_.aabb_center).norm() < model_.aabb_radius * (1 - kSlack));
    farthest_ = std::max(farthest_, (to - model_.aabb_center).squaredNorm());
  }
  /// After the last position is written and `boxes` are renewed. `in_triangles`: every vertex
  /// belongs to a triangle.
  void finish(const Topology& topology, const BoxTree<S>& boxes, bool in_triangles);

 private:
  /// Three sides of the box: whether a vertex left one, and how far out the moved ones are now.
  struct Sides {
    void move(const Point& from, const Point& to, const Point& side) {
      for (int k = 0; k < 3; ++k) left[k] |= from[k] >= side[k];
      found = found.cwiseMax(to);
    }
    bool left[3] = {false, false, false};
    Point found = Point::Constant(std::numeric_limits<S>::lowest());
  };

  /// Relative rounding of squared distances and their roots.
  static constexpr S kSlack = 16 * std::numeric_limits<S>::epsilon();

  fcl::BVHModel<BV>& model_;
  Sides low_, high_;  ///< the low ones with their sign changed
  bool left_radius_ = false;
  S farthest_ = 0;  ///< moved vertex from the old centre, squared
};

}  // namespace adaptive_bvh
