#pragma once

#include <cstddef>

#include "adaptive_bvh/feature_pairs.h"
#include "deformable/mesh_state.h"

namespace adaptive_bvh {

/// Throws std::invalid_argument, which names the pair, unless the meshes have the features of all
/// pairs. (featurePairDetails and distanceDerivatives)
void requireFeatures(const FeaturePairs& pairs, const MeshState& first, const MeshState& second);

}  // namespace adaptive_bvh
