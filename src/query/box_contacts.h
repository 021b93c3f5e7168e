#pragma once

#include "adaptive_bvh/self_collision.h"
#include "query/placed_mesh.h"

namespace adaptive_bvh {

/// Contacts of two meshes with boxes, by their four-wide trees; FCL's test of two triangles has the
/// last word. Recorded for test B. Returns false, and does nothing, where single precision cannot
/// express how the meshes lie: FCL's traversal is to answer.
template <typename BV>
bool collideByBoxes(const PlacedMesh<BV>& first, const PlacedMesh<BV>& second,
                    const CollisionQuery<typename BV::S>& query);

/// Contacts of a mesh with itself, one a pair of triangles.
template <typename BV>
void selfCollideByBoxes(const PlacedMesh<BV>& mesh, const CollisionQuery<typename BV::S>& query,
                        NeighbourFilter filter);

}  // namespace adaptive_bvh
