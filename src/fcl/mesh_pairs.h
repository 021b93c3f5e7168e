#pragma once

#include "query/contacts.h"
#include "query/placed_mesh.h"
#include "thesis/placed_model.h"

namespace adaptive_bvh {

/// Whether our queries take it as a shape.
inline bool isShape(fcl::NODE_TYPE type) {
  return type >= fcl::GEOM_BOX && type <= fcl::GEOM_HALFSPACE;
}

/// Queries of a mesh, or of a model, and an octree. They visit pairs of a cell and a box of the
/// mesh's four-wide tree, or a cell and a node of the model; these are recorded, which FCL's own
/// traversal of such a pair, inside its octree solver, cannot do. In the result the octree is the
/// first object, as in FCL for both orders. Throw std::logic_error where FCL was built without
/// octomap: there no octree can exist.
template <typename S>
S meshOctreeDistance(const MeshObject<S>& mesh, const PlacedGeometry<S>& octree,
                     const DistanceQuery<S>& query);
template <typename BV>
typename BV::S modelOctreeDistance(const PlacedModel<BV>& model,
                                   const PlacedGeometry<typename BV::S>& octree,
                                   const DistanceQuery<typename BV::S>& query);

template <typename S>
std::size_t meshOctreeCollide(const MeshObject<S>& mesh, const PlacedGeometry<S>& octree,
                              const CollisionQuery<S>& query);
template <typename BV>
std::size_t modelOctreeCollide(const PlacedModel<BV>& model,
                               const PlacedGeometry<typename BV::S>& octree,
                               const CollisionQuery<typename BV::S>& query);

/// Queries of a mesh, or of a model by FCL's traversal, and a shape, whose geometry decides about
/// each triangle. The mesh is the first object, as FCL orders the pair. Ends where the distance is
/// at most `enough`.
template <typename S>
S meshShapeDistance(const MeshObject<S>& mesh, const PlacedGeometry<S>& shape,
                    const DistanceQuery<S>& query, S enough = 0);
template <typename BV>
typename BV::S modelShapeDistance(const PlacedModel<BV>& model,
                                  const PlacedGeometry<typename BV::S>& shape,
                                  const DistanceQuery<typename BV::S>& query);

template <typename S>
std::size_t meshShapeCollide(const MeshObject<S>& mesh, const PlacedGeometry<S>& shape,
                             const CollisionQuery<S>& query);
template <typename BV>
std::size_t modelShapeCollide(const PlacedModel<BV>& model,
                              const PlacedGeometry<typename BV::S>& shape,
                              const CollisionQuery<typename BV::S>& query);

/// \name For pairs whose surfaces do not touch, where closed meshes and shapes count as filled
/// \{

/// Adds a contact for each component of `mesh` that is inside of `around`: of its first vertex. In
/// the contact, `around` is the first object or the second.
template <typename S>
void addContained(const MeshObject<S>& mesh, const MeshObject<S>& around, bool is_around_first,
                  const CollisionQuery<S>& query);

/// Whether a shape that does not touch a closed mesh is inside of it. Never a plane or half-space.
template <typename S>
bool isContained(const PlacedGeometry<S>& shape, const MeshObject<S>& around);

/// Adds a contact if a shape is inside of a mesh: of a point of the shape. The mesh is the first
/// object.
template <typename S>
void addContained(const PlacedGeometry<S>& shape, const MeshObject<S>& around,
                  const CollisionQuery<S>& query);
/// \}

/// Throws std::invalid_argument, with the names of both types, where FCL has no such query: there
/// FCL prints a warning and answers "very far apart" or "no contact", or crashes.
void requireDistance(fcl::NODE_TYPE first, fcl::NODE_TYPE second);
void requireCollision(fcl::NODE_TYPE first, fcl::NODE_TYPE second);

}  // namespace adaptive_bvh
