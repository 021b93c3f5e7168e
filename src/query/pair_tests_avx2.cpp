// The tests of pair_tests.h for packs of eight. Called only if the processor has AVX2.
#ifdef __AVX2__
#include "query/pair_tests.h"

namespace adaptive_bvh {

using Float8 = float __attribute__((vector_size(32)));

template <>
struct Gather<Float8> {
  static constexpr int kLanes = 8;

  ADAPTIVE_BVH_INLINE static Vectors<Float8> corners(const Float4* points,
                                                     const unsigned (&slots)[8]) {
    // The halves of v[k] are the points of lanes k and k + 4. Transposes both halves at once.
    Float8 v[4];
    for (int k = 0; k < 4; ++k) v[k] = _mm256_set_m128(points[slots[k + 4]], points[slots[k]]);
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
