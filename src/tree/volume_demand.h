#pragma once

#include <algorithm>
#include <atomic>

namespace adaptive_bvh {

/// Which of what an update keeps is asked for: FCL's volumes, the tree of boxes beside them, or
/// only what queries make of the positions, as four-wide trees. What nobody asks for may rest
/// (RefitPolicy::volumes_rest). Queries may tell it on many threads at once. A copy begins anew.
class VolumeDemand {
 public:
  VolumeDemand() = default;
  VolumeDemand(const VolumeDemand&) {}
  VolumeDemand& operator=(const VolumeDemand&) = delete;

  void askForVolumes() { set(volumes_); }
  void askForBoxTree() { set(box_tree_); }
  /// Of every query that does not ask for volumes.
  void askForPositions() { set(positions_); }

  /// At the start of a step: looks at what was asked for since the last one. Who asks for volumes
  /// that rest makes the next rest come later: they had to be recomputed.
  void nextStep() {
    const bool for_volumes = take(volumes_), for_positions = take(positions_);
    box_tree_was_read_ = take(box_tree_);
    if (for_volumes) {
      if (volumesMayRest()) patience_ = std::min(2 * patience_, kMostPatience);
      steps_ = 0;
    } else if (for_positions && !volumesMayRest()) {
      ++steps_;
    }
  }
  /// In the step that has begun.
  bool volumesMayRest() const { return steps_ >= patience_; }
  bool boxTreeMayRest() const { return !box_tree_was_read_; }

 private:
  static constexpr int kLeastPatience = 1, kMostPatience = 1 << 10;

  /// Threads that query share it: it is written once a step.
  static void set(std::atomic<bool>& flag) {
    if (!flag.load(std::memory_order_relaxed)) flag.store(true, std::memory_order_relaxed);
  }

  static bool take(std::atomic<bool>& flag) {
    return flag.exchange(false, std::memory_order_relaxed);
  }

  std::atomic<bool> volumes_{false}, box_tree_{false}, positions_{false};
  bool box_tree_was_read_ = false;
  int steps_ = 0;  ///< in a row in which there were queries, and none for volumes
  int patience_ = kLeastPatience;
};

}  // namespace adaptive_bvh
