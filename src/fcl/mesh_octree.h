#pragma once

#include "fcl/placed_model.h"
#include "query/placed_mesh.h"

namespace adaptive_bvh {

/// Queries of a mesh, or of a model, and an octree. They visit pairs of a cell and a box of the
/// mesh's four-wide tree, or a cell and a node of the model; these are recorded, which FCL's own
/// traversal of such a pair, inside its octree solver, cannot do. In the result the octree is the
/// first object, as in FCL for both orders. Throw std::logic_error where FCL was built without
/// octomap: there no octree can exist.
template <typename S>
S meshOctreeDistance(const PlacedMesh<S>& mesh, const PlacedGeometry<S>& octree,
                     const DistanceQuery<S>& query);
template <typename BV>
typename BV::S modelOctreeDistance(const PlacedModel<BV>& model,
                                   const PlacedGeometry<typename BV::S>& octree,
                                   const DistanceQuery<typename BV::S>& query);

template <typename S>
std::size_t meshOctreeCollide(const PlacedMesh<S>& mesh, const PlacedGeometry<S>& octree,
                              const CollisionQuery<S>& query);
template <typename BV>
std::size_t modelOctreeCollide(const PlacedModel<BV>& model,
                               const PlacedGeometry<typename BV::S>& octree,
                               const CollisionQuery<typename BV::S>& query);

}  // namespace adaptive_bvh
