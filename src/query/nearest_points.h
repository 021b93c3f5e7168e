#pragma once

#include "query/placed_mesh.h"

namespace adaptive_bvh {

/// The last step of a distance of two meshes that improved `result`. Points that were not requested
/// become NaN; those of meshes that touch, where FCL's mean nothing, a common point of the two
/// triangles in the world.
template <typename S>
void settleNearestPoints(const PlacedMesh<fcl::RSS<S>>& first,
                         const PlacedMesh<fcl::RSS<S>>& second, const DistanceQuery<S>& query);

}  // namespace adaptive_bvh
