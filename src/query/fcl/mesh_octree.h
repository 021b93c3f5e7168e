#pragma once

#include "query/placed_mesh.h"

namespace adaptive_bvh {

/// Recorded queries of a mesh and an octree. FCL's own traversal of such a pair runs inside its
/// octree solver and cannot record. These visit pairs of a cell and a box of the mesh's four-wide
/// tree, or where it has none pairs of a cell and a node of FCL's as FCL does, and call FCL's
/// solver for a cell and a triangle. In the result the octree is the first object, as in FCL for
/// both orders. Throw std::logic_error where FCL was built without octomap: there no octree can
/// exist.
template <typename BV>
typename BV::S meshOctreeDistance(const PlacedMesh<BV>& mesh,
                                  const PlacedGeometry<typename BV::S>& octree,
                                  const DistanceQuery<typename BV::S>& query);

template <typename BV>
std::size_t meshOctreeCollide(const PlacedMesh<BV>& mesh,
                              const PlacedGeometry<typename BV::S>& octree,
                              const CollisionQuery<typename BV::S>& query);

}  // namespace adaptive_bvh
