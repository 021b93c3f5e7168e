#pragma once

#include <cmath>

#include "geometry/pack.h"

namespace adaptive_bvh {

/// Four numbers in single precision: x, y, z, and a fourth that is not used. Loads and stores touch
/// all four.
using Float4 = Pack<float>;

namespace float4 {

using packs::load;
using packs::lower;
using packs::squareRoot;
using packs::store;
using packs::upper;

ADAPTIVE_BVH_INLINE Float4 all(float x) { return Float4{x, x, x, x}; }

/// One of the numbers, four times.
template <int kLane>
ADAPTIVE_BVH_INLINE Float4 broadcast(const Float4& v) {
  return all(v[kLane]);
}

ADAPTIVE_BVH_INLINE Float4 absolute(const Float4& v) { return upper<Float4>(v, -v); }

/// x + y + z, and the largest of x, y, z.
ADAPTIVE_BVH_INLINE float sum(const Float4& v) { return v[0] + v[1] + v[2]; }
ADAPTIVE_BVH_INLINE float largest(const Float4& v) {
  return std::fmax(std::fmax(v[0], v[1]), v[2]);
}

/// x + y + z of each of the four.
ADAPTIVE_BVH_INLINE Float4 sums(const Float4& a, const Float4& b, const Float4& c,
                                const Float4& d) {
#if defined(__SSE2__)
  const Float4 ab_low = _mm_unpacklo_ps(a, b), cd_low = _mm_unpacklo_ps(c, d);
  const Float4 ab_high = _mm_unpackhi_ps(a, b), cd_high = _mm_unpackhi_ps(c, d);
  return Float4(_mm_movelh_ps(ab_low, cd_low)) + Float4(_mm_movehl_ps(cd_low, ab_low)) +
         Float4(_mm_movelh_ps(ab_high, cd_high));
#else
  return Float4{sum(a), sum(b), sum(c), sum(d)};
#endif
}

}  // namespace float4
}  // namespace adaptive_bvh
