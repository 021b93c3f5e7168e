#pragma once

#include "query/placed_mesh.h"

namespace adaptive_bvh {

/// Recorded queries of a mesh and a shape, by FCL's traversal; the mesh is the first object, as FCL
/// orders the pair. The solver is the one that the request names, set up as FCL does.
template <typename S>
S meshShapeDistance(const PlacedMesh<fcl::RSS<S>>& mesh, const PlacedGeometry<S>& shape,
                    const DistanceQuery<S>& query);

template <typename S>
std::size_t meshShapeCollide(const PlacedMesh<fcl::RSS<S>>& mesh, const PlacedGeometry<S>& shape,
                             const CollisionQuery<S>& query);

/// With a solver of the caller's, one of FCL's two.
template <typename S, typename Solver>
std::size_t meshShapeCollide(const PlacedMesh<fcl::RSS<S>>& mesh, const PlacedGeometry<S>& shape,
                             const Solver& solver, const CollisionQuery<S>& query);

}  // namespace adaptive_bvh
