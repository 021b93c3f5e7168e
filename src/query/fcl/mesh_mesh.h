#pragma once

#include "query/placed_mesh.h"

namespace adaptive_bvh {

/// Recorded queries of two meshes by FCL's traversal. Both must have triangles.
template <typename S>
S meshMeshDistance(const PlacedMesh<fcl::RSS<S>>& first, const PlacedMesh<fcl::RSS<S>>& second,
                   const DistanceQuery<S>& query);

template <typename S>
std::size_t meshMeshCollide(const PlacedMesh<fcl::RSS<S>>& first,
                            const PlacedMesh<fcl::RSS<S>>& second, const CollisionQuery<S>& query);

}  // namespace adaptive_bvh
