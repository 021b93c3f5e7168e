#pragma once

#include "fcl/placed_model.h"
#include "query/placed_mesh.h"

namespace adaptive_bvh {

/// Queries of a mesh, or of a model by FCL's traversal, and a shape, whose geometry decides about
/// each triangle. The mesh is the first object, as FCL orders the pair. Ends where the distance is
/// at most `enough`.
template <typename S>
S meshShapeDistance(const PlacedMesh<S>& mesh, const PlacedGeometry<S>& shape,
                    const DistanceQuery<S>& query, S enough = 0);
template <typename BV>
typename BV::S modelShapeDistance(const PlacedModel<BV>& model,
                                  const PlacedGeometry<typename BV::S>& shape,
                                  const DistanceQuery<typename BV::S>& query);

template <typename S>
std::size_t meshShapeCollide(const PlacedMesh<S>& mesh, const PlacedGeometry<S>& shape,
                             const CollisionQuery<S>& query);
template <typename BV>
std::size_t modelShapeCollide(const PlacedModel<BV>& model,
                              const PlacedGeometry<typename BV::S>& shape,
                              const CollisionQuery<typename BV::S>& query);

}  // namespace adaptive_bvh
