#pragma once

#include <vector>

#include "query/within/candidate_rows.h"
#include "query/within/feature_tests.h"
#include "query/within/kept_meshes.h"
#include "query/within/kept_request.h"
#include "query/within/tracked_meshes.h"
#include "triangles/triangle_distances4.h"

namespace adaptive_bvh {

/// What an update changes about a candidate.
struct CandidateChange {
  unsigned row, at;
  CandidateRows::Bits bits;  ///< its pairs that are near now
  bool is_dropped;           ///< whether it is no longer a candidate
};

/// The result of testing some candidates.
struct CandidateChanges {
  std::vector<CandidateChange> changes;
  PairCounts counts;
  std::size_t tested = 0;

  void clear() {
    changes.clear();
    counts = {};
    tested = 0;
  }
};

/// Tests the candidates of a ContactSet that may have changed sides since they were last tested, by
/// the tests of pairsWithin and featurePairsWithin.
///
/// The reserve of a candidate (CandidateRows::reserve) is the difference of the centres of both
/// triangles at the time of the test; in the fourth component, how far the distance was from the
/// limit, plus both deformations. So while the change of that difference is shorter than what the
/// deformations have left of the fourth component, no pair has changed sides: docs/bounds.md, 21.
class CandidateTester {
 public:
  /// `radii`: the sum of both meshes' radii. `first`, `second`: the same for one mesh with itself.
  CandidateTester(const KeptMeshes& meshes, const KeptRequest& request, double radii)
      : meshes_(meshes), request_(request), features_(request.distance, radii, meshes.is_self) {}

  /// Tests the candidates of rows whose reserves are used up. `drop_distance`: pairs that are
  /// farther apart are no longer candidates.
  void testUsedUp(CandidateRows& candidates, const TrackedMeshes& tracked, double drop_distance,
                  unsigned row, unsigned end_row, CandidateChanges& result) const;
  /// Takes all candidates of rows for near pairs of triangles.
  void takeAll(const CandidateRows& candidates, const TrackedMeshes& tracked, unsigned row,
               unsigned end_row, CandidateChanges& result) const;

  /// The pair with a number (FeatureTests), by the leaf indices of both triangles. For triangles
  /// there is one, with the number 0.
  FeatureTests::Pair pair(unsigned number, unsigned leaf1, unsigned leaf2) const;

 private:
  class UsedUp;
  friend class UsedUp;

  bool isIgnored(const FeatureTests::Pair& pair) const;
  CandidateRows::Bits nearFeatures(unsigned leaf1, unsigned leaf2) const;
  CandidateRows::Bits admitted(CandidateRows::Bits bits, CandidateRows::Bits before, unsigned leaf1,
                               unsigned leaf2) const;
  FeatureTests::Triangle triangle(int side, unsigned leaf, const TrianglePoints& points) const;
  void change(const CandidateChange& change, CandidateRows::Bits before,
              CandidateChanges& result) const;

  const KeptMeshes& meshes_;
  const KeptRequest& request_;
  const FeatureTests features_;
};

}  // namespace adaptive_bvh
