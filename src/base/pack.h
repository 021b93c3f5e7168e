#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#if defined(__AVX2__)
#include <immintrin.h>
#elif defined(__SSE2__)
#include <emmintrin.h>
#endif

#include "base/shortcut.h"

/// Forces inlining of small functions in the innermost loops, where a call would cost too much.
#define ADAPTIVE_BVH_INLINE [[gnu::always_inline]] inline

/// Compiles a function for AVX2. Call it only where packs::hasAvx2() is true.
#if defined(__x86_64__)
#define ADAPTIVE_BVH_WITH_AVX2 [[gnu::target("avx2")]]
#else
#define ADAPTIVE_BVH_WITH_AVX2
#endif

namespace adaptive_bvh {

/// Pack<S> is a SIMD vector of 16 bytes (a vector extension of GCC and Clang): four floats or two
/// doubles. Products, sums and square roots are rounded like scalar ones. (With eight lanes of the
/// library xsimd, triangle tests took 0.93 to 1.16 of the time; with its four lanes compiled for
/// AVX2, 0.96 to 1.0.)
template <typename S>
struct PackOf;
template <>
struct PackOf<float> {
  using Type = float __attribute__((vector_size(16)));
};
template <>
struct PackOf<double> {
  using Type = double __attribute__((vector_size(16)));
};
template <typename S>
using Pack = typename PackOf<S>::Type;

namespace packs {

/// Whether this processor has AVX2.
ADAPTIVE_BVH_INLINE bool hasAvx2() {
#if defined(__x86_64__)
  return __builtin_cpu_supports("avx2") && isTaken(Shortcut::Avx2);
#else
  return false;
#endif
}

/// The number of lanes.
template <typename S>
constexpr std::size_t kSize = sizeof(Pack<S>) / sizeof(S);

/// Loads and stores a pack. The address need not be aligned.
template <typename S>
ADAPTIVE_BVH_INLINE Pack<S> load(const S* from) {
  Pack<S> v;
  __builtin_memcpy(&v, from, sizeof(v));
  return v;
}
template <typename S>
ADAPTIVE_BVH_INLINE void store(const Pack<S>& v, S* to) {
  __builtin_memcpy(to, &v, sizeof(v));
}

/// Repeats a number in all lanes.
template <typename S>
ADAPTIVE_BVH_INLINE Pack<S> all(S x) {
  if constexpr (kSize<S> == 4)
    return Pack<S>{x, x, x, x};
  else
    return Pack<S>{x, x};
}

/// Repeats a number in all lanes of a pack of any size, such as eight floats for AVX2.
template <typename P>
ADAPTIVE_BVH_INLINE P filled(float x) {
  return x - P{};  // exact, also for 0 and -0
}

/// `lower` and `upper` return the minimum and the maximum of each lane; `b` where both numbers are
/// equal or one is NaN. (GCC does not always emit the single instruction for this.)
template <typename P>
ADAPTIVE_BVH_INLINE P lower(const P& a, const P& b) {
#if defined(__SSE2__)
  if constexpr (std::is_same<P, Pack<float>>::value) return _mm_min_ps(a, b);
  if constexpr (std::is_same<P, Pack<double>>::value) return _mm_min_pd(a, b);
#endif
  return a < b ? a : b;
}
template <typename P>
ADAPTIVE_BVH_INLINE P upper(const P& a, const P& b) {
#if defined(__SSE2__)
  if constexpr (std::is_same<P, Pack<float>>::value) return _mm_max_ps(a, b);
  if constexpr (std::is_same<P, Pack<double>>::value) return _mm_max_pd(a, b);
#endif
  return a > b ? a : b;
}
template <typename P>
ADAPTIVE_BVH_INLINE P absolute(const P& v) {
  return upper<P>(v, -v);
}

ADAPTIVE_BVH_INLINE Pack<float> squareRoot(const Pack<float>& v) {
#if defined(__SSE2__)
  return _mm_sqrt_ps(v);
#else
  return Pack<float>{std::sqrt(v[0]), std::sqrt(v[1]), std::sqrt(v[2]), std::sqrt(v[3])};
#endif
}
#if defined(__AVX__)
ADAPTIVE_BVH_INLINE __m256 squareRoot(const __m256& v) { return _mm256_sqrt_ps(v); }
#endif
ADAPTIVE_BVH_INLINE Pack<double> squareRoot(const Pack<double>& v) {
#if defined(__SSE2__)
  return _mm_sqrt_pd(v);
#else
  return Pack<double>{std::sqrt(v[0]), std::sqrt(v[1])};
#endif
}

/// Whether a comparison holds in any lane.
template <typename Mask>
ADAPTIVE_BVH_INLINE bool any(const Mask& mask) {
  std::uint64_t halves[2];
  static_assert(sizeof(mask) == sizeof(halves), "a comparison of packs");
  __builtin_memcpy(halves, &mask, sizeof(halves));
  return (halves[0] | halves[1]) != 0;
}

/// One bit for each lane in which a comparison holds: four lanes, or eight in code for AVX2.
template <typename Mask>
ADAPTIVE_BVH_INLINE unsigned bits(const Mask& mask) {
  static_assert(sizeof(mask[0]) == 4, "a comparison of numbers in single precision");
#if defined(__AVX2__)
  if constexpr (sizeof(mask) == 32)
    return static_cast<unsigned>(_mm256_movemask_ps(reinterpret_cast<__m256>(mask)));
  else
    return static_cast<unsigned>(_mm_movemask_ps(reinterpret_cast<__m128>(mask)));
#elif defined(__SSE2__)
  return static_cast<unsigned>(_mm_movemask_ps(reinterpret_cast<__m128>(mask)));
#else
  return unsigned(mask[0] != 0) | unsigned(mask[1] != 0) << 1 | unsigned(mask[2] != 0) << 2 |
         unsigned(mask[3] != 0) << 3;
#endif
}

/// One bit for each of two double-precision lanes in which a comparison holds.
template <typename Mask>
ADAPTIVE_BVH_INLINE unsigned bitsOf2(const Mask& mask) {
  static_assert(sizeof(mask[0]) == 8 && sizeof(mask) == 16, "a comparison of two numbers");
#if defined(__SSE2__)
  return static_cast<unsigned>(_mm_movemask_pd(reinterpret_cast<__m128d>(mask)));
#else
  return unsigned(mask[0] != 0) | unsigned(mask[1] != 0) << 1;
#endif
}

/// The number of bits set among the low sixteen, without the popcount instruction, which not every
/// processor has.
ADAPTIVE_BVH_INLINE int countOf16(unsigned bits) {
  bits -= bits >> 1 & 0x5555;
  bits = (bits & 0x3333) + (bits >> 2 & 0x3333);
  bits = (bits + (bits >> 4)) & 0x0f0f;
  return static_cast<int>((bits + (bits >> 8)) & 31);
}

// The sum, the minimum and the maximum over all lanes of one pack.
ADAPTIVE_BVH_INLINE float sum(const Pack<float>& v) { return (v[0] + v[1]) + (v[2] + v[3]); }
ADAPTIVE_BVH_INLINE double sum(const Pack<double>& v) { return v[0] + v[1]; }
ADAPTIVE_BVH_INLINE float smallest(const Pack<float>& v) {
  return std::min(std::min(v[0], v[1]), std::min(v[2], v[3]));
}
ADAPTIVE_BVH_INLINE double smallest(const Pack<double>& v) { return std::min(v[0], v[1]); }
ADAPTIVE_BVH_INLINE float largest(const Pack<float>& v) {
  return std::max(std::max(v[0], v[1]), std::max(v[2], v[3]));
}
ADAPTIVE_BVH_INLINE double largest(const Pack<double>& v) { return std::max(v[0], v[1]); }

}  // namespace packs

/// 3D vectors in structure-of-arrays layout, one vector for each lane of the pack P.
template <typename P>
struct Vectors {
  P x, y, z;
};

}  // namespace adaptive_bvh
