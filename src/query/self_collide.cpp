#include "adaptive_bvh/self_collision.h"

#include <fcl/narrowphase/detail/traversal/collision_node.h>

#include "geometry/rigid.h"
#include "model_state.h"
#include "query/box_contacts.h"
#include "query/fcl/recording_node.h"
#include "query/fcl/self_collision_node.h"
#include "query/placed_mesh.h"
#include "volume/each_volume.h"

namespace adaptive_bvh {
namespace {

template <typename BV>
void searchVolumes(const PlacedMesh<BV>& mesh, const CollisionQuery<typename BV::S>& query,
                   NeighbourFilter filter) {
  using S = typename BV::S;
  RecordingCollisionNode<SelfCollisionNode<BV>, S> node(statisticsOf(mesh, mesh));
  node.initialize(mesh, mesh, query);
  node.filter = filter;
  fcl::detail::selfCollide(static_cast<fcl::detail::CollisionTraversalNodeBase<S>*>(&node));
}

}  // namespace

template <typename BV>
std::size_t selfCollide(const AdaptiveBVHModel<BV>& model,
                        const fcl::Transform3<typename BV::S>& tf,
                        const fcl::CollisionRequest<typename BV::S>& request,
                        fcl::CollisionResult<typename BV::S>& result, NeighbourFilter filter) {
  using S = typename BV::S;
  requireRigid(tf);
  detail::ModelAccess<BV>::repairedType(
      model);  // repairs a tree that was changed without our update
  requireTriangles<BV>(model);
  const CollisionQuery<S> query{request, result};
  if (request.num_max_contacts == 0 || query.isSatisfied()) return result.numContacts();
  const PlacedMesh<BV> mesh{&model, &detail::ModelAccess<BV>::tree(model), tf};
  if (mesh.hasBoxes())
    selfCollideByBoxes(mesh, query, filter);
  else
    searchVolumes(mesh, query, filter);
  return result.numContacts();
}

#define ADAPTIVE_BVH_INSTANTIATE(BV)                                                           \
  template std::size_t selfCollide(const AdaptiveBVHModel<BV>&, const fcl::Transform3<BV::S>&, \
                                   const fcl::CollisionRequest<BV::S>&,                        \
                                   fcl::CollisionResult<BV::S>&, NeighbourFilter);
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
