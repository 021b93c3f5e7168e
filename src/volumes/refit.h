#pragma once

#include <algorithm>
#include <limits>

#include "adaptive_bvh/refit_policy.h"
#include "adaptive_bvh/update_report.h"
#include "volumes/fitness.h"
#include "volumes/update_target.h"

namespace adaptive_bvh {

/// What refits did. Adds up over threads.
template <typename S>
struct RefitCounts {
  int leaves = 0, inner = 0;
  long primitives = 0;  ///< read
  S corner_sum = 0;     ///< the largest Volume::cornerSum of what was refitted
  bool root = false;    ///< the root was

  void operator+=(const RefitCounts& other) {
    leaves += other.leaves;
    inner += other.inner;
    primitives += other.primitives;
    corner_sum = std::max(corner_sum, other.corner_sum);
    root |= other.root;
  }
};

/// Recomputes the volumes that a policy calls unfit from their triangles, thesis 4.3 and 4.5. A
/// node is judged and refitted by itself: its children keep what they have. Without statistics (no
/// recording query since the last update) tests B and D count as true for every node and test C as
/// false. Several threads may use one each, on different nodes. `Method`: TranslationPropagation or
/// DisplacementPropagation. Allocates nothing. Some are refitted only when it is finished.
template <typename BV, typename Method>
class Refitter {
 public:
  using S = typename BV::S;

  /// Nodes of `turn` are also refitted for their inflation alone, from twice that of test A on:
  /// else volumes that no query visits would be inflated without end.
  Refitter(const UpdateTarget<BV>& target, Method& method, const RefitPolicy& policy,
           const NodeRange& turn)
      : target_(target),
        method_(method),
        policy_(policy),
        turn_(turn),
        fit_(method.fit(target, policy)),
        has_statistics_(target.tree.statistics.work().queries > 0),
        only_visited_(onlyVisitedAreUnfit(target.tree.statistics, policy)) {}

  /// To be refitted if it is unfit.
  void judge(int node) {
    if (only_visited_ && !target_.tree.statistics.visited(node) && !turn_.contains(node)) return;
    prefetch(node);
    found_[found_count_++] = node;
    if (found_count_ == kGroup) settle();
  }
  /// Refits all nodes in [first, last).
  void refitAll(int first, int last) {
    for (int node = first; node < last; ++node) {
      prefetch(std::min(node + kGroup, last - 1));
      refit(node);
    }
  }
  /// Refits what was judged unfit.
  const RefitCounts<S>& finish() {
    settle();
    counts_.corner_sum = fit_.finish();
    return counts_;
  }

 private:
  /// FCL's nodes are large and mostly not in the processor's cache. So they are prefetched, and
  /// worked on in groups.
  static constexpr int kGroup = 32;

  void prefetch(int node) const {
    const auto* const bytes = reinterpret_cast<const char*>(&target_.volume(node));
    for (std::size_t line = 0; line < sizeof(BV); line += 64) __builtin_prefetch(bytes + line, 1);
  }

  void settle() {
    for (int k = 0; k < found_count_; ++k) {
      const int node = found_[k];
      const NodeFitness fitness = fitnessOf(node);
      if (!isUnfit(fitness, policy_) &&
          !(turn_.contains(node) && inflationFactor(fitness) > 2 * policy_.max_inflation))
        continue;
      refit(node);
    }
    found_count_ = 0;
  }

  NodeFitness fitnessOf(int i) const {
    const TraversalStatistics& seen = target_.tree.statistics;
    const S original_radius = method_.originalRadius(target_, i);
    NodeFitness fitness;
    fitness.inflation = method_.inflation(target_, i);
    fitness.reference = policy_.reference == InflationReference::OriginalRadius
                            ? original_radius
                            : Volume<BV>::size(target_.volume(i), original_radius);
    fitness.visited = !has_statistics_ || seen.visited(i);
    fitness.obstructing = !has_statistics_ || seen.obstructing(i);
    fitness.child_gap = has_statistics_ ? static_cast<double>(seen.childGap(i))
                                        : -std::numeric_limits<double>::infinity();
    return fitness;
  }

  void refit(int node) {
    fit_.add(node);
    method_.refitted(target_, node);
    target_.tree.refits.mark(node);
    ++(target_.tree.topology.isLeaf(node) ? counts_.leaves : counts_.inner);
    counts_.primitives += target_.model.getBV(node).num_primitives;
    counts_.root |= node == 0;
  }

  const UpdateTarget<BV> target_;
  Method& method_;
  const RefitPolicy& policy_;
  const NodeRange turn_;
  typename Method::Fit fit_;
  const bool has_statistics_, only_visited_;
  int found_[kGroup], found_count_ = 0;  ///< to be judged
  RefitCounts<S> counts_;
};

}  // namespace adaptive_bvh
