#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <optional>

#include "tree/box_tree.h"
#include "tree/change_detector.h"
#include "tree/contours_on_demand.h"
#include "tree/feature_leaves.h"
#include "tree/motion_bounds.h"
#include "tree/refit_marks.h"
#include "tree/topology.h"
#include "tree/traversal_statistics.h"
#include "tree/volume_demand.h"
#include "tree/wide_tree_on_demand.h"
#include "tree/witness_cache.h"
#include "volume/each_volume.h"

namespace adaptive_bvh {

/// What is kept beside FCL's tree of one model, for queries to read: its boxes and how they moved,
/// what queries recorded, and a detector of changes that were not ours.
template <typename BV>
struct AdaptiveTree {
  using S = typename BV::S;

  AdaptiveTree() = default;
  AdaptiveTree(const AdaptiveTree& other)
      : topology(other.topology),
        axes(other.axes),
        boxes(other.boxes),
        motion(other.motion),
        statistics(other.statistics),
        refits(other.refits),
        query_threads(other.query_threads),
        detector(other.detector) {
    setVolumesCurrent(other.volumesAreCurrent());
    setBoxesCurrent(other.boxesAreCurrent());
  }

  /// A number that no other tree has. A new one whenever accumulated motions or the topology begin
  /// anew.
  std::uint64_t generation = newGeneration();
  /// Numbers that no other topology, and no other positions, of any tree have.
  std::uint64_t topology_number = newGeneration(), positions = newGeneration();
  Topology topology;
  /// Along which the body lies: those of its boxes, where these do not wait.
  fcl::Matrix3d axes = fcl::Matrix3d::Identity();
  std::optional<BoxTree<S>> boxes;         ///< with Propagation::TranslationCompensated
  MotionBounds<S> motion;                  ///< of the volumes beside those boxes
  mutable TraversalStatistics statistics;  ///< written by queries, which hold the model const
  RefitMarks refits;                       ///< of the last step
  mutable WitnessCache witnesses;          ///< written by queries, too
  mutable WideTreeOnDemand<S> wide;        ///< written by queries, too
  mutable FeatureOwnersOnDemand owners;    ///< written by queries, too
  mutable FeaturesOnDemand features;       ///< written by queries, too
  mutable ContoursOnDemand contours;       ///< written by queries, too
  mutable VolumeDemand demand;             ///< told by queries
  int query_threads = 1;                   ///< that one query may use
  ChangeDetector<BV> detector;
  std::mutex repairing;  ///< held by the one thread that repairs a changed tree

  /// False while FCL's nodes wait to be brought up to date (RefitPolicy::volumes_rest and
  /// volumes_on_demand): then our queries read the boxes only.
  bool volumesAreCurrent() const { return volumes_current_.load(std::memory_order_acquire); }
  void setVolumesCurrent(bool current) {
    volumes_current_.store(current, std::memory_order_release);
  }
  /// False while the boxes wait, too, and the motion beside them: only the positions may be read,
  /// the topology, and what queries make of both. Volumes wait whenever boxes do.
  bool boxesAreCurrent() const { return boxes_current_.load(std::memory_order_acquire); }
  void setBoxesCurrent(bool current) { boxes_current_.store(current, std::memory_order_release); }

  static std::uint64_t newGeneration();
  /// The vertices are about to move, or have moved.
  void setMoved() { positions = newGeneration(); }

  /// Takes over FCL's tree as it stands. Statistics begin anew; boxes and motion are not set.
  void adopt(const fcl::BVHModel<BV>& model);

  /// Lets the sums over steps begin anew, so that they do not lose digits.
  void restartMotion(const fcl::BVHModel<BV>& model);

  std::size_t bytes() const {
    return topology.bytes() + (boxes ? boxes->bytes() : 0) + motion.bytes() + statistics.bytes() +
           refits.bytes() + wide.bytes() + owners.bytes() + features.bytes() + contours.bytes();
  }

 private:
  std::atomic<bool> volumes_current_{true}, boxes_current_{true};
};

#define ADAPTIVE_BVH_INSTANTIATE(BV) extern template struct AdaptiveTree<BV>;
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
