#pragma once

#include "adaptive_bvh/refit_policy.h"

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
double inflationFactor(const NodeFitness& node);

/// Test A, inflation factor (4.4.1).
bool testA(const NodeFitness& node, const RefitPolicy& policy);

/// Test B, recent traversal (4.4.2).
bool testB(const NodeFitness& node);

/// Test C, child node distances (4.4.3). The factor is compared by >=, as in the thesis.
bool testC(const NodeFitness& node, const RefitPolicy& policy);

/// Test D, obstruction (FitnessCriterion).
bool testD(const NodeFitness& node);

/// True when the criterion calls no volume unfit that was not visited.
bool needsVisit(FitnessCriterion criterion);

/// The criterion (thesis 4.5): true when the volume is to be recomputed.
bool isUnfit(const NodeFitness& node, const RefitPolicy& policy);

}  // namespace adaptive_bvh
