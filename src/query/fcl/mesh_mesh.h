#pragma once

#include "query/placed_mesh.h"

namespace adaptive_bvh {

/// Recorded queries of two meshes by FCL's traversal. Both must have triangles.
template <typename BV>
typename BV::S meshMeshDistance(const PlacedMesh<BV>& first, const PlacedMesh<BV>& second,
                                const DistanceQuery<typename BV::S>& query);

template <typename BV>
std::size_t meshMeshCollide(const PlacedMesh<BV>& first, const PlacedMesh<BV>& second,
                            const CollisionQuery<typename BV::S>& query);

}  // namespace adaptive_bvh
