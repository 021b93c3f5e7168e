#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

#include "adaptive_bvh/refit_policy.h"
#include "adaptive_bvh/update_report.h"
#include "base/pack.h"
#include "thesis/adaptive_tree.h"

// Which volumes an update refits: the fitness tests of thesis 4.4 and 4.5, and Refitter, which
// applies them node by node.
namespace adaptive_bvh {

/// The inputs of the fitness tests for one node.
struct NodeFitness {
  double inflation;  ///< R' - R: current radius minus radius at the last refit
  double reference;  ///< length that inflations are compared with (InflationReference)
  bool visited;      ///< whether a recording query went below the node since the last update
  double child_gap;  ///< largest min(alpha, beta) (4.4.3) of these visits; -infinity if none
};

/// The inflation factor (R' - R) / reference, 4.4.1. Zero if the inflation is zero or negative:
/// rounding may make a leaf radius smaller than the original. The largest finite number if the
/// reference is zero, which is a volume without extent that moved.
inline double inflationFactor(const NodeFitness& node) {
  if (node.inflation <= 0) return 0;
  return std::min(node.inflation / node.reference, std::numeric_limits<double>::max());
}

/// Test A, inflation factor (4.4.1).
inline bool testA(const NodeFitness& node, const RefitPolicy& policy) {
  return inflationFactor(node) > policy.max_inflation;
}

/// Test B, recent traversal (4.4.2).
inline bool testB(const NodeFitness& node) { return node.visited; }

/// Test C, child node distances (4.4.3). The factor is compared by >=, as in the thesis.
inline bool testC(const NodeFitness& node, const RefitPolicy& policy) {
  return inflationFactor(node) >= policy.min_inflation &&
         node.child_gap > policy.child_distance_ratio * node.inflation;
}

/// Whether the criterion considers a volume unfit only if a query visited it.
inline bool needsVisit(FitnessCriterion criterion) {
  switch (criterion) {
    case FitnessCriterion::A:
    case FitnessCriterion::AOrBC:
    case FitnessCriterion::RefitAll: return false;
    default: return true;
  }
}

/// Whether volumes that were fit may be unfit after a step at rest: because queries have visited
/// them, or because all are.
inline bool judgesAtRest(FitnessCriterion criterion) {
  return criterion != FitnessCriterion::A && criterion != FitnessCriterion::RefitNone;
}

/// Whether, given the recorded statistics, only visited volumes can be unfit.
inline bool onlyVisitedAreUnfit(const TraversalStatistics& statistics, const RefitPolicy& policy) {
  return statistics.work().queries > 0 && needsVisit(policy.criterion);
}

/// Applies the criterion (thesis 4.5): returns true if the volume is to be recomputed.
inline bool isUnfit(const NodeFitness& node, const RefitPolicy& policy) {
  const auto a = [&] { return testA(node, policy); };
  const auto b = [&] { return testB(node); };
  const auto c = [&] { return testC(node, policy); };
  switch (policy.criterion) {
    case FitnessCriterion::A: return a();
    case FitnessCriterion::B: return b();
    case FitnessCriterion::AB: return b() && a();
    case FitnessCriterion::BC: return b() && c();
    case FitnessCriterion::ABC: return b() && a() && c();
    case FitnessCriterion::AOrBC: return a() || (b() && c());
    case FitnessCriterion::ABOrBC: return b() && (a() || c());  // (A and B) or (B and C)
    case FitnessCriterion::RefitAll: return true;
    case FitnessCriterion::RefitNone: return false;
  }
  return true;
}

/// Whether a propagation found that a volume may be unfit, by a test that is quick and may be wrong
/// about volumes that are fit. A type of its own, because the compiler must assume that a store to
/// a std::uint8_t changes any object.
enum class MayBeUnfit : std::uint8_t { No, Yes };

/// A lower bound of the inflation factors of unfit volumes; -infinity if there is none.
inline double leastUnfitFactor(const RefitPolicy& policy) {
  constexpr double kAny = -std::numeric_limits<double>::infinity();
  const double p_max = policy.max_inflation,
               p_min = policy.min_inflation > 0 ? policy.min_inflation : kAny;
  switch (policy.criterion) {
    case FitnessCriterion::A:
    case FitnessCriterion::AB:
    case FitnessCriterion::ABC: return p_max;
    case FitnessCriterion::BC:
    case FitnessCriterion::AOrBC:
    case FitnessCriterion::ABOrBC: return std::min(p_min, p_max);
    default: return kAny;
  }
}

/// Statistics of refits; can be summed over threads.
template <typename S>
struct RefitCounts {
  int leaves = 0, inner = 0;
  long primitives = 0;  ///< primitives read
  S corner_sum = 0;     ///< largest Volume::cornerSum of refitted volumes
  bool root = false;    ///< whether the root was refitted

  void operator+=(const RefitCounts& other) {
    leaves += other.leaves;
    inner += other.inner;
    primitives += other.primitives;
    corner_sum = std::max(corner_sum, other.corner_sum);
    root |= other.root;
  }
};

/// Recomputes the volumes that a policy considers unfit from their triangles, thesis 4.3 and 4.5.
/// Each node is judged and refitted by itself; its children are unchanged. Without statistics (no
/// recording query since the last update), test B counts as true for every node and test C as
/// false. Several threads may each use a Refitter on different nodes. `Method` is
/// TranslationPropagation or DisplacementPropagation. Usage: `judge`, then `finish`.
template <typename BV, typename Method>
class Refitter {
 public:
  using S = typename BV::S;

  /// Nodes of `turn` are also refitted if their inflation alone exceeds twice the limit of test A:
  /// otherwise volumes that no query visits would inflate without bound.
  Refitter(const UpdateTarget<BV>& target, Method& method, const RefitPolicy& policy,
           const NodeRange& turn)
      : target_(target),
        method_(method),
        policy_(policy),
        turn_(turn),
        fit_(method.fit(target, policy)),
        has_statistics_(target.tree.statistics.work().queries > 0),
        only_visited_(onlyVisitedAreUnfit(target.tree.statistics, policy)) {}

  /// Refits a node if it is unfit, possibly not before finish().
  void judge(int node) {
    if (only_visited_ && !target_.tree.statistics.visited(node) && !turn_.contains(node)) return;
    prefetch(node);
    pending_[pending_count_++] = node;
    if (pending_count_ == kGroup) judgePending();
  }
  /// Judges the nodes in [first, last): all, or those of `candidates` if that is not null.
  void judge(int first, int last, const MayBeUnfit* candidates) {
    for (; first < last; first += kGroup) {
      int group[kGroup], count = 0;
      for (int node = first; node < std::min(first + kGroup, last); ++node) {
        group[count] = node;
        count += candidates ? static_cast<int>(candidates[node]) : 1;
      }
      std::for_each(group, group + count, [&](int node) { judge(node); });
    }
  }
  /// Completes all refits and returns their statistics.
  const RefitCounts<S>& finish() {
    judgePending();
    counts_.corner_sum = fit_.finish();
    return counts_;
  }

 private:
  /// The number of nodes judged together. FCL's nodes are large and mostly not in the cache, so
  /// they are prefetched and processed in groups.
  static constexpr int kGroup = 32;

  void prefetch(int node) const {
    const auto* const bytes = reinterpret_cast<const char*>(&target_.volume(node));
    for (std::size_t line = 0; line < sizeof(BV); line += 64) __builtin_prefetch(bytes + line, 1);
  }

  void judgePending() {
    for (int k = 0; k < pending_count_; ++k) {
      const int node = pending_[k];
      if (policy_.criterion == FitnessCriterion::RefitAll || isToBeRefitted(node)) refit(node);
    }
    pending_count_ = 0;
  }

  bool isToBeRefitted(int node) const {
    const NodeFitness fitness = fitnessOf(node);
    return isUnfit(fitness, policy_) ||
           (turn_.contains(node) && inflationFactor(fitness) > 2 * policy_.max_inflation);
  }

  NodeFitness fitnessOf(int i) const {
    const TraversalStatistics& statistics = target_.tree.statistics;
    const S original_radius = method_.originalRadius(target_, i);
    NodeFitness fitness;
    fitness.inflation = method_.inflation(target_, i);
    fitness.reference = policy_.reference == InflationReference::OriginalRadius
                            ? original_radius
                            : Volume<BV>::size(target_.volume(i), original_radius);
    fitness.visited = !has_statistics_ || statistics.visited(i);
    fitness.child_gap = has_statistics_ ? static_cast<double>(statistics.childGap(i))
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
  const bool has_statistics_;                ///< whether a query recorded since the last update
  const bool only_visited_;                  ///< whether only visited nodes can be unfit
  int pending_[kGroup], pending_count_ = 0;  ///< nodes to be judged
  RefitCounts<S> counts_;
};

}  // namespace adaptive_bvh
