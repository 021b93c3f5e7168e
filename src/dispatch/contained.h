#pragma once

#include "query/placed_mesh.h"
#include "solids/solid.h"

namespace adaptive_bvh {

// For pairs whose surfaces do not touch, where closed meshes and shapes count as filled.

/// Adds a contact for each component of `mesh` that is inside of `around`: of its first vertex. In
/// the contact, `around` is the first object or the second.
void addContained(const PlacedMesh& mesh, const PlacedMesh& around, bool is_around_first,
                  const fcl::CollisionGeometryd& o1, const fcl::CollisionGeometryd& o2,
                  const CollisionQuery<double>& query);

/// Whether a shape that does not touch a closed mesh is inside of it. Never a plane or half-space.
bool isContained(const PlacedSolid& shape, const PlacedMesh& around);

/// Adds a contact if a shape is inside of a mesh: of a point of the shape. The mesh is the first
/// object.
void addContained(const PlacedSolid& shape, const PlacedMesh& around,
                  const fcl::CollisionGeometryd& o1, const fcl::CollisionGeometryd& o2,
                  const CollisionQuery<double>& query);

}  // namespace adaptive_bvh
