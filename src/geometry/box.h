#pragma once

#include "geometry/float4.h"

namespace adaptive_bvh {

/// All points between two corners, sides along the axes.
struct Box {
  Float4 low, high;

  ADAPTIVE_BVH_INLINE void add(const Box& other) {
    low = float4::lower(low, other.low);
    high = float4::upper(high, other.high);
  }
  ADAPTIVE_BVH_INLINE void add(const Float4& point) { add(Box{point, point}); }

  ADAPTIVE_BVH_INLINE Float4 center() const { return (low + high) * float4::all(0.5f); }
  ADAPTIVE_BVH_INLINE Float4 halfSides() const { return (high - low) * float4::all(0.5f); }

  /// The largest |x|, |y| or |z| of all points.
  float largestCoordinate() const {
    return float4::largest(float4::upper(float4::absolute(low), float4::absolute(high)));
  }
};

}  // namespace adaptive_bvh
