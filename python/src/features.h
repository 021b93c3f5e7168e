#pragma once

#include "adaptive_bvh/feature_pairs.h"
#include "bound.h"
#include "locked_mesh.h"

namespace adaptive_bvh::python {

/// A copy, which Python cannot change. Throws py::index_error when a pair names what a mesh does
/// not have.
FeaturePairs checkedPairs(const FeaturePairs& pairs, const LockedMesh& first,
                          const LockedMesh& second);

}  // namespace adaptive_bvh::python
