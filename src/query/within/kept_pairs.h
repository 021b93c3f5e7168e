#pragma once

#include <array>
#include <memory>
#include <vector>

#include "query/within/candidate_rows.h"
#include "query/within/candidate_tester.h"
#include "query/within/kept_meshes.h"
#include "query/within/kept_request.h"
#include "query/within/pair_numbers.h"
#include "query/within/search_schedule.h"
#include "query/within/tracked_meshes.h"

namespace adaptive_bvh {

/// The pairs of a ContactSet of two meshes, or of one with itself. SearchSchedule decides what is
/// searched within a margin; what is found become candidates (CandidateRows), each with a reserve
/// of motion; those whose reserves are used up are tested (CandidateTester). docs/bounds.md, 21.
///
/// An update has two steps: `prepare` finds what has changed, and may throw; `commit` changes the
/// numbers. So several of these can share their PairNumbers, and all change or none.
class KeptPairs {
 public:
  /// Finds what has changed. Returns false if nothing has moved; then `commit` must not be called.
  /// After an exception, or without `commit`, the next call finds the same changes and further
  /// ones.
  bool prepare(const KeptMeshes& meshes, const KeptRequest& request);
  /// Prepares the removal of all pairs.
  void prepareRemoval(const KeptRequest& request);
  /// How many pairs the changes add and remove.
  const PairCounts& counts() const { return counts_; }
  /// Changes the numbers. PairNumbers::begin must have been called with these counts.
  void commit(const KeptMeshes& meshes, const KeptRequest& request, const BodyPair& bodies,
              PairNumbers& numbers) noexcept;
  /// Removes all pairs that prepareRemoval has found.
  void commitRemoval(PairNumbers& numbers) noexcept;
  /// Replaces links by those after PairNumbers::compact.
  void renumber(const std::array<std::vector<unsigned>, 3>& moved) noexcept;

  std::size_t numCandidates() const { return rows_.size(); }
  std::size_t tested() const { return tested_; }      ///< by the last `prepare`
  std::size_t searches() const { return searches_; }  ///< so far

 private:
  bool isCurrent(const KeptMeshes& meshes) const;
  void replaceMeshes(const KeptMeshes& meshes, const KeptRequest& request);
  void search(const KeptMeshes& meshes, const KeptRequest& request, SetSearch kind);
  void merge(const KeptMeshes& meshes, std::vector<FeaturePair>& found, bool is_all);
  void test(const KeptMeshes& meshes, const KeptRequest& request, bool takes_all);
  void addPairs(const CandidateTester& tester, const BodyPair& bodies, PairNumbers& numbers);
  void removePairs(const CandidateTester& tester, PairNumbers& numbers);
  FeatureTests::Pair pairOf(const CandidateTester& tester, const CandidateChange& change,
                            unsigned number) const;
  CandidateRows& candidates() { return has_next_ ? next_ : rows_; }

  // The meshes of the last `commit`.
  bool is_known_ = false;
  bool is_self_ = false;
  std::array<std::shared_ptr<const MeshTopology>, 2> topologies_;
  std::array<std::uint64_t, 2> versions_ = {0, 0};
  fcl::Transform3d tf1_ = fcl::Transform3d::Identity(), tf2_ = tf1_;

  // Candidates.
  SearchSchedule schedule_;
  CandidateRows rows_;
  CandidateRows next_;  ///< those of a search of everything, until `commit`
  bool has_next_ = false;
  std::vector<CandidateRows::Dropped> dropped_;  ///< candidates of rows_ that are not in next_
  TrackedMeshes tracked_;

  // Of the last `prepare`.
  std::vector<CandidateChanges> changes_;  ///< by part
  std::size_t num_changes_ = 0;            ///< number of parts
  std::vector<PairLink> discarded_;        ///< of pairs of other meshes
  PairCounts discarded_counts_;
  PairCounts counts_;
  std::size_t tested_ = 0, searches_ = 0;
};

}  // namespace adaptive_bvh
