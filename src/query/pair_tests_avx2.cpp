// Compiled for AVX2, and called only where the processor has it: see pair_tests.h.
#ifdef __AVX2__
#include "query/pair_tests.h"

namespace adaptive_bvh {

using Float8 = float __attribute__((vector_size(32)));

template <>
struct Gather<Float8> {
  static constexpr int kLanes = 8;

  ADAPTIVE_BVH_INLINE static Vectors<Float8> corners(const Float4* from, const unsigned (&at)[8]) {
    Float8 v[4];  // corners of lanes k and k + 4
    for (int k = 0; k < 4; ++k) v[k] = _mm256_set_m128(from[at[k + 4]], from[at[k]]);
    const Float8 ab = _mm256_unpacklo_ps(v[0], v[1]), cd = _mm256_unpacklo_ps(v[2], v[3]);
    const Float8 ab_z = _mm256_unpackhi_ps(v[0], v[1]), cd_z = _mm256_unpackhi_ps(v[2], v[3]);
    return {_mm256_shuffle_ps(ab, cd, _MM_SHUFFLE(1, 0, 1, 0)),
            _mm256_shuffle_ps(ab, cd, _MM_SHUFFLE(3, 2, 3, 2)),
            _mm256_shuffle_ps(ab_z, cd_z, _MM_SHUFFLE(1, 0, 1, 0))};
  }
};

extern const PairTestTable kPairTestTableAvx2;
const PairTestTable kPairTestTableAvx2 = kPairTestTable<Float8>;

}  // namespace adaptive_bvh
#endif
