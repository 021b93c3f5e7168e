#include <optional>

#include "adaptive_bvh/proximity.h"
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

#define ADAPTIVE_BVH_INSTANTIATE(BV)                                                 \
  template bool isNearer(const AdaptiveBVHModel<BV>&, const fcl::Transform3<BV::S>&, \
                         const AdaptiveBVHModel<BV>&, const fcl::Transform3<BV::S>&, BV::S);
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
