#pragma once

#include "query/placed_mesh.h"

namespace adaptive_bvh {

/// Recorded queries of a mesh and an octree. FCL's own traversal of such a pair runs inside its
/// octree solver and cannot be watched; these visit pairs of a cell and a node likewise, and ask
/// FCL's solver about a cell and a triangle. In the result the octree is the first object, as FCL
/// has it for both orders. Throw std::logic_error where FCL was built without octomap, and so
/// nobody can have made an octree.
template <typename S>
S meshOctreeDistance(const PlacedMesh<fcl::RSS<S>>& mesh, const PlacedGeometry<S>& octree,
                     const DistanceQuery<S>& query);

template <typename S>
std::size_t meshOctreeCollide(const PlacedMesh<fcl::RSS<S>>& mesh, const PlacedGeometry<S>& octree,
                              const CollisionQuery<S>& query);

}  // namespace adaptive_bvh
