#pragma once

#include "dispatch/query_object.h"

namespace adaptive_bvh {

/// What is run for a pair of objects, by their kinds. The searches are given the pair in the order
/// of results: of a mesh and a shape the mesh comes first, of a mesh and an octree the octree, as
/// in FCL.
struct PairSearch {
  bool is_swapped;  ///< whether that is the other order than that of the kinds
  /// Lowers query.result, in which it names no objects.
  void (*distance)(const QueryObject& first, const QueryObject& second,
                   const DistanceQuery<double>& query);
  /// Adds contacts.
  void (*collide)(const QueryObject& first, const QueryObject& second,
                  const fcl::CollisionGeometryd& o1, const fcl::CollisionGeometryd& o2,
                  const CollisionQuery<double>& query);
};

/// The table of pairs.
const PairSearch& searchOf(ObjectKind first, ObjectKind second);

}  // namespace adaptive_bvh
