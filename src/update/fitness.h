#pragma once

#include <algorithm>
#include <limits>

#include "adaptive_bvh/refit_policy.h"
#include "tree/traversal_statistics.h"

namespace adaptive_bvh {

/// All that the fitness tests look at, for one node.
struct NodeFitness {
  double inflation;  ///< R' - R: radius now less that when last refitted
  double reference;  ///< the length an inflation is compared with (InflationReference)
  bool visited;      ///< a recording query went below the node since the last update
  double child_gap;  ///< largest min(alpha, beta) of those visits; -infinity when none
  /// One of those queries tested the volume, whose inflation may have been in the way.
  bool obstructing = false;
};

/// (R' - R) / reference: the inflation factor, 4.4.1. Zero when nothing grew, whatever the
/// reference; the largest finite number when the reference is zero: a volume without any extent
/// that moved. The leaf radius may lie below the original by rounding: that is no inflation.
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

/// Test D, obstruction (FitnessCriterion).
inline bool testD(const NodeFitness& node) { return node.obstructing; }

/// True when the criterion calls no volume unfit that was not visited.
inline bool needsVisit(FitnessCriterion criterion) {
  switch (criterion) {
    case FitnessCriterion::A:
    case FitnessCriterion::AOrBC:
    case FitnessCriterion::RefitAll: return false;
    default: return true;
  }
}

/// True when, after what queries have recorded, a volume that was not visited is not unfit.
inline bool onlyVisitedAreUnfit(const TraversalStatistics& seen, const RefitPolicy& policy) {
  return seen.work().queries > 0 && needsVisit(policy.criterion);
}

/// The criterion (thesis 4.5): true when the volume is to be recomputed.
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
    case FitnessCriterion::AD: return testD(node) && a();
  }
  return true;
}

}  // namespace adaptive_bvh
