// The kernel of BoundaryCone for AVX2; boundary_cone.cpp calls it if the processor has AVX2.
#ifdef __AVX2__
#include "query/points/boundary_kernel.h"

namespace adaptive_bvh {

using Double4 = double __attribute__((vector_size(32)));

extern const AddBoundary kAddBoundaryAvx2;
const AddBoundary kAddBoundaryAvx2 = BoundaryKernel<Double4>::add;

}  // namespace adaptive_bvh
#endif
