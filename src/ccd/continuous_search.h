#pragma once

#include "adaptive_bvh/continuous_collision.h"
#include "ccd/swept_tree.h"
#include "triangles/time_of_impact.h"

// The queries of continuous_collision.h, in double precision. For one mesh and itself, `first` and
// `second` are the same object.
namespace adaptive_bvh {

/// One or two moving meshes, and the parameters of the query.
struct ContinuousQuery {
  const MovingMesh &first, &second;
  double separation;  ///< features come together where their distance is at most this
  int threads;

  bool isSelf() const { return &first == &second; }
};

/// The motion of two features, given by their numbers, which must exist.
MovingFeatures movingFeatures(const MovingMesh& first, const MovingMesh& second, FeatureKind kind,
                              const FeaturePair& pair);

/// Lists the pairs of features whose swept boxes are at most the separation apart.
void findCandidates(const ContinuousQuery& query, FeaturePairs& pairs);
/// Sets the time of impact of each pair; Impact::kNever if there is none.
void findTimes(const ContinuousQuery& query, const FeaturePairs& pairs, ImpactTimes& times);
/// Returns the earliest impact of all features.
Impact findEarliestImpact(const ContinuousQuery& query);
/// The same, and lists all candidates in `pairs`.
Impact findEarliestImpact(const ContinuousQuery& query, FeaturePairs& pairs);
/// Sets the length, at most that of its motion, by which each vertex may move from its start, in
/// any direction and all at once, without features coming nearer than the separation. `of_second`
/// stays as it is for one mesh and itself.
void findSafeDisplacements(const ContinuousQuery& query, std::vector<double>& of_first,
                           std::vector<double>& of_second);
/// Sets the share of its way that each vertex may go, in any order and at any speed, without
/// features coming nearer than the separation (FeatureTruncation). `of_second` stays as it is for
/// one mesh and itself.
void findTruncation(const ContinuousQuery& query, std::vector<double>& of_first,
                    std::vector<double>& of_second);

}  // namespace adaptive_bvh
