#pragma once

#include "geometry/body_frame.h"
#include "update/body_volume.h"
#include "volume/each_volume.h"
#include "volume/volume.h"

namespace adaptive_bvh {

/// From body coordinates to FCL's volumes in the model's, enlarged by what a fit in single
/// precision may have rounded: docs/bounds.md, 11.
template <typename BV>
class ModelVolumes {
 public:
  using S = typename BV::S;

  /// `extent`: bounds all coordinates in the body.
  ModelVolumes(const BodyFrame<S>& frame, float extent);

  /// Writes the first `count` of four to `to`.
  void write(const BodyVolume (&volumes)[kLanes], BV* const* to, int count) const;

 private:
  const BodyFrame<S>& frame_;
  const S unit_, error_;  ///< of a fit beyond its own operations
};

#define ADAPTIVE_BVH_INSTANTIATE(BV) extern template class ModelVolumes<BV>;
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
