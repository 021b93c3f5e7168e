#pragma once

#include "dispatch/convex_parts.h"
#include "query/placed_mesh.h"

namespace adaptive_bvh {

// Distance and contacts of two bodies that are shapes or octrees, whose cells are boxes. The result
// has the objects in the order of the call. Two shapes or cells that touch have one contact.

/// Lowers query.result to the distance; does not set its objects.
void distanceOfParts(const ConvexParts& first, const ConvexParts& second,
                     const DistanceQuery& query);
/// Adds contacts to query.result.
void collideParts(const ConvexParts& first, const ConvexParts& second,
                  const fcl::CollisionGeometryd& o1, const fcl::CollisionGeometryd& o2,
                  const CollisionQuery& query);

}  // namespace adaptive_bvh
