#include "query/fcl/mesh_mesh.h"

#include <fcl/narrowphase/detail/traversal/collision_node.h>
#include <fcl/narrowphase/detail/traversal/distance/mesh_distance_traversal_node.h>

#include "query/fcl/mesh_collision_node.h"
#include "query/fcl/recording_node.h"
#include "query/nearest_points.h"

namespace adaptive_bvh {

template <typename S>
S meshMeshDistance(const PlacedMesh<fcl::RSS<S>>& first, const PlacedMesh<fcl::RSS<S>>& second,
                   const DistanceQuery<S>& query) {
  if (query.isSatisfied()) return query.result.min_distance;
  using Node = fcl::detail::MeshDistanceTraversalNodeRSS<S>;
  // A result of its own: FCL moves the points to the world at the end, also those that an older
  // query of the same pair left there.
  fcl::DistanceResult<S> found(query.result.min_distance);
  RecordingDistanceNode<Node, S> node(statisticsOf(first, second));
  fcl::detail::initialize(static_cast<Node&>(node), *first.model, first.tf, *second.model,
                          second.tf, query.request, found);
  fcl::detail::distance(&node);
  if (found.o1) {
    settleNearestPoints<S>(first, second, {query.request, found});
    query.result.update(found);
  }
  return query.result.min_distance;
}

template <typename S>
std::size_t meshMeshCollide(const PlacedMesh<fcl::RSS<S>>& first,
                            const PlacedMesh<fcl::RSS<S>>& second, const CollisionQuery<S>& query) {
  if (query.isSatisfied()) return query.result.numContacts();
  RecordingCollisionNode<MeshCollisionNode<S>, S> node(statisticsOf(first, second));
  using Base = fcl::detail::MeshCollisionTraversalNodeRSS<S>;
  fcl::detail::initialize(static_cast<Base&>(node), *first.model, first.tf, *second.model,
                          second.tf, query.request, query.result);
  fcl::detail::collide(&node);
  return query.result.numContacts();
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                           \
  template S meshMeshDistance(const PlacedMesh<fcl::RSS<S>>&, const PlacedMesh<fcl::RSS<S>>&, \
                              const DistanceQuery<S>&);                                       \
  template std::size_t meshMeshCollide(const PlacedMesh<fcl::RSS<S>>&,                        \
                                       const PlacedMesh<fcl::RSS<S>>&, const CollisionQuery<S>&);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
