#pragma once

#include <array>
#include <memory>
#include <vector>

#include "query/within/candidate_rows.h"
#include "query/within/candidate_tester.h"
#include "query/within/kept_request.h"
#include "query/within/pair_motion.h"
#include "query/within/pair_numbers.h"
#include "query/within/searched_positions.h"
#include "query/within/tracked_triangles.h"

namespace adaptive_bvh {

/// The pairs of a ContactSet of two meshes, or of one with itself: candidates within a margin
/// (CandidateRows), with a reserve of motion for each; and the positions at which the trees were
/// searched. docs/bounds.md, 21.
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
  enum class Search { None, Marked, All, Anew };

  bool isCurrent(const KeptMeshes& meshes) const;
  void replaceMeshes(const KeptMeshes& meshes, const KeptRequest& request);
  Search nextSearch(const KeptMeshes& meshes, const KeptRequest& request, bool was_known);
  Search searchWithin(const KeptMeshes& meshes, const KeptRequest& request, double margin);
  void measureVertices(const KeptMeshes& meshes, double limit);
  void search(const KeptMeshes& meshes, const KeptRequest& request, Search kind);
  void merge(const KeptMeshes& meshes, std::vector<FeaturePair>& found, bool is_all);
  void markMoved(const KeptMeshes& meshes);
  void recordSearch(const KeptMeshes& meshes, Search kind);
  void track(const KeptMeshes& meshes, const KeptRequest& request, bool is_new);
  bool readPositions(const KeptMeshes& meshes);
  void allowMotion();
  void restartTracking(const KeptMeshes& meshes, const KeptRequest& request);
  void test(const KeptMeshes& meshes, const KeptRequest& request, bool takes_all);
  CandidateRows& candidates() { return has_next_ ? next_ : rows_; }
  TrackedTriangles& tracked(int side) { return tracked_[is_self_ ? 0 : std::size_t(side)]; }

  // The meshes of the last `commit`.
  bool is_known_ = false;
  bool is_self_ = false;
  std::array<std::shared_ptr<const MeshTopology>, 2> topologies_;
  std::array<std::uint64_t, 2> versions_ = {0, 0};
  fcl::Transform3d tf1_ = fcl::Transform3d::Identity(), tf2_ = tf1_;

  // Candidates.
  CandidateRows rows_;
  CandidateRows next_;  ///< those of a search of everything, until `commit`
  bool has_next_ = false;
  std::vector<CandidateRows::Dropped> dropped_;  ///< candidates of rows_ that are not in next_
  std::array<TrackedTriangles, 2> tracked_;      ///< of one mesh with itself only the first
  MotionUnit unit_;
  double radii_ = 0;     ///< at restartTracking
  double rounding_ = 0;  ///< bounds the error of distances that are near the limit

  // Searches.
  PairMotion motion_;
  double margin_ = 0;     ///< of the candidates; 0 if they are the near pairs
  double allowance_ = 0;  ///< the PairMotion until the margin may be used up
  double used_ = 0;       ///< upper bound of the motion of vertices since they were searched
  std::array<SearchedVertices, 2> searched_;
  fcl::Vector3d translation_ =
      fcl::Vector3d::Zero();  ///< of all vertices, since they were searched
  VertexMotion moved_;        ///< by measureVertices
  std::array<std::vector<unsigned>, 2> moved_vertices_;
  std::array<MovedLeaves, 2> leaves_;
  std::array<std::vector<std::uint8_t>, 2> marks_;  ///< by node
  double steps_ = 0;                                ///< since the margin was chosen
  double searched_share_ = 0;  ///< sum of the shares of vertices that were searched since

  // Of the last `prepare`.
  std::vector<CandidateChanges> changes_;  ///< by part
  std::size_t num_changes_ = 0;            ///< number of parts
  std::vector<PairLink> discarded_;        ///< of pairs of other meshes
  PairCounts discarded_counts_;
  PairCounts counts_;
  std::size_t tested_ = 0, searches_ = 0;
};

}  // namespace adaptive_bvh
