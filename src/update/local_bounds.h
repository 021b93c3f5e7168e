#pragma once

#include <fcl/geometry/bvh/BVH_model.h>

namespace adaptive_bvh {

/// Brings aabb_local, aabb_center and aabb_radius up to date, as FCL's computeLocalAABB does.
template <typename BV>
void updateLocalBounds(fcl::BVHModel<BV>& model);

/// The same where the corners of the box are known.
template <typename BV>
void setLocalBounds(fcl::BVHModel<BV>& model, const fcl::Vector3<typename BV::S>& low,
                    const fcl::Vector3<typename BV::S>& high);

}  // namespace adaptive_bvh
