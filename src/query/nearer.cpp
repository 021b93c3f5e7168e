#include <cmath>
#include <limits>
#include <optional>

#include "adaptive_bvh/proximity.h"
#include "query/fcl/mesh_shape.h"
#include "query/nearest_known.h"
#include "volume/each_volume.h"

namespace adaptive_bvh {

template <typename BV>
bool isNearer(const AdaptiveBVHModel<BV>& first, const fcl::Transform3<typename BV::S>& tf1,
              const AdaptiveBVHModel<BV>& second, const fcl::Transform3<typename BV::S>& tf2,
              typename BV::S distance) {
  requireDistance(distance);
  requireRigid(tf1);
  requireRigid(tf2);
  requireQueryable(first);
  requireQueryable(second);
  const PairOfMeshes<BV> meshes(first, tf1, second, tf2);
  NearestKnown<BV> known(meshes);
  const auto limit = static_cast<double>(distance);
  if (known.isNearer(limit)) return true;
  if (canCompareByBoxes(meshes, limit)) {
    PairCache<BV> cache = known.cache();
    typename BV::S farther = distance;
    const std::optional<bool> is_nearer = compareByBoxes(meshes.first, meshes.second, distance,
                                                         isFewEdges(meshes, limit), cache, farther);
    known.keep(cache);
    if (is_nearer) return *is_nearer;
  }
  return known.searchNearer(limit);
}

template <typename BV>
bool isNearer(const AdaptiveBVHModel<BV>& model, const fcl::Transform3<typename BV::S>& tf1,
              const fcl::CollisionGeometry<typename BV::S>& shape,
              const fcl::Transform3<typename BV::S>& tf2, typename BV::S distance) {
  using S = typename BV::S;
  requireDistance(distance);
  requireRigid(tf1);
  requireRigid(tf2);
  requireQueryable(model);
  const fcl::DistanceRequest<S> request;
  fcl::DistanceResult<S> result(std::nextafter(distance, std::numeric_limits<S>::infinity()));
  meshShapeDistance<BV>(placed(model, tf1), {&shape, tf2}, {request, result}, distance);
  return result.o1 != nullptr;
}

#define ADAPTIVE_BVH_INSTANTIATE(BV)                                                          \
  template bool isNearer(const AdaptiveBVHModel<BV>&, const fcl::Transform3<BV::S>&,          \
                         const AdaptiveBVHModel<BV>&, const fcl::Transform3<BV::S>&, BV::S);  \
  template bool isNearer(const AdaptiveBVHModel<BV>&, const fcl::Transform3<BV::S>&,          \
                         const fcl::CollisionGeometry<BV::S>&, const fcl::Transform3<BV::S>&, \
                         BV::S);
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
