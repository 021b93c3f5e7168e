#pragma once

#include "query/placed_mesh.h"

namespace adaptive_bvh {

/// Recorded queries of a mesh and an octree. FCL's own traversal of such a pair runs inside its
/// octree solver and cannot record. These visit pairs of a cell and a node as it does, and call
/// FCL's solver for a cell and a triangle. In the result the octree is the first object, as in FCL
/// for both orders. Throw std::logic_error where FCL was built without octomap: there no octree can
/// exist.
template <typename S>
S meshOctreeDistance(const PlacedMesh<fcl::RSS<S>>& mesh, const PlacedGeometry<S>& octree,
                     const DistanceQuery<S>& query);

template <typename S>
std::size_t meshOctreeCollide(const PlacedMesh<fcl::RSS<S>>& mesh, const PlacedGeometry<S>& octree,
                              const CollisionQuery<S>& query);

}  // namespace adaptive_bvh
