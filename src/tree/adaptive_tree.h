#pragma once

#include <mutex>

#include "tree/change_detector.h"
#include "tree/inflations.h"
#include "tree/refit_marks.h"
#include "tree/topology.h"
#include "tree/traversal_statistics.h"
#include "volume/each_volume.h"

namespace adaptive_bvh {

/// What is kept beside FCL's tree of one model: its shape, the inflations that an update works
/// with, what queries recorded, and a detector of changes that were not ours.
template <typename BV>
struct AdaptiveTree {
  using S = typename BV::S;

  AdaptiveTree() = default;
  AdaptiveTree(const AdaptiveTree& other)
      : adoptions(other.adoptions),
        topology(other.topology),
        inflations(other.inflations),
        statistics(other.statistics),
        refits(other.refits),
        detector(other.detector) {}

  /// Number of times that all that is kept began anew: by builds, repairs, and steps that could not
  /// be followed.
  int adoptions = 0;
  Topology topology;
  Inflations<S> inflations;                ///< with Propagation::TranslationCompensated
  mutable TraversalStatistics statistics;  ///< written by queries, which hold the model const
  RefitMarks refits;                       ///< of the last step
  ChangeDetector<BV> detector;
  std::mutex repairing;  ///< held by the one thread that repairs a changed tree

  /// Takes over FCL's tree as it stands. Statistics begin anew; inflations are not set.
  void adopt(const fcl::BVHModel<BV>& model);

  /// Lets the bound of all volumes' coordinates begin anew, so that it does not lose digits.
  void restartCoordinateSum(const fcl::BVHModel<BV>& model);

  std::size_t bytes() const {
    return topology.bytes() + inflations.bytes() + statistics.bytes() + refits.bytes();
  }
};

#define ADAPTIVE_BVH_INSTANTIATE(BV) extern template struct AdaptiveTree<BV>;
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
