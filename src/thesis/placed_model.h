#pragma once

#include <stdexcept>

#include <fcl/geometry/bvh/BVH_model.h>

#include "dispatch/shape_triangles.h"
#include "mesh/mesh_view.h"
#include "query/contacts/contacts.h"
#include "query/placed_mesh.h"
#include "thesis/traversal_statistics.h"

namespace adaptive_bvh {

/// A model with its pose, for a query by FCL's traversal. An AdaptiveBVHModel records statistics of
/// the query, a plain FCL model does not.
template <typename BV>
struct PlacedModel {
  const fcl::BVHModel<BV>* model = nullptr;
  TraversalStatistics* statistics = nullptr;           ///< null for a plain FCL model
  fcl::Transform3d tf = fcl::Transform3d::Identity();  ///< from the model's frame to the world

  /// The triangles for addContactsOf.
  PlacedTriangles triangles() const { return {model, viewOf(*model), tf}; }
  int numTriangles() const { return model->num_tris; }
  /// The triangles for tests with shapes, in double precision.
  QueryTriangles queryTriangles() const {
    return {viewOf(*model), model->num_tris, tf, model->aabb_center, model->aabb_radius};
  }
};

/// Where a query of two models, or of a model and another object, records its statistics.
template <typename BV>
PairStatistics statisticsOf(const PlacedModel<BV>& first, const PlacedModel<BV>& second) {
  return {{first.statistics, second.statistics}};
}
template <typename BV>
PairStatistics statisticsOf(const PlacedModel<BV>& model) {
  return {{model.statistics, nullptr}};
}

/// Throws std::invalid_argument if a model has no triangles: FCL crashes on such a model.
template <typename BV>
void requireTriangles(const fcl::BVHModel<BV>& model) {
  if (model.getModelType() != fcl::BVH_MODEL_TRIANGLES || model.getNumBVs() == 0)
    throw std::invalid_argument(
        "adaptive_bvh: a queried model has no triangles, or was not built by endModel");
}

/// Updates the query's result with the distance of two models, by FCL's traversal. Returns the
/// result's min_distance. Both models must have triangles.
template <typename BV>
double modelModelDistance(const PlacedModel<BV>& first, const PlacedModel<BV>& second,
                          const DistanceQuery& query);

/// Adds the contacts of two models to the query's result, by FCL's traversal. Returns the number of
/// contacts in the result. Both models must have triangles.
template <typename BV>
std::size_t modelModelCollide(const PlacedModel<BV>& first, const PlacedModel<BV>& second,
                              const CollisionQuery& query);

}  // namespace adaptive_bvh
