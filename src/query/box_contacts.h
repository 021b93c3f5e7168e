#pragma once

#include "adaptive_bvh/self_collision.h"
#include "query/placed_mesh.h"

namespace adaptive_bvh {

/// Adds the contacts of two meshes to the result.
template <typename S>
void collideMeshes(const PlacedMesh<S>& first, const PlacedMesh<S>& second,
                   const CollisionQuery<S>& query);

/// Those of one mesh with itself, but for neighbours.
template <typename S>
void selfCollideMesh(const PlacedMesh<S>& mesh, const CollisionQuery<S>& query,
                     NeighbourFilter filter);

}  // namespace adaptive_bvh
