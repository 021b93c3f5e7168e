#pragma once

#include "dispatch/convex_parts.h"
#include "query/placed_mesh.h"

namespace adaptive_bvh {

// Two bodies without a mesh: shapes, and octrees, whose cells are boxes. In the result the objects
// are in the order of the call. Each pair of a shape or cell and another one has one contact.

/// `parallel`: as of gapOf(PlacedSolid, PlacedSolid, parallel). The result names no objects.
void distanceOfParts(const ConvexParts& first, const ConvexParts& second, double parallel,
                     const DistanceQuery<double>& query);
void collideParts(const ConvexParts& first, const ConvexParts& second, double parallel,
                  const fcl::CollisionGeometryd& o1, const fcl::CollisionGeometryd& o2,
                  const CollisionQuery<double>& query);

}  // namespace adaptive_bvh
