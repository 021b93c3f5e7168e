#pragma once

#include <cmath>

#include "base/pack.h"

namespace adaptive_bvh {

/// Four numbers in single precision, as a 3D vector (x, y, z, unused) or as one number for each of
/// four objects. Loads and stores touch all four.
using Float4 = Pack<float>;

namespace float4 {

using packs::absolute;
using packs::bits;
using packs::load;
using packs::lower;
using packs::squareRoot;
using packs::store;
using packs::upper;

/// Stores x, y and z only.
ADAPTIVE_BVH_INLINE void store3(const Float4& v, float* to) {
  __builtin_memcpy(to, &v, 3 * sizeof(float));
}

ADAPTIVE_BVH_INLINE Float4 all(float x) { return Float4{x, x, x, x}; }

/// Repeats the number at `kLane` four times.
template <int kLane>
ADAPTIVE_BVH_INLINE Float4 broadcast(const Float4& v) {
  return all(v[kLane]);
}

/// x + y + z; the fourth number is left out.
ADAPTIVE_BVH_INLINE float sum(const Float4& v) { return v[0] + v[1] + v[2]; }
/// The maximum of x, y and z.
ADAPTIVE_BVH_INLINE float largest(const Float4& v) {
  return std::fmax(std::fmax(v[0], v[1]), v[2]);
}

/// The vector (y, z, x).
ADAPTIVE_BVH_INLINE Float4 rotated(const Float4& v) {
#if defined(__SSE2__)
  return _mm_shuffle_ps(v, v, _MM_SHUFFLE(3, 0, 2, 1));
#else
  return Float4{v[1], v[2], v[0], v[3]};
#endif
}
ADAPTIVE_BVH_INLINE Float4 cross(const Float4& a, const Float4& b) {
  return rotated(a * rotated(b) - rotated(a) * b);  // the inner difference is (z, x, y)
}
ADAPTIVE_BVH_INLINE float dot(const Float4& a, const Float4& b) { return sum(a * b); }

/// The transpose of four vectors: x holds the x of all four, and so on. Bits are copied unchanged.
struct Rows {
  Float4 x, y, z, w;
};
ADAPTIVE_BVH_INLINE Rows transposed(const Float4& a, const Float4& b, const Float4& c,
                                    const Float4& d) {
#if defined(__SSE2__)
  const Float4 ab_low = _mm_unpacklo_ps(a, b), cd_low = _mm_unpacklo_ps(c, d);
  const Float4 ab_high = _mm_unpackhi_ps(a, b), cd_high = _mm_unpackhi_ps(c, d);
  return {_mm_movelh_ps(ab_low, cd_low), _mm_movehl_ps(cd_low, ab_low),
          _mm_movelh_ps(ab_high, cd_high), _mm_movehl_ps(cd_high, ab_high)};
#else
  return {Float4{a[0], b[0], c[0], d[0]}, Float4{a[1], b[1], c[1], d[1]},
          Float4{a[2], b[2], c[2], d[2]}, Float4{a[3], b[3], c[3], d[3]}};
#endif
}

using Columns = Vectors<Float4>;
/// The transpose without the fourth components.
ADAPTIVE_BVH_INLINE Columns columns(const Float4& a, const Float4& b, const Float4& c,
                                    const Float4& d) {
  const Rows rows = transposed(a, b, c, d);
  return {rows.x, rows.y, rows.z};
}

/// The sums x + y + z of four vectors.
ADAPTIVE_BVH_INLINE Float4 sums(const Float4& a, const Float4& b, const Float4& c,
                                const Float4& d) {
  const Columns all = columns(a, b, c, d);
  return all.x + all.y + all.z;
}

/// Rounds doubles to single precision: two, followed by zeros, or four.
ADAPTIVE_BVH_INLINE Float4 narrowed(const Pack<double>& xy) {
#if defined(__SSE2__)
  return _mm_cvtpd_ps(xy);
#else
  return Float4{static_cast<float>(xy[0]), static_cast<float>(xy[1]), 0, 0};
#endif
}
ADAPTIVE_BVH_INLINE Float4 narrowed(const Pack<double>& xy, const Pack<double>& zw) {
#if defined(__SSE2__)
  return _mm_movelh_ps(narrowed(xy), narrowed(zw));
#else
  return Float4{static_cast<float>(xy[0]), static_cast<float>(xy[1]), static_cast<float>(zw[0]),
                static_cast<float>(zw[1])};
#endif
}
/// The vector (xy[0], xy[1], z[kLane], z[3]).
template <int kLane>
ADAPTIVE_BVH_INLINE Float4 joined(const Float4& xy, const Float4& z) {
#if defined(__SSE2__)
  return _mm_shuffle_ps(xy, z, _MM_SHUFFLE(3, kLane, 1, 0));
#else
  return Float4{xy[0], xy[1], z[kLane], z[3]};
#endif
}
/// The first two numbers, and the last two, in double precision.
ADAPTIVE_BVH_INLINE Pack<double> widenedXy(const Float4& v) {
#if defined(__SSE2__)
  return _mm_cvtps_pd(v);
#else
  return Pack<double>{v[0], v[1]};
#endif
}
ADAPTIVE_BVH_INLINE Pack<double> widenedZw(const Float4& v) {
#if defined(__SSE2__)
  return _mm_cvtps_pd(_mm_movehl_ps(v, v));
#else
  return Pack<double>{v[2], v[3]};
#endif
}

}  // namespace float4
}  // namespace adaptive_bvh
