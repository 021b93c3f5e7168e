#include "adaptive_bvh/self_collision.h"

#include "geometry/rigid.h"
#include "query/box_contacts.h"

namespace adaptive_bvh {

template <typename S>
std::size_t selfCollide(const DeformableMesh<S>& mesh, const fcl::Transform3<S>& tf,
                        const fcl::CollisionRequest<S>& request, fcl::CollisionResult<S>& result,
                        NeighbourFilter filter) {
  requireRigid(tf);
  const CollisionQuery<S> query{request, result};
  if (request.num_max_contacts > 0 && !query.isSatisfied())
    selfCollideMesh(PlacedMesh<S>(mesh, tf), query, filter);
  return result.numContacts();
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                           \
  template std::size_t selfCollide(const DeformableMesh<S>&, const fcl::Transform3<S>&,       \
                                   const fcl::CollisionRequest<S>&, fcl::CollisionResult<S>&, \
                                   NeighbourFilter);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
