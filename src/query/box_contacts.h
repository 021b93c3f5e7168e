#pragma once

#include "query/placed_mesh.h"

namespace adaptive_bvh {

/// Adds the contacts of two meshes to the result.
template <typename S>
void collideMeshes(const PlacedMesh<S>& first, const PlacedMesh<S>& second,
                   const CollisionQuery<S>& query);

}  // namespace adaptive_bvh
