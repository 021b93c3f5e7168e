#pragma once

#include "geometry/vectors.h"

// Also compiled for AVX2: see update/fit_kernels.h.
namespace adaptive_bvh {

/// What is special to the size of a pack.
template <typename P>
struct Lanes;

template <>
struct Lanes<Float4> {
  static constexpr int kCount = 4;

  /// load(k) is the vector of lane k.
  template <typename Load>
  ADAPTIVE_BVH_INLINE static Vectors<Float4> gather(Load&& load) {
    return float4::columns(load(0), load(1), load(2), load(3));
  }
  /// All four numbers of load(k).
  template <typename Load>
  ADAPTIVE_BVH_INLINE static void gather4(Load&& load, Float4 (&numbers)[4]) {
    const float4::Rows rows = float4::transposed(load(0), load(1), load(2), load(3));
    numbers[0] = rows.x;
    numbers[1] = rows.y;
    numbers[2] = rows.z;
    numbers[3] = rows.w;
  }
  /// The largest of each.
  ADAPTIVE_BVH_INLINE static Float4 largest(const Float4& a, const Float4& b, const Float4& c,
                                            const Float4& d) {
    const float4::Rows rows = float4::transposed(a, b, c, d);
    return float4::upper(float4::upper(rows.x, rows.y), float4::upper(rows.z, rows.w));
  }

  /// Half of the lanes in double precision.
  using Doubles = Pack<double>;
  template <int kHalf>
  ADAPTIVE_BVH_INLINE static Doubles widened(const Float4& v) {
    return kHalf == 0 ? float4::widenedXy(v) : float4::widenedZw(v);
  }
};

}  // namespace adaptive_bvh
