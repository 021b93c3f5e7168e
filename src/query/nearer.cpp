#include <cmath>
#include <limits>

#include "adaptive_bvh/proximity.h"
#include "fcl/mesh_shape.h"
#include "query/near_search.h"

namespace adaptive_bvh {

template <typename S>
bool isNearer(const DeformableMesh<S>& first, const fcl::Transform3<S>& tf1,
              const DeformableMesh<S>& second, const fcl::Transform3<S>& tf2, S distance) {
  requireDistance(distance);
  requireRigid(tf1);
  requireRigid(tf2);
  const PairOfMeshes<S> meshes(first, tf1, second, tf2);
  const auto limit = static_cast<double>(distance);
  if (areBallsFarther(meshes.first, meshes.second, meshes.to_first, limit)) return false;
  TrianglePair pair{0, 0};
  if (!isFewEdges(meshes, limit) && canCompare(meshes, limit)) {
    S farther = distance;
    return compare(meshes, distance, pair, farther);
  }
  return searchAny(meshes, limit, pair);
}

template <typename S>
bool isNearer(const DeformableMesh<S>& mesh, const fcl::Transform3<S>& tf1,
              const fcl::CollisionGeometry<S>& shape, const fcl::Transform3<S>& tf2, S distance) {
  requireDistance(distance);
  requireRigid(tf1);
  requireRigid(tf2);
  const fcl::DistanceRequest<S> request;
  fcl::DistanceResult<S> result(std::nextafter(distance, std::numeric_limits<S>::infinity()));
  meshShapeDistance<S>(PlacedMesh<S>(mesh, tf1), {&shape, tf2}, {request, result}, distance);
  return result.o1 != nullptr;
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                               \
  template bool isNearer(const DeformableMesh<S>&, const fcl::Transform3<S>&,     \
                         const DeformableMesh<S>&, const fcl::Transform3<S>&, S); \
  template bool isNearer(const DeformableMesh<S>&, const fcl::Transform3<S>&,     \
                         const fcl::CollisionGeometry<S>&, const fcl::Transform3<S>&, S);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
