#pragma once

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/narrowphase/distance_request.h>
#include <fcl/narrowphase/distance_result.h>

namespace adaptive_bvh {

/// The last step of a distance of two meshes that improved `result`. Points that were not asked for
/// become NaN; those of meshes that touch, where FCL's mean nothing, a common point of the two
/// triangles in the world.
template <typename S>
void settleNearestPoints(const fcl::BVHModel<fcl::RSS<S>>& first, const fcl::Transform3<S>& tf1,
                         const fcl::BVHModel<fcl::RSS<S>>& second, const fcl::Transform3<S>& tf2,
                         const fcl::DistanceRequest<S>& request, fcl::DistanceResult<S>& result);

}  // namespace adaptive_bvh
