#pragma once

#include <algorithm>

#include "geometry/rounding.h"
#include "update/update_target.h"

namespace adaptive_bvh {

/// Keeps volumes that rest sound: they are neither moved nor refitted, but hold their triangles
/// wherever these have gone since, because all have grown by more than any vertex has moved. Nobody
/// looks at them, so they grow seldom, and by much more than is needed then.
template <typename BV>
class VolumeCover {
 public:
  using S = typename BV::S;

  /// The volumes have been fitted, or moved along.
  void restart() { moved_ = reach_ = 0; }
  /// A step in which no vertex has moved by more than `largest`. False where volumes that hold the
  /// whole way would be very much larger than the body: they are to be refitted.
  bool follow(const UpdateTarget<BV>& target, S largest) {
    constexpr S kLongWay = 256, kAhead = 16;
    moved_ = rounding::sum(moved_, largest);
    if (moved_ <= reach_) return true;
    if (!(moved_ <= kLongWay * target.model.aabb_radius)) return false;
    growTo(target, std::max(kAhead * moved_, target.model.aabb_radius / kAhead));
    return true;
  }

 private:
  void growTo(const UpdateTarget<BV>& target, S reach) {
    const S growth = reach - reach_;
    for (int i = 0; i < target.nodes(); ++i) grow(target.volume(i), growth);
    reach_ = reach;
    BV& root = target.volume(0);
    target.tree.detector.record(root, root);
  }
  /// What is rounded off the sum is less than the least of these margins.
  static void grow(BV& volume, S growth) {
    constexpr S kEpsilon = rounding::epsilon<S>();
    const S rounded = 4 * kEpsilon * (Volume<BV>::cornerSum(volume) + growth);
    Volume<BV>::move(volume, fcl::Vector3<S>::Zero(), growth + rounded + rounding::tiny<S>());
  }

  S moved_ = 0;  ///< a bound of how far any vertex has moved since, step by step
  S reach_ = 0;  ///< by so much all volumes have grown since
};

}  // namespace adaptive_bvh
