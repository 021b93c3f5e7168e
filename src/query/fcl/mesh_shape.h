#pragma once

#include "query/placed_mesh.h"

namespace adaptive_bvh {

/// Recorded queries of a mesh and a shape, whose geometry decides about each triangle. The mesh is
/// the first object, as FCL orders the pair. Ends where the distance is at most `enough`.
template <typename BV>
typename BV::S meshShapeDistance(const PlacedMesh<BV>& mesh,
                                 const PlacedGeometry<typename BV::S>& shape,
                                 const DistanceQuery<typename BV::S>& query,
                                 typename BV::S enough = 0);

template <typename BV>
std::size_t meshShapeCollide(const PlacedMesh<BV>& mesh,
                             const PlacedGeometry<typename BV::S>& shape,
                             const CollisionQuery<typename BV::S>& query);

}  // namespace adaptive_bvh
