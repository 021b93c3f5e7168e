#include "volumes/fit_kernels.h"

namespace adaptive_bvh {

#ifdef ADAPTIVE_BVH_HAS_AVX2
/// In fit_kernels_avx2.cpp.
template <typename S, bool kWithBox>
const FitFunctions<S>& fitFunctionsWithAvx2();
#endif

template <typename S, bool kWithBox>
const FitFunctions<S>& fitFunctions() {
#ifdef ADAPTIVE_BVH_HAS_AVX2
  static const bool has_avx2 = packs::hasAvx2();
  if (has_avx2) return fitFunctionsWithAvx2<S, kWithBox>();
#endif
  return FitKernels<Float4>::kFunctions<S, kWithBox>;
}

template const FitFunctions<float>& fitFunctions<float, false>();
template const FitFunctions<float>& fitFunctions<float, true>();
template const FitFunctions<double>& fitFunctions<double, false>();
template const FitFunctions<double>& fitFunctions<double, true>();

}  // namespace adaptive_bvh
