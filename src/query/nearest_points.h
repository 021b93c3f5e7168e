#pragma once

#include "query/placed_mesh.h"

namespace adaptive_bvh {

/// The last step of a distance of two meshes that improved `result`. Points that were not requested
/// become NaN; those of meshes that touch, where FCL's mean nothing, a common point of the two
/// triangles in the world.
template <typename BV>
void settleNearestPoints(const PlacedMesh<BV>& first, const PlacedMesh<BV>& second,
                         const DistanceQuery<typename BV::S>& query);

}  // namespace adaptive_bvh
