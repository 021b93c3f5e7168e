#pragma once

#include <stdexcept>

#include <fcl/geometry/bvh/BVH_model.h>

#include "dispatch/shape_triangles.h"
#include "mesh/mesh_view.h"
#include "query/contacts.h"
#include "query/placed_mesh.h"
#include "solids/shape_solid.h"
#include "volumes/traversal_statistics.h"

namespace adaptive_bvh {

/// An object of a query, and where it is.
template <typename S>
struct PlacedGeometry {
  const fcl::CollisionGeometry<S>* geometry;
  fcl::Transform3<S> tf;
};

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

/// Recorded queries of a model and a shape, whose geometry decides about each triangle, by FCL's
/// traversal. The model is the first object, as FCL orders the pair.
template <typename BV>
void modelShapeDistance(const PlacedModel<BV>& model, const PlacedGeometry<typename BV::S>& shape,
                        const DistanceQuery<typename BV::S>& query);
template <typename BV>
void modelShapeCollide(const PlacedModel<BV>& model, const PlacedGeometry<typename BV::S>& shape,
                       const CollisionQuery<typename BV::S>& query);

/// Queries of a model and an octree. They visit pairs of a cell and a node of the model; these are
/// recorded, which FCL's own traversal of such a pair, inside its octree solver, cannot do. In the
/// result the octree is the first object, as in FCL for both orders. Throw std::logic_error where
/// FCL was built without octomap: there no octree can exist.
template <typename BV>
void modelOctreeDistance(const PlacedModel<BV>& model, const PlacedGeometry<typename BV::S>& octree,
                         const DistanceQuery<typename BV::S>& query);
template <typename BV>
void modelOctreeCollide(const PlacedModel<BV>& model, const PlacedGeometry<typename BV::S>& octree,
                        const CollisionQuery<typename BV::S>& query);

/// Throws std::invalid_argument, with the names of both types, where FCL has no such query: there
/// FCL prints a warning and answers "very far apart" or "no contact", or crashes.
void requireDistance(fcl::NODE_TYPE first, fcl::NODE_TYPE second);
void requireCollision(fcl::NODE_TYPE first, fcl::NODE_TYPE second);

}  // namespace adaptive_bvh
