#pragma once

#include <mutex>
#include <optional>

#include "tree/box_tree.h"
#include "tree/change_detector.h"
#include "tree/inflations.h"
#include "tree/refit_marks.h"
#include "tree/topology.h"
#include "tree/traversal_statistics.h"
#include "volume/each_volume.h"

namespace adaptive_bvh {

/// What is kept beside FCL's tree of one model: its shape, the boxes and inflations that an update
/// works with, what queries recorded, and a detector of changes that were not ours.
template <typename BV>
struct AdaptiveTree {
  using S = typename BV::S;

  AdaptiveTree() = default;
  AdaptiveTree(const AdaptiveTree& other)
      : adoptions(other.adoptions),
        topology(other.topology),
        axes(other.axes),
        boxes(other.boxes),
        inflations(other.inflations),
        statistics(other.statistics),
        refits(other.refits),
        detector(other.detector) {}

  /// Number of times that all that is kept began anew: by builds, repairs, and steps that could not
  /// be followed.
  int adoptions = 0;
  Topology topology;
  fcl::Matrix3d axes = fcl::Matrix3d::Identity();  ///< along which the body lies
  std::optional<BoxTree<S>> boxes;                 ///< with Propagation::TranslationCompensated
  Inflations<S> inflations;                        ///< of the volumes beside those boxes
  mutable TraversalStatistics statistics;  ///< written by queries, which hold the model const
  RefitMarks refits;                       ///< of the last step
  ChangeDetector<BV> detector;
  std::mutex repairing;  ///< held by the one thread that repairs a changed tree

  /// Takes over FCL's tree as it stands. Statistics begin anew; boxes and inflations are not set.
  void adopt(const fcl::BVHModel<BV>& model);

  /// Lets the bound of all volumes' coordinates begin anew, so that it does not lose digits.
  void restartCoordinateSum(const fcl::BVHModel<BV>& model);

  std::size_t bytes() const {
    return topology.bytes() + (boxes ? boxes->bytes() : 0) + inflations.bytes() +
           statistics.bytes() + refits.bytes();
  }
};

#define ADAPTIVE_BVH_INSTANTIATE(BV) extern template struct AdaptiveTree<BV>;
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
