#include "dispatch/octree_pair.h"
#include "fcl/fcl_nodes.h"
#include "fcl/model_pairs.h"
#include "thesis/volumes/volume.h"

// Distance and collision of a model and an octree: the searches of dispatch/octree_pair.h over the
// model's FCL tree, in double precision.
namespace adaptive_bvh {

#if FCL_HAVE_OCTOMAP

template <typename BV>
void modelOctreeDistance(const PlacedModel<BV>& model, const PlacedGeometry& octree,
                         const DistanceQuery& query) {
  const PlacedOctree placed{OctreeCells(*octree.geometry), octree.tf};
  const double before = query.result.min_distance;
  distanceToOctree(model.queryTriangles(), FclNodes<BV>(model), placed, query);
  setObjects(before, *octree.geometry, *model.model, query);
}

template <typename BV>
void modelOctreeCollide(const PlacedModel<BV>& model, const PlacedGeometry& octree,
                        const CollisionQuery& query) {
  if (query.isSatisfied()) return;
  const PlacedOctree placed{OctreeCells(*octree.geometry), octree.tf};
  collideWithOctree(model.queryTriangles(), FclNodes<BV>(model), placed, *octree.geometry,
                    *model.model, query);
}

#else

namespace {
[[noreturn]] void refuseOctree() {
  throw std::logic_error("adaptive_bvh: FCL was built without octomap");
}
}  // namespace

template <typename BV>
void modelOctreeDistance(const PlacedModel<BV>&, const PlacedGeometry&, const DistanceQuery&) {
  refuseOctree();
}
template <typename BV>
void modelOctreeCollide(const PlacedModel<BV>&, const PlacedGeometry&, const CollisionQuery&) {
  refuseOctree();
}

#endif

#define ADAPTIVE_BVH_INSTANTIATE(BV)                                               \
  template void modelOctreeDistance(const PlacedModel<BV>&, const PlacedGeometry&, \
                                    const DistanceQuery&);                         \
  template void modelOctreeCollide(const PlacedModel<BV>&, const PlacedGeometry&,  \
                                   const CollisionQuery&);
ADAPTIVE_BVH_FOR_EACH_DOUBLE_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
