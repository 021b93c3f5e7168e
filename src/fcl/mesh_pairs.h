#pragma once

#include <stdexcept>

#include <fcl/geometry/bvh/BVH_model.h>

#include "fcl/shape_triangles.h"
#include "mesh/mesh_view.h"
#include "query/contacts.h"
#include "query/placed_mesh.h"
#include "solids/shape_solid.h"
#include "volumes/traversal_statistics.h"

namespace adaptive_bvh {

/// A model of FCL's, or an adaptive one, of a query that FCL's traversal answers, and where it is.
template <typename BV>
struct PlacedModel {
  using S = typename BV::S;

  const fcl::BVHModel<BV>* model = nullptr;
  TraversalStatistics* statistics = nullptr;  ///< null where the model is FCL's own
  fcl::Transform3<S> tf = fcl::Transform3<S>::Identity();

  PlacedTriangles<S> triangles() const { return {model, viewOf(*model), tf}; }
  int numTriangles() const { return model->num_tris; }
  QueryTriangles queryTriangles() const {
    return {viewOf(*model), model->num_tris, tf.template cast<double>(),
            model->aabb_center.template cast<double>(), static_cast<double>(model->aabb_radius)};
  }
};

template <typename BV>
PairStatistics statisticsOf(const PlacedModel<BV>& first, const PlacedModel<BV>& second) {
  return {{first.statistics, second.statistics}};
}
template <typename BV>
PairStatistics statisticsOf(const PlacedModel<BV>& model) {
  return {{model.statistics, nullptr}};
}

/// Throws std::invalid_argument where a model cannot be queried: FCL crashes on one without
/// triangles.
template <typename BV>
void requireTriangles(const fcl::BVHModel<BV>& model) {
  if (model.getModelType() != fcl::BVH_MODEL_TRIANGLES || model.getNumBVs() == 0)
    throw std::invalid_argument(
        "adaptive_bvh: a queried model has no triangles, or was not built by endModel");
}

/// Recorded queries of two meshes by FCL's traversal. Both must have triangles.
template <typename BV>
typename BV::S modelModelDistance(const PlacedModel<BV>& first, const PlacedModel<BV>& second,
                                  const DistanceQuery<typename BV::S>& query);

template <typename BV>
std::size_t modelModelCollide(const PlacedModel<BV>& first, const PlacedModel<BV>& second,
                              const CollisionQuery<typename BV::S>& query);

/// Queries of a mesh, or of a model, and an octree. They visit pairs of a cell and a box of the
/// mesh's four-wide tree, or a cell and a node of the model; these are recorded, which FCL's own
/// traversal of such a pair, inside its octree solver, cannot do. In the result the octree is the
/// first object, as in FCL for both orders. Throw std::logic_error where FCL was built without
/// octomap: there no octree can exist.
template <typename S>
void meshOctreeDistance(const MeshObject<S>& mesh, const PlacedGeometry<S>& octree,
                        const DistanceQuery<S>& query);
template <typename BV>
void modelOctreeDistance(const PlacedModel<BV>& model, const PlacedGeometry<typename BV::S>& octree,
                         const DistanceQuery<typename BV::S>& query);

template <typename S>
void meshOctreeCollide(const MeshObject<S>& mesh, const PlacedGeometry<S>& octree,
                       const CollisionQuery<S>& query);
template <typename BV>
void modelOctreeCollide(const PlacedModel<BV>& model, const PlacedGeometry<typename BV::S>& octree,
                        const CollisionQuery<typename BV::S>& query);

[[noreturn]] inline void refuseOctree() {
  throw std::logic_error("adaptive_bvh: FCL was built without octomap");
}

/// Queries of a mesh, or of a model by FCL's traversal, and a shape, whose geometry decides about
/// each triangle. The mesh is the first object, as FCL orders the pair.
template <typename S>
void meshShapeDistance(const MeshObject<S>& mesh, const PlacedGeometry<S>& shape,
                       const DistanceQuery<S>& query);
template <typename BV>
void modelShapeDistance(const PlacedModel<BV>& model, const PlacedGeometry<typename BV::S>& shape,
                        const DistanceQuery<typename BV::S>& query);

template <typename S>
void meshShapeCollide(const MeshObject<S>& mesh, const PlacedGeometry<S>& shape,
                      const CollisionQuery<S>& query);
template <typename BV>
void modelShapeCollide(const PlacedModel<BV>& model, const PlacedGeometry<typename BV::S>& shape,
                       const CollisionQuery<typename BV::S>& query);

/// Whether a mesh is at most so far from a shape. `core`: of the shape.
bool isNearer(const PlacedMesh& mesh, const PlacedSolid& shape, const ShapeCore& core,
              double distance);

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
