#include "query/mesh_mesh.h"

#include <fcl/narrowphase/detail/traversal/collision_node.h>
#include <fcl/narrowphase/detail/traversal/distance/mesh_distance_traversal_node.h>

#include "query/mesh_collision_node.h"
#include "query/nearest_points.h"

namespace adaptive_bvh {

template <typename S>
bool boxedMeshDistance(const BoxedMesh<S>& first, const BoxedMesh<S>& second,
                       const fcl::DistanceRequest<S>& request, fcl::DistanceResult<S>& result) {
  if (request.isSatisfied(result)) return true;
  BoxedDistance<S> search(first, second, request, result);
  if (!search.isPossible()) return false;
  RecentPairs& recent = first.tree->recent;
  const RecentPairs::Pair last = recent.recall(second.model);
  search.seed(int(last.first), int(last.second));
  if (!search.isDone()) search.visit(0, 0);
  search.finish();
  if (search.improved()) recent.keep(second.model, {unsigned(result.b1), unsigned(result.b2)});
  return true;
}

template <typename S>
S meshMeshDistance(const fcl::BVHModel<fcl::RSS<S>>& mesh1, const fcl::Transform3<S>& tf1,
                   const fcl::BVHModel<fcl::RSS<S>>& mesh2, const fcl::Transform3<S>& tf2,
                   const fcl::DistanceRequest<S>& request, fcl::DistanceResult<S>& result,
                   const Recorder& recorder) {
  if (request.isSatisfied(result)) return result.min_distance;
  using Node = fcl::detail::MeshDistanceTraversalNodeRSS<S>;
  // A result of its own: FCL moves the points to the world at the end, also those that an older
  // query of the same pair left there.
  fcl::DistanceResult<S> found(result.min_distance);
  RecordingDistanceNode<Node, S> node(recorder);
  fcl::detail::initialize(static_cast<Node&>(node), mesh1, tf1, mesh2, tf2, request, found);
  fcl::detail::distance(&node);
  if (found.o1) {
    settleNearestPoints(mesh1, tf1, mesh2, tf2, request, found);
    result.update(found);
  }
  return result.min_distance;
}

template <typename S>
std::size_t meshMeshCollide(const fcl::BVHModel<fcl::RSS<S>>& mesh1, const fcl::Transform3<S>& tf1,
                            const fcl::BVHModel<fcl::RSS<S>>& mesh2, const fcl::Transform3<S>& tf2,
                            const fcl::CollisionRequest<S>& request,
                            fcl::CollisionResult<S>& result, const Recorder& recorder) {
  if (request.isSatisfied(result)) return result.numContacts();
  RecordingCollisionNode<MeshCollisionNode<S>, S> node(recorder);
  using Base = fcl::detail::MeshCollisionTraversalNodeRSS<S>;
  fcl::detail::initialize(static_cast<Base&>(node), mesh1, tf1, mesh2, tf2, request, result);
  fcl::detail::collide(&node);
  return result.numContacts();
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                         \
  template bool boxedMeshDistance(const BoxedMesh<S>&, const BoxedMesh<S>&,                 \
                                  const fcl::DistanceRequest<S>&, fcl::DistanceResult<S>&); \
  template S meshMeshDistance(const fcl::BVHModel<fcl::RSS<S>>&, const fcl::Transform3<S>&, \
                              const fcl::BVHModel<fcl::RSS<S>>&, const fcl::Transform3<S>&, \
                              const fcl::DistanceRequest<S>&, fcl::DistanceResult<S>&,      \
                              const Recorder&);                                             \
  template std::size_t meshMeshCollide(                                                     \
      const fcl::BVHModel<fcl::RSS<S>>&, const fcl::Transform3<S>&,                         \
      const fcl::BVHModel<fcl::RSS<S>>&, const fcl::Transform3<S>&,                         \
      const fcl::CollisionRequest<S>&, fcl::CollisionResult<S>&, const Recorder&);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
