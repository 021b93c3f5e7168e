#pragma once

#include <algorithm>
#include <atomic>

namespace adaptive_bvh {

/// Who has asked for FCL's volumes, and who for the boxes beside them: volumes that nobody asks for
/// may rest (RefitPolicy::volumes_rest). Queries may tell it on many threads at once. A copy begins
/// anew.
class VolumeDemand {
 public:
  VolumeDemand() = default;
  VolumeDemand(const VolumeDemand&) {}
  VolumeDemand& operator=(const VolumeDemand&) = delete;

  void askForVolumes() { set(volumes_); }
  void askForBoxes() { set(boxes_); }

  /// At the start of a step, with what was asked for since the last one. Whether the volumes may
  /// rest in it. Who asks for volumes that rest makes the next rest come later: they had to be
  /// recomputed.
  bool mayRest() {
    const bool for_volumes = volumes_.exchange(false, std::memory_order_relaxed),
               for_boxes = boxes_.exchange(false, std::memory_order_relaxed);
    if (for_volumes) {
      if (steps_ >= patience_) patience_ = std::min(2 * patience_, kMostPatience);
      steps_ = 0;
    } else if (for_boxes && steps_ < patience_) {
      ++steps_;
    }
    return steps_ >= patience_;
  }

 private:
  static constexpr int kLeastPatience = 3, kMostPatience = 1 << 10;

  /// Threads that query share it: it is written once a step.
  static void set(std::atomic<bool>& flag) {
    if (!flag.load(std::memory_order_relaxed)) flag.store(true, std::memory_order_relaxed);
  }

  std::atomic<bool> volumes_{false}, boxes_{false};
  int steps_ = 0;  ///< in a row in which there were queries by boxes, and no others
  int patience_ = kLeastPatience;
};

}  // namespace adaptive_bvh
