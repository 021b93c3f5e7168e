#pragma once

#include <embree3/rtcore.h>

#include <cfloat>
#include <cmath>
#include <memory>
#include <type_traits>

#include "method.h"

namespace adaptive_bvh_bench {

/// A float below or at x, at most two floats away.
inline float roundedDown(double x) {
  const auto f = float(x);
  return double(f) <= x ? f : f - std::abs(f) * FLT_EPSILON - FLT_MIN;
}
inline float roundedUp(double x) { return -roundedDown(-x); }

inline void write(const Eigen::AlignedBox3d& box, RTCBounds& bounds) {
  bounds.lower_x = roundedDown(box.min()[0]);
  bounds.lower_y = roundedDown(box.min()[1]);
  bounds.lower_z = roundedDown(box.min()[2]);
  bounds.upper_x = roundedUp(box.max()[0]);
  bounds.upper_y = roundedUp(box.max()[1]);
  bounds.upper_z = roundedUp(box.max()[2]);
}

namespace embree {

struct Release {
  void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
  void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
  void operator()(RTCGeometry geometry) const { rtcReleaseGeometry(geometry); }
};
template <typename Handle>
using Owned = std::unique_ptr<std::remove_pointer_t<Handle>, Release>;

}  // namespace embree
}  // namespace adaptive_bvh_bench
