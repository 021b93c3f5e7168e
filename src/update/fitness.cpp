#include "update/fitness.h"

#include <algorithm>
#include <limits>

namespace adaptive_bvh {

double inflationFactor(const NodeFitness& node) {
  if (node.inflation <= 0) return 0;
  return std::min(node.inflation / node.reference, std::numeric_limits<double>::max());
}

bool testA(const NodeFitness& node, const RefitPolicy& policy) {
  return inflationFactor(node) > policy.max_inflation;
}

bool testB(const NodeFitness& node) { return node.visited; }

bool testC(const NodeFitness& node, const RefitPolicy& policy) {
  return inflationFactor(node) >= policy.min_inflation &&
         node.child_gap > policy.child_distance_ratio * node.inflation;
}

bool testD(const NodeFitness& node) { return node.obstructing; }

bool needsVisit(FitnessCriterion criterion) {
  switch (criterion) {
    case FitnessCriterion::A:
    case FitnessCriterion::AOrBC:
    case FitnessCriterion::RefitAll: return false;
    default: return true;
  }
}

bool isUnfit(const NodeFitness& node, const RefitPolicy& policy) {
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
