// Compiled for AVX2, and called only where the processor has it: see boundary_cone.cpp.
#ifdef __AVX2__
#include "query/points/boundary_kernel.h"

namespace adaptive_bvh {

using Double4 = double __attribute__((vector_size(32)));

extern const AddBoundary kAddBoundaryAvx2;
const AddBoundary kAddBoundaryAvx2 = BoundaryKernel<Double4>::add;

}  // namespace adaptive_bvh
#endif
