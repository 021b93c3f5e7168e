#pragma once

#include <vector>

#include "query/nearest_pair.h"

namespace adaptive_bvh {

/// A pair of nodes where a search stopped: a lower bound of their distance, and the three sums of
/// motion as they stood then (MotionBounds of either model, RigidMotion). The bound less what has
/// been added to these sums bounds the distance in a later step. They are kept apart: in one sum,
/// small steps of one would be lost beside the size of another.
struct FrontPair {
  int node1, node2;
  float motion1, motion2;  ///< accumulated, in body units
  double rigid;
  double bound;
};

/// Where the searches of a query stop, for those of later steps.
template <typename BV>
class SearchStops {
 public:
  /// `rigid_motion`: RigidMotion::sum.
  SearchStops(const PlacedMesh<BV>& first, const PlacedMesh<BV>& second,
              const NearestPair<BV>& nearest, double rigid_motion)
      : motion1_(first.tree->motion),
        motion2_(second.tree->motion),
        unit1_(static_cast<double>(first.tree->boxes->frame.unit())),
        unit2_(static_cast<double>(second.tree->boxes->frame.unit())),
        nearest_(nearest),
        rigid_motion_(rigid_motion) {}

  /// From now on, adds the pairs at which a search stops to `pairs`; those that it comes to from
  /// one in `every` of the pairs that it visits.
  void keep(std::vector<FrontPair>& pairs, std::size_t every) {
    pairs_ = &pairs;
    every_ = every;
    until_kept_ = 1;  // the first: there may be no others
  }
  /// Forgets those of a search that was given up.
  void restart() {
    if (pairs_) pairs_->clear();
    until_kept_ = 1;
  }

  /// A search visits the next pair.
  void next() {
    is_kept_ = pairs_ && --until_kept_ == 0;
    if (is_kept_) until_kept_ = every_;
  }
  /// Whether stops are kept, of the pair that is visited.
  bool isKept() const { return is_kept_; }
  /// `bound` bounds the distance below two of FCL's nodes.
  void add(int node1, int node2, double bound) {
    cost_ += kAdd;
    pairs_->push_back({node1, node2, motion1_.accumulatedMotion(node1),
                       motion2_.accumulatedMotion(node2), rigid_motion_, bound});
  }
  /// The triangles below two nodes were tested only, or along more directions, to keep their
  /// bounds.
  void addTests() { cost_ += kTests; }
  /// What it has cost to keep stops, in tests of boxes.
  double cost() const { return cost_; }

  /// True: nothing below a pair of an earlier query is nearer than the limit. The sums are rounded
  /// up, so every motion shows in a difference. Each difference is rounded once, relative to
  /// itself; 16 epsilon cover that and the sums here. When nothing moved, nothing is rounded, and
  /// the bound is compared as it was: between parallel faces many bounds equal the limit.
  bool isStillPruned(const FrontPair& pair) const {
    const double lost = motionSince(pair);
    const auto limit = static_cast<double>(nearest_.limit());
    if (lost == 0) return pair.bound >= static_cast<double>(nearest_.limitWithinRounding());
    constexpr double kRounding = 16 * std::numeric_limits<double>::epsilon();
    return pair.bound >= (limit + lost) * (1 + kRounding) + rounding::tiny<double>();
  }

  /// How much of what a bound had to spare the motion since has used up: 1 where it prunes no more.
  double used(const FrontPair& pair) const {
    if (!isStillPruned(pair)) return 1;
    const double spare = pair.bound - static_cast<double>(nearest_.limit());
    return spare > 0 ? std::min(1., motionSince(pair) / spare) : 0;
  }

 private:
  using S = typename BV::S;
  static constexpr double kAdd = 1, kTests = 14;  // as measured

  double motionSince(const FrontPair& pair) const {
    return (double(motion1_.accumulatedMotion(pair.node1)) - double(pair.motion1)) * unit1_ +
           (double(motion2_.accumulatedMotion(pair.node2)) - double(pair.motion2)) * unit2_ +
           (rigid_motion_ - pair.rigid);
  }

  const MotionBounds<S>&motion1_, &motion2_;
  const double unit1_, unit2_;  ///< of the models, per unit of their boxes
  const NearestPair<BV>& nearest_;
  const double rigid_motion_;
  std::vector<FrontPair>* pairs_ = nullptr;
  std::size_t every_ = 1, until_kept_ = 0;
  bool is_kept_ = false;
  double cost_ = 0;
};

}  // namespace adaptive_bvh
