#pragma once

#include <algorithm>
#include <limits>

#include "adaptive_bvh/refit_policy.h"
#include "adaptive_bvh/update_report.h"
#include "update/fitness.h"
#include "update/update_target.h"

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
/// DisplacementPropagation. Allocates nothing.
template <typename BV, typename Method>
class Refitter {
 public:
  using S = typename BV::S;

  Refitter(const UpdateTarget<BV>& target, Method& method, const RefitPolicy& policy)
      : target_(target),
        method_(method),
        policy_(policy),
        fit_(method.fit(target, policy)),
        has_statistics_(target.tree.statistics.work().queries > 0),
        only_visited_(has_statistics_ && needsVisit(policy.criterion)) {}

  void judge(int i) {
    const TraversalStatistics& seen = target_.tree.statistics;
    const bool visited = !has_statistics_ || seen.visited(i);
    if (only_visited_ && !visited) return;
    const BV& bv = target_.volume(i);
    const S original_radius = method_.originalRadius(target_, i);
    NodeFitness fitness;
    fitness.inflation = method_.inflation(target_, i);
    fitness.reference = policy_.reference == InflationReference::OriginalRadius
                            ? original_radius
                            : Volume<BV>::size(bv, original_radius);
    fitness.visited = visited;
    fitness.obstructing = !has_statistics_ || seen.obstructing(i);
    fitness.child_gap = has_statistics_ ? static_cast<double>(seen.childGap(i))
                                        : -std::numeric_limits<double>::infinity();
    if (isUnfit(fitness, policy_)) refit(i);
  }

  const RefitCounts<S>& counts() const { return counts_; }

 private:
  void refit(int i) {
    const fcl::BVNode<BV>& node = target_.model.getBV(i);
    target_.volume(i) = fit_(i);
    method_.refitted(target_, i);
    counts_ += {node.isLeaf(), !node.isLeaf(), node.num_primitives, Volume<BV>::cornerSum(node.bv),
                i == 0};
  }

  const UpdateTarget<BV> target_;
  Method& method_;
  const RefitPolicy& policy_;
  typename Method::Fit fit_;
  const bool has_statistics_, only_visited_;
  RefitCounts<S> counts_;
};

}  // namespace adaptive_bvh
