#pragma once

#include "query/placed_mesh.h"
#include "solids/solid.h"

namespace adaptive_bvh {

// Bodies inside closed meshes that count as filled, for pairs whose surfaces do not touch.

/// Adds a contact for each component of `mesh` that is inside `around`, at a vertex of it. o1 and
/// o2: the objects of the contact; `around` is o1 if `is_around_first`, else o2.
void addContained(const PlacedMesh& mesh, const PlacedMesh& around, bool is_around_first,
                  const fcl::CollisionGeometryd& o1, const fcl::CollisionGeometryd& o2,
                  const CollisionQuery& query);

/// Whether a shape is inside a closed mesh. False for a plane or half-space.
bool isContained(const PlacedSolid& shape, const PlacedMesh& around);

/// Adds a contact at a point of a shape if it is inside a mesh. o1: the mesh; o2: the shape.
void addContained(const PlacedSolid& shape, const PlacedMesh& around,
                  const fcl::CollisionGeometryd& o1, const fcl::CollisionGeometryd& o2,
                  const CollisionQuery& query);

}  // namespace adaptive_bvh
