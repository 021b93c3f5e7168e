#pragma once

#include "query/placed_mesh.h"

namespace adaptive_bvh {

// Two bodies without a mesh: shapes, and octrees, whose cells are boxes. In the result the objects
// are in the order of the call. Each pair of a shape or cell and another one has one contact.

template <typename S>
S shapePairDistance(const PlacedGeometry<S>& first, const PlacedGeometry<S>& second,
                    const DistanceQuery<S>& query);
template <typename S>
std::size_t shapePairCollide(const PlacedGeometry<S>& first, const PlacedGeometry<S>& second,
                             const CollisionQuery<S>& query);

}  // namespace adaptive_bvh
