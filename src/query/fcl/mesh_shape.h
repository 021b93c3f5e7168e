#pragma once

#include "query/placed_mesh.h"

namespace adaptive_bvh {

/// Whether queries of a mesh and a shape need none of FCL's volumes, but read the mesh's four-wide
/// tree. Not where there is none, nor where single precision cannot express how they lie.
template <typename BV>
bool searchesBoxes(const PlacedMesh<BV>& mesh, const PlacedGeometry<typename BV::S>& shape);

/// Recorded queries of a mesh and a shape, by boxes as above or else by FCL's traversal, for which
/// the volumes must be up to date. FCL's solver tests the triangles, in the order of FCL's
/// traversal in a collision. The mesh is the first object, as FCL orders the pair. The solver is
/// the one that the request names, set up as FCL does.
template <typename BV>
typename BV::S meshShapeDistance(const PlacedMesh<BV>& mesh,
                                 const PlacedGeometry<typename BV::S>& shape,
                                 const DistanceQuery<typename BV::S>& query);

/// Costs may need the volumes in any case.
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
