#pragma once

#include "query/contacts/contacts.h"
#include "thesis/placed_model.h"

// Queries of a model (fcl::BVHModel or AdaptiveBVHModel) and a shape or an octree. Distances lower
// query.result, contacts are added to it.
namespace adaptive_bvh {

/// An object of a query, and its pose in the world.
struct PlacedGeometry {
  const fcl::CollisionGeometryd* geometry;
  fcl::Transform3d tf;
};

/// Queries of a model and a shape by FCL's traversal, with recording of statistics. The library's
/// own tests decide about a triangle and the shape. The model is the first object in the result.
template <typename BV>
void modelShapeDistance(const PlacedModel<BV>& model, const PlacedGeometry& shape,
                        const DistanceQuery& query);
template <typename BV>
void modelShapeCollide(const PlacedModel<BV>& model, const PlacedGeometry& shape,
                       const CollisionQuery& query);

/// Queries of a model and an octree by the library's traversal of pairs of a cell and a node of the
/// model, with recording of statistics. (FCL's own traversal, inside its octree solver, cannot be
/// recorded.) The octree is the first object in the result, as in FCL for both orders. Throw
/// std::logic_error if FCL was built without octomap, where no octree can exist.
template <typename BV>
void modelOctreeDistance(const PlacedModel<BV>& model, const PlacedGeometry& octree,
                         const DistanceQuery& query);
template <typename BV>
void modelOctreeCollide(const PlacedModel<BV>& model, const PlacedGeometry& octree,
                        const CollisionQuery& query);

/// Throws std::invalid_argument, with the names of both types, if FCL has no such query. FCL would
/// print a warning and answer "very far apart" or "no contact", or crash.
void requireDistance(fcl::NODE_TYPE first, fcl::NODE_TYPE second);
void requireCollision(fcl::NODE_TYPE first, fcl::NODE_TYPE second);

}  // namespace adaptive_bvh
