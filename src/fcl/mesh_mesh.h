#pragma once

#include "fcl/placed_model.h"
#include "query/placed_mesh.h"

namespace adaptive_bvh {

/// Recorded queries of two meshes by FCL's traversal. Both must have triangles.
template <typename BV>
typename BV::S modelModelDistance(const PlacedModel<BV>& first, const PlacedModel<BV>& second,
                                  const DistanceQuery<typename BV::S>& query);

template <typename BV>
std::size_t modelModelCollide(const PlacedModel<BV>& first, const PlacedModel<BV>& second,
                              const CollisionQuery<typename BV::S>& query);

}  // namespace adaptive_bvh
