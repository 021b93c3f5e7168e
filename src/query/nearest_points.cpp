#include "query/nearest_points.h"

#include "query/shape_triangle.h"
#include "query/triangle_contact.h"
#include "query/unset_fields.h"

namespace adaptive_bvh {
template <typename S>
void settleNearestPoints(const fcl::BVHModel<fcl::RSS<S>>& first, const fcl::Transform3<S>& tf1,
                         const fcl::BVHModel<fcl::RSS<S>>& second, const fcl::Transform3<S>& tf2,
                         const fcl::DistanceRequest<S>& request, fcl::DistanceResult<S>& result) {
  if (!request.enable_nearest_points) return unsetPoints(result);
  if (result.min_distance > 0) return;
  const PointPair<S> common = nearestPoints(triangleInWorld(first, result.b1, tf1),
                                            triangleInWorld(second, result.b2, tf2));
  result.nearest_points[0] = common.first;
  result.nearest_points[1] = common.second;
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                               \
  template void settleNearestPoints(const fcl::BVHModel<fcl::RSS<S>>&, const fcl::Transform3<S>&, \
                                    const fcl::BVHModel<fcl::RSS<S>>&, const fcl::Transform3<S>&, \
                                    const fcl::DistanceRequest<S>&, fcl::DistanceResult<S>&);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
