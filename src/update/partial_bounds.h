#pragma once

#include <algorithm>
#include <limits>

#include "tree/box_tree.h"
#include "tree/topology.h"

namespace adaptive_bvh {

/// Box, centre and radius where a few vertices move, one by one, to the same numbers. What the
/// bounds rested on may have moved inwards: what then takes its place is looked for among the
/// boxes, so that the work goes by what moved and the depth of the tree, not by the mesh's size.
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
  /// After the last, when `boxes` are renewed. `in_triangles`: every vertex belongs to one.
  void finish(const Topology& topology, const BoxTree<S>& boxes, bool in_triangles);

 private:
  /// Of three sides: did a vertex leave one, and how far out do the moved ones stand now?
  struct Sides {
    void move(const Point& from, const Point& to, const Point& side) {
      for (int k = 0; k < 3; ++k) left[k] |= from[k] >= side[k];
      found = found.cwiseMax(to);
    }
    bool left[3] = {false, false, false};
    Point found = Point::Constant(std::numeric_limits<S>::lowest());
  };

  /// Of squared distances and their roots.
  static constexpr S kSlack = 16 * std::numeric_limits<S>::epsilon();

  fcl::BVHModel<BV>& model_;
  Sides low_, high_;  ///< the low ones with their sign changed
  bool left_radius_ = false;
  S farthest_ = 0;  ///< of the moved ones from the old centre, squared
};

}  // namespace adaptive_bvh
