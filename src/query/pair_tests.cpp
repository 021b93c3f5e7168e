// Selects the tests of pairs of triangles for the processor at run time.
#include "query/pair_tests.h"

namespace adaptive_bvh {

#ifdef ADAPTIVE_BVH_HAS_AVX2
extern const PairTestTable kPairTestTableAvx2;  // in pair_tests_avx2.cpp
#endif

const PairTestTable& pairTests4() { return kPairTestTable<Float4>; }

const PairTestTable* pairTests8() {
#ifdef ADAPTIVE_BVH_HAS_AVX2
  return packs::hasAvx2() ? &kPairTestTableAvx2 : nullptr;
#else
  return nullptr;
#endif
}

const PairTestTable& pairTests() {
  const PairTestTable* eight = pairTests8();
  return eight ? *eight : pairTests4();
}

}  // namespace adaptive_bvh
