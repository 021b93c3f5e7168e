#include "dispatch/octree_pair.h"
#include "fcl/fcl_nodes.h"
#include "fcl/model_pairs.h"
#include "query/single_precision.h"
#include "thesis/volumes/volume.h"

// Distance and collision of a model and an octree: the searches of dispatch/octree_pair.h over the
// model's FCL tree, in double precision.
namespace adaptive_bvh {

#if FCL_HAVE_OCTOMAP

template <typename BV>
void modelOctreeDistance(const PlacedModel<BV>& model, const PlacedGeometry<typename BV::S>& octree,
                         const DistanceQuery<typename BV::S>& query) {
  const PlacedOctree placed{OctreeCells(*octree.geometry), octree.tf.template cast<double>()};
  answerInDouble(query, octree.geometry, model.model, [&](const DistanceQuery<double>& in_double) {
    distanceToOctree(model.queryTriangles(), FclNodes<BV>(model), placed, in_double);
  });
}

template <typename BV>
void modelOctreeCollide(const PlacedModel<BV>& model, const PlacedGeometry<typename BV::S>& octree,
                        const CollisionQuery<typename BV::S>& query) {
  if (query.isSatisfied()) return;
  const PlacedOctree placed{OctreeCells(*octree.geometry), octree.tf.template cast<double>()};
  answerInDouble(query, octree.geometry, model.model,
                 [&](const fcl::CollisionGeometryd& o1, const fcl::CollisionGeometryd& o2,
                     const CollisionQuery<double>& in_double) {
                   collideWithOctree(model.queryTriangles(), FclNodes<BV>(model), placed, o1, o2,
                                     in_double);
                 });
}

#else

namespace {
[[noreturn]] void refuseOctree() {
  throw std::logic_error("adaptive_bvh: FCL was built without octomap");
}
}  // namespace

template <typename BV>
void modelOctreeDistance(const PlacedModel<BV>&, const PlacedGeometry<typename BV::S>&,
                         const DistanceQuery<typename BV::S>&) {
  refuseOctree();
}
template <typename BV>
void modelOctreeCollide(const PlacedModel<BV>&, const PlacedGeometry<typename BV::S>&,
                        const CollisionQuery<typename BV::S>&) {
  refuseOctree();
}

#endif

#define ADAPTIVE_BVH_INSTANTIATE(BV)                                                      \
  template void modelOctreeDistance(const PlacedModel<BV>&, const PlacedGeometry<BV::S>&, \
                                    const DistanceQuery<BV::S>&);                         \
  template void modelOctreeCollide(const PlacedModel<BV>&, const PlacedGeometry<BV::S>&,  \
                                   const CollisionQuery<BV::S>&);
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
