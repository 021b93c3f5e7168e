#pragma once

#include "query/placed_mesh.h"

namespace adaptive_bvh {

/// Recorded queries of a mesh and a shape: by the mesh's four-wide tree, or by FCL's traversal
/// where it has none or single precision cannot express how the two lie. FCL's solver tests the
/// triangles, in the order of FCL's traversal in a collision. The mesh is the first object, as FCL
/// orders the pair. The solver is the one that the request names, set up as FCL does.
template <typename BV>
typename BV::S meshShapeDistance(const PlacedMesh<BV>& mesh,
                                 const PlacedGeometry<typename BV::S>& shape,
                                 const DistanceQuery<typename BV::S>& query);

template <typename BV>
std::size_t meshShapeCollide(const PlacedMesh<BV>& mesh,
                             const PlacedGeometry<typename BV::S>& shape,
                             const CollisionQuery<typename BV::S>& query);

/// With a solver of the caller's, one of FCL's two.
template <typename BV, typename Solver>
std::size_t meshShapeCollide(const PlacedMesh<BV>& mesh,
                             const PlacedGeometry<typename BV::S>& shape, const Solver& solver,
                             const CollisionQuery<typename BV::S>& query);

}  // namespace adaptive_bvh
