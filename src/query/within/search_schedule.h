#pragma once

#include "query/within/displacements.h"
#include "query/within/kept_meshes.h"
#include "query/within/pair_motion.h"

namespace adaptive_bvh {

/// How an update of a ContactSet searches the trees.
enum class SetSearch {
  None,   ///< not at all: no pair has used up the margin
  Moved,  ///< within the distance, pairs of nodes that have used up the margin
  All,    ///< within the distance and a margin, everything
  Anew,   ///< within the distance, everything; the next update must search everything again
};

/// Decides in each update of a ContactSet what is searched, and within which margin: candidates are
/// the pairs of triangles that are at most the set's distance and the margin apart, when everything
/// is searched; and those that are found later. docs/bounds.md, 21.
class SearchSchedule {
 public:
  /// Decides about an update. `is_known`: whether there were others, of the same triangles.
  SetSearch next(const KeptMeshes& meshes, double distance, bool is_known);
  /// Records that the search has been made. `found`: the number of pairs that it has found;
  /// `candidates`: the number of all.
  void record(const KeptMeshes& meshes, SetSearch search, std::size_t found,
              std::size_t candidates);
  /// Records the share of the candidates that the update has tested.
  void recordTests(double share) {
    if (steps_ > 0) tested_ += share;  // after a search of everything new ones are tested
  }
  /// The meshes have other triangles now.
  void forget() {
    margin_ = 0;
    displacements_.clear();
  }

  double margin() const { return margin_; }  ///< 0 without one
  /// For a search of what has moved: the pairs of nodes.
  MovedNodes moved() const { return displacements_.nodes(); }

 private:
  SetSearch withMargin(const KeptMeshes& meshes, double distance);
  SetSearch withoutMargin(const KeptMeshes& meshes, double distance);
  double nextMargin(const KeptMeshes& meshes, double distance, double speed, double fastest);
  SetSearch searchAll(const KeptMeshes& meshes, double distance, double margin);

  PairMotion motion_;
  double margin_ = 0;
  double allowance_ = 0;         ///< the PairMotion until the margin may be used up
  Displacements displacements_;  ///< empty if they are not measured
  double steps_ = 0;             ///< updates since everything was searched
  double searches_ = 0;          ///< of what has moved, since; in searches of everything
  double tested_ = 0;            ///< sum of the shares that were tested since
  unsigned anew_ = 0;            ///< updates without a margin, one after the other
  double speed_ = 0;      ///< of a vertex in a step; half the motion of two relative to each other
  double deviating_ = 1;  ///< what part of half the largest motion the deviation was when measured
};

}  // namespace adaptive_bvh
