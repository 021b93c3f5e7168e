#pragma once

#include "dispatch/query_object.h"

namespace adaptive_bvh {

/// The queries of a pair of objects. They take the objects in the order of FCL's results: a mesh
/// before a shape, an octree before a mesh.
struct PairSearch {
  bool is_swapped;  ///< whether the functions take the pair's objects in reverse order
  /// Lowers query.result to the distance. Does not set the result's objects.
  void (*distance)(const QueryObject& first, const QueryObject& second, const DistanceQuery& query);
  /// Adds contacts to query.result, between o1 (the object `first`) and o2.
  void (*collide)(const QueryObject& first, const QueryObject& second,
                  const fcl::CollisionGeometryd& o1, const fcl::CollisionGeometryd& o2,
                  const CollisionQuery& query);
};

/// The queries for two kinds of objects.
const PairSearch& searchOf(ObjectKind first, ObjectKind second);

}  // namespace adaptive_bvh
