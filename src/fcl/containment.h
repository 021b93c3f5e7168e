#pragma once

#include "query/placed_mesh.h"

namespace adaptive_bvh {

// For pairs whose surfaces do not touch, where closed meshes and shapes count as filled.

/// Adds a contact for each component of `mesh` that is inside of `around`: of its first vertex. In
/// the contact, `around` is the first object or the second.
template <typename S>
void addContained(const PlacedMesh<S>& mesh, const PlacedMesh<S>& around, bool is_around_first,
                  const CollisionQuery<S>& query);

/// Whether a shape that does not touch a closed mesh is inside of it. Never a plane or half-space.
template <typename S>
bool isContained(const PlacedGeometry<S>& shape, const PlacedMesh<S>& around);

/// Adds a contact if a shape is inside of a mesh: of a point of the shape. The mesh is the first
/// object.
template <typename S>
void addContained(const PlacedGeometry<S>& shape, const PlacedMesh<S>& around,
                  const CollisionQuery<S>& query);

}  // namespace adaptive_bvh
