#include "query/nearest_points.h"

#include "query/placed_triangle.h"
#include "query/unset_fields.h"

namespace adaptive_bvh {

template <typename S>
void settleNearestPoints(const PlacedMesh<fcl::RSS<S>>& first,
                         const PlacedMesh<fcl::RSS<S>>& second, const DistanceQuery<S>& query) {
  fcl::DistanceResult<S>& result = query.result;
  if (!query.request.enable_nearest_points) return unsetPoints(result);
  if (result.min_distance > 0) return;
  const PointPair<S> common =
      nearestPoints(triangleInWorld(*first.model, static_cast<int>(result.b1), first.tf),
                    triangleInWorld(*second.model, static_cast<int>(result.b2), second.tf));
  result.nearest_points[0] = common.first;
  result.nearest_points[1] = common.second;
}

template void settleNearestPoints(const PlacedMesh<fcl::RSS<float>>&,
                                  const PlacedMesh<fcl::RSS<float>>&, const DistanceQuery<float>&);
template void settleNearestPoints(const PlacedMesh<fcl::RSS<double>>&,
                                  const PlacedMesh<fcl::RSS<double>>&,
                                  const DistanceQuery<double>&);

}  // namespace adaptive_bvh
