#include <stdexcept>

#include "fcl/mesh_pairs.h"
#include "fcl/octree_pair.h"
#include "query/single_precision.h"

namespace adaptive_bvh {

#if FCL_HAVE_OCTOMAP

template <typename S>
void meshOctreeDistance(const MeshObject<S>& mesh, const PlacedGeometry<S>& octree,
                        const DistanceQuery<S>& query) {
  const PlacedOctree placed{OctreeCells(*octree.geometry), octree.tf.template cast<double>()};
  answerInDouble(query, octree.geometry, mesh.geometry, [&](const DistanceQuery<double>& asked) {
    distanceToOctree(QueryTriangles(mesh.placed), WideNodes(mesh.placed.tree()), placed, asked);
  });
}

template <typename S>
void meshOctreeCollide(const MeshObject<S>& mesh, const PlacedGeometry<S>& octree,
                       const CollisionQuery<S>& query) {
  if (query.isSatisfied()) return;
  const PlacedOctree placed{OctreeCells(*octree.geometry), octree.tf.template cast<double>()};
  answerInDouble(query, octree.geometry, mesh.geometry,
                 [&](const fcl::CollisionGeometryd& o1, const fcl::CollisionGeometryd& o2,
                     const CollisionQuery<double>& asked) {
                   collideWithOctree(QueryTriangles(mesh.placed), WideNodes(mesh.placed.tree()),
                                     placed, o1, o2, asked);
                 });
}

#else

template <typename S>
void meshOctreeDistance(const MeshObject<S>&, const PlacedGeometry<S>&, const DistanceQuery<S>&) {
  refuseOctree();
}
template <typename S>
void meshOctreeCollide(const MeshObject<S>&, const PlacedGeometry<S>&, const CollisionQuery<S>&) {
  refuseOctree();
}

#endif

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                \
  template void meshOctreeDistance(const MeshObject<S>&, const PlacedGeometry<S>&, \
                                   const DistanceQuery<S>&);                       \
  template void meshOctreeCollide(const MeshObject<S>&, const PlacedGeometry<S>&,  \
                                  const CollisionQuery<S>&);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
