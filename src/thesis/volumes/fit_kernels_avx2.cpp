// FitKernels with eight lanes. Called only if the processor has AVX2: see fit_kernels.h.
#ifdef __AVX2__
#include "thesis/volumes/fit_kernels.h"

namespace adaptive_bvh {

using Float8 = float __attribute__((vector_size(32)));

/// See Lanes<Float4> in body_volumes.h.
template <>
struct Lanes<Float8> {
  static constexpr int kCount = 8;

  template <typename Load>
  ADAPTIVE_BVH_INLINE static Vectors<Float8> gather(Load&& load) {
    Float8 numbers[4];
    gather4(load, numbers);
    return {numbers[0], numbers[1], numbers[2]};
  }
  template <typename Load>
  ADAPTIVE_BVH_INLINE static void gather4(Load&& load, Float8 (&numbers)[4]) {
    // Each register contains lane k and lane k + 4.
    const Float8 a = _mm256_set_m128(load(4), load(0)), b = _mm256_set_m128(load(5), load(1)),
                 c = _mm256_set_m128(load(6), load(2)), d = _mm256_set_m128(load(7), load(3));
    const Float8 ab = _mm256_unpacklo_ps(a, b), cd = _mm256_unpacklo_ps(c, d);
    const Float8 ab_high = _mm256_unpackhi_ps(a, b), cd_high = _mm256_unpackhi_ps(c, d);
    numbers[0] = _mm256_shuffle_ps(ab, cd, _MM_SHUFFLE(1, 0, 1, 0));
    numbers[1] = _mm256_shuffle_ps(ab, cd, _MM_SHUFFLE(3, 2, 3, 2));
    numbers[2] = _mm256_shuffle_ps(ab_high, cd_high, _MM_SHUFFLE(1, 0, 1, 0));
    numbers[3] = _mm256_shuffle_ps(ab_high, cd_high, _MM_SHUFFLE(3, 2, 3, 2));
  }
  ADAPTIVE_BVH_INLINE static Float4 largest(const Float8& a, const Float8& b, const Float8& c,
                                            const Float8& d) {
    const auto half = [](const Float8& v) -> Float4 {
      return _mm_max_ps(_mm256_castps256_ps128(v), _mm256_extractf128_ps(v, 1));
    };
    return Lanes<Float4>::largest(half(a), half(b), half(c), half(d));
  }

  using Doubles = double __attribute__((vector_size(32)));
  template <int kHalf>
  ADAPTIVE_BVH_INLINE static Doubles widened(const Float8& v) {
    return _mm256_cvtps_pd(_mm256_extractf128_ps(v, kHalf));
  }
};

const FitFunctions& fitFunctionsWithAvx2();  // declared again in body_fit.cpp, which calls it
const FitFunctions& fitFunctionsWithAvx2() { return FitKernels<Float8>::kFunctions; }

}  // namespace adaptive_bvh
#endif
