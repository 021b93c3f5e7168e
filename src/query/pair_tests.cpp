#include "query/pair_stages.h"

namespace adaptive_bvh {

#ifdef ADAPTIVE_BVH_HAS_AVX2
extern const PairTests kPairTestsAvx2;  // pair_tests_avx2.cpp
#endif

const PairTests& pairTests4() { return kPairTests<Float4>; }

const PairTests* pairTests8() {
#ifdef ADAPTIVE_BVH_HAS_AVX2
  return packs::hasAvx2() ? &kPairTestsAvx2 : nullptr;
#else
  return nullptr;
#endif
}

const PairTests& pairTests() {
  static const PairTests& widest = pairTests8() ? *pairTests8() : pairTests4();
  return widest;
}

}  // namespace adaptive_bvh
