#pragma once

#include <fcl/geometry/bvh/BVH_model.h>

namespace adaptive_bvh {

/// The axis-aligned box of the present positions, in the model's axes.
template <typename BV>
fcl::AABB<typename BV::S> boundsOf(const fcl::BVHModel<BV>& model);

/// Brings aabb_local, aabb_center and aabb_radius up to date, as FCL's computeLocalAABB does.
template <typename BV>
void updateLocalBounds(fcl::BVHModel<BV>& model);

}  // namespace adaptive_bvh
