#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <mutex>
#include <vector>

#include "base/rounding.h"
#include "volumes/change_detector.h"
#include "volumes/each_volume.h"
#include "volumes/topology.h"
#include "volumes/traversal_statistics.h"

namespace adaptive_bvh {

/// By how much each volume was inflated since it was last refitted, in body units, and a bound of
/// all volumes' coordinates. Every sum is rounded up, so that no step is lost in it.
template <typename S>
class Inflations {
 public:
  /// Room for `nodes` nodes, none inflated.
  void reset(int nodes) { inflations_.assign(static_cast<std::size_t>(nodes), 0.f); }

  /// Radius of FCL's volume less its radius when last refitted.
  float of(int node) const { return inflations_[static_cast<std::size_t>(node)]; }
  void set(int node, float inflation) { inflations_[static_cast<std::size_t>(node)] = inflation; }
  /// By node.
  float* data() { return inflations_.data(); }

  /// Bounds Volume::cornerSum of all volumes.
  S coordinateSum() const { return coordinate_sum_; }
  /// A volume has been refitted whose Volume::cornerSum this is.
  void include(S corner_sum) { coordinate_sum_ = std::max(coordinate_sum_, corner_sum); }
  /// Call this before volumes are moved for displacements of at most `largest`. A volume whose
  /// displacements have the middle c and half sides h moves by |c|_1 <= 3 largest - |h|_1 and grows
  /// by |h|_2, by `roundingOfMove` and by single precision's share (of a body unit). Rounded up:
  /// steps too small to change the sum must not be lost.
  void extend(S largest, S body_unit) {
    if (!(largest > 0)) return;
    way_ += largest;
    coordinate_sum_ = (coordinate_sum_ + 4 * largest + body_unit * S(1.f / (1ull << 56))) *
                      (1 + 8 * rounding::epsilon<S>());
  }
  /// What moving a volume in a step may round off, in the mesh's units.
  S roundingOfMove() const {
    return 4 * rounding::epsilon<S>() * coordinate_sum_ + rounding::tiny<S>();
  }

  /// Whether steps have made the coordinate sum so much larger than the volumes' that it should
  /// begin anew. They are some sixty times the body's size long then.
  bool needsRestart(S body_unit) const { return way_ > 64 * body_unit; }
  /// Lets the coordinate sum begin anew; `include` is to follow for every volume.
  void restart() { way_ = coordinate_sum_ = 0; }

  std::size_t bytes() const { return inflations_.capacity() * sizeof(float); }

 private:
  std::vector<float> inflations_;
  S coordinate_sum_ = 0;
  S way_ = 0;  ///< the largest displacements since `restart`, summed
};

/// Which volumes the last update recomputed. A byte a node holds the number of the step that did
/// it; a step clears all marks by raising that number. Several threads may mark different nodes.
class RefitMarks {
 public:
  /// Room for `nodes` nodes, none marked.
  void reset(int nodes) {
    steps_.assign(static_cast<std::size_t>(nodes), 0);
    step_ = 1;
  }
  /// Forgets all marks.
  void clear() {
    if (++step_ != 0) return;
    std::fill(steps_.begin(), steps_.end(), std::uint8_t(0));
    step_ = 1;
  }
  void mark(int node) { steps_[static_cast<std::size_t>(node)] = step_; }
  void markAll() { std::fill(steps_.begin(), steps_.end(), step_); }
  /// In ascending order.
  std::vector<int> marked() const {
    std::vector<int> nodes;
    if (steps_.empty()) return nodes;
    const std::uint8_t *const first = steps_.data(), *const end = first + steps_.size();
    for (const std::uint8_t* at = first; at < end; ++at) {
      at = static_cast<const std::uint8_t*>(
          std::memchr(at, step_, static_cast<std::size_t>(end - at)));
      if (!at) break;
      nodes.push_back(static_cast<int>(at - first));
    }
    return nodes;
  }

  std::size_t bytes() const { return steps_.capacity(); }

 private:
  std::vector<std::uint8_t> steps_;  // 0 is no step
  std::uint8_t step_ = 1;
};

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
