#pragma once

#include <limits>

#include "base/float4.h"

namespace adaptive_bvh {

/// An axis-aligned box in single precision; the fourth components are not used.
struct Box {
  Float4 low, high;

  ADAPTIVE_BVH_INLINE void add(const Box& other) {
    low = float4::lower(low, other.low);
    high = float4::upper(high, other.high);
  }
  ADAPTIVE_BVH_INLINE void add(const Float4& point) { add(Box{point, point}); }

  ADAPTIVE_BVH_INLINE Float4 center() const { return (low + high) * float4::all(0.5f); }
  ADAPTIVE_BVH_INLINE Float4 halfSides() const { return (high - low) * float4::all(0.5f); }

  /// The largest |x|, |y| or |z| of a point of the box.
  float largestCoordinate() const {
    return float4::largest(float4::upper(float4::absolute(low), float4::absolute(high)));
  }
};

/// Four boxes in structure-of-arrays layout: low[k] contains the four lower ends along axis k.
struct Boxes4 {
  Float4 low[3], high[3];

  ADAPTIVE_BVH_INLINE Box box(int lane) const {
    return {Float4{low[0][lane], low[1][lane], low[2][lane], 0},
            Float4{high[0][lane], high[1][lane], high[2][lane], 0}};
  }
};

ADAPTIVE_BVH_INLINE Boxes4 boxes4(const Box& a, const Box& b, const Box& c, const Box& d) {
  const float4::Columns low = float4::columns(a.low, b.low, c.low, d.low),
                        high = float4::columns(a.high, b.high, c.high, d.high);
  return {{low.x, low.y, low.z}, {high.x, high.y, high.z}};
}

/// An upper bound of squaredGaps for boxes that are at most `distance` apart: the square, rounded
/// up by more than the rounding errors of differences, squares and sums, and what underflow loses.
inline float squaredGapOf(double distance) {
  constexpr double kFar = 1e15;  // its square is within single precision
  constexpr double kLeast = 1e-37;
  return distance < kFar ? static_cast<float>(distance * distance * (1 + 1. / (1 << 20)) + kLeast)
                         : std::numeric_limits<float>::infinity();
}

/// The squared distances of the four boxes `a` from box `kLane` of `b`; 0 for boxes that overlap.
template <int kLane>
ADAPTIVE_BVH_INLINE Float4 squaredGaps(const Boxes4& a, const Boxes4& b) {
  using float4::broadcast;
  using float4::upper;
  const Float4 zero = float4::all(0);
  Float4 sum = zero;
  for (int k = 0; k < 3; ++k) {
    const Float4 gap = upper<Float4>(upper<Float4>(a.low[k] - broadcast<kLane>(b.high[k]),
                                                   broadcast<kLane>(b.low[k]) - a.high[k]),
                                     zero);
    sum += gap * gap;
  }
  return sum;
}

/// The squared gaps of all pairs of four boxes i and four boxes j: row[j][i].
struct Gaps4x4 {
  Float4 row[4];

  float operator()(int i, int j) const { return row[j][i]; }
  /// For each i, the smallest squared gap over all j.
  ADAPTIVE_BVH_INLINE Float4 least() const {
    return float4::lower<Float4>(float4::lower<Float4>(row[0], row[1]),
                                 float4::lower<Float4>(row[2], row[3]));
  }
  /// Sets bit 4 j + i where the squared gap of i and j is smaller than `squared_gap`.
  ADAPTIVE_BVH_INLINE unsigned below(float squared_gap) const {
    unsigned bits = 0;
    for (int j = 0; j < 4; ++j) bits |= float4::bits(row[j] < float4::all(squared_gap)) << (4 * j);
    return bits;
  }
};
ADAPTIVE_BVH_INLINE Gaps4x4 squaredGaps(const Boxes4& a, const Boxes4& b) {
  return {{squaredGaps<0>(a, b), squaredGaps<1>(a, b), squaredGaps<2>(a, b), squaredGaps<3>(a, b)}};
}

}  // namespace adaptive_bvh
