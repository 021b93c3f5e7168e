#include "query/nearest_points.h"

#include "query/placed_triangle.h"
#include "query/unset_fields.h"
#include "volume/each_volume.h"

namespace adaptive_bvh {

template <typename BV>
void settleNearestPoints(const PlacedMesh<BV>& first, const PlacedMesh<BV>& second,
                         const DistanceQuery<typename BV::S>& query) {
  using S = typename BV::S;
  fcl::DistanceResult<S>& result = query.result;
  if (!query.request.enable_nearest_points) return unsetPoints(result);
  if (result.min_distance > 0) return;
  const PointPair<S> common =
      nearestPoints(triangleInWorld(*first.model, static_cast<int>(result.b1), first.tf),
                    triangleInWorld(*second.model, static_cast<int>(result.b2), second.tf));
  result.nearest_points[0] = common.first;
  result.nearest_points[1] = common.second;
}

#define ADAPTIVE_BVH_INSTANTIATE(BV)                                              \
  template void settleNearestPoints(const PlacedMesh<BV>&, const PlacedMesh<BV>&, \
                                    const DistanceQuery<BV::S>&);
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
