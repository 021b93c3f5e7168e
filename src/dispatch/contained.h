#pragma once

#include "query/placed_mesh.h"
#include "solids/solid.h"

namespace adaptive_bvh {

// Bodies inside closed meshes that count as filled, for pairs whose surfaces do not touch.

/// Adds a contact for each component of `mesh` that is inside `around`, at a vertex. In the
/// contact, `around` is the first object or the second.
void addContained(const PlacedMesh& mesh, const PlacedMesh& around, bool is_around_first,
                  const fcl::CollisionGeometryd& o1, const fcl::CollisionGeometryd& o2,
                  const CollisionQuery<double>& query);

/// Whether a shape is inside a closed mesh. False for a plane or half-space.
bool isContained(const PlacedSolid& shape, const PlacedMesh& around);

/// Adds a contact, at a point of the shape, if a shape is inside a mesh, which is the first object.
void addContained(const PlacedSolid& shape, const PlacedMesh& around,
                  const fcl::CollisionGeometryd& o1, const fcl::CollisionGeometryd& o2,
                  const CollisionQuery<double>& query);

}  // namespace adaptive_bvh
