#pragma once

#include <cmath>

#if defined(__SSE__)
#include <xmmintrin.h>
#endif

/// For what is too small to be called, in the hottest loops.
#define ADAPTIVE_BVH_INLINE [[gnu::always_inline]] inline

namespace adaptive_bvh {

/// Four numbers in single precision, worked on at once (a vector extension of GCC and Clang). Three
/// of them mean x, y, z; the fourth comes along and means nothing.
using Lanes = float __attribute__((vector_size(16)));

namespace lanes {

/// From any address: four numbers are read and written, not three.
ADAPTIVE_BVH_INLINE Lanes load(const float* from) {
  Lanes v;
  __builtin_memcpy(&v, from, sizeof(v));
  return v;
}
ADAPTIVE_BVH_INLINE void store(const Lanes& v, float* to) { __builtin_memcpy(to, &v, sizeof(v)); }

ADAPTIVE_BVH_INLINE Lanes all(float x) { return Lanes{x, x, x, x}; }

/// One of the numbers, four times.
template <int kLane>
ADAPTIVE_BVH_INLINE Lanes broadcast(const Lanes& v) {
  return all(v[kLane]);
}

ADAPTIVE_BVH_INLINE Lanes lower(const Lanes& a, const Lanes& b) { return a < b ? a : b; }
ADAPTIVE_BVH_INLINE Lanes upper(const Lanes& a, const Lanes& b) { return a > b ? a : b; }

ADAPTIVE_BVH_INLINE Lanes absolute(const Lanes& v) { return upper(v, -v); }

ADAPTIVE_BVH_INLINE Lanes squareRoot(const Lanes& v) {
#if defined(__SSE__)
  return _mm_sqrt_ps(v);
#else
  return Lanes{std::sqrt(v[0]), std::sqrt(v[1]), std::sqrt(v[2]), std::sqrt(v[3])};
#endif
}

/// x + y + z, and their largest.
ADAPTIVE_BVH_INLINE float sum(const Lanes& v) { return v[0] + v[1] + v[2]; }
ADAPTIVE_BVH_INLINE float largest(const Lanes& v) { return std::fmax(std::fmax(v[0], v[1]), v[2]); }

/// x + y + z of each of the four.
ADAPTIVE_BVH_INLINE Lanes sums(const Lanes& a, const Lanes& b, const Lanes& c, const Lanes& d) {
#if defined(__SSE__)
  const Lanes ab_low = _mm_unpacklo_ps(a, b), cd_low = _mm_unpacklo_ps(c, d);
  const Lanes ab_high = _mm_unpackhi_ps(a, b), cd_high = _mm_unpackhi_ps(c, d);
  return Lanes(_mm_movelh_ps(ab_low, cd_low)) + Lanes(_mm_movehl_ps(cd_low, ab_low)) +
         Lanes(_mm_movelh_ps(ab_high, cd_high));
#else
  return Lanes{sum(a), sum(b), sum(c), sum(d)};
#endif
}

}  // namespace lanes

/// All points between two corners.
struct Box {
  Lanes low, high;

  ADAPTIVE_BVH_INLINE void add(const Box& other) {
    low = lanes::lower(low, other.low);
    high = lanes::upper(high, other.high);
  }
  ADAPTIVE_BVH_INLINE void add(const Lanes& point) { add(Box{point, point}); }

  /// The largest coordinate, by amount.
  float reach() const {
    return lanes::largest(lanes::upper(lanes::absolute(low), lanes::absolute(high)));
  }
};

}  // namespace adaptive_bvh
