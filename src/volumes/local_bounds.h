#pragma once

#include <fcl/geometry/bvh/BVH_model.h>

namespace adaptive_bvh {

/// Brings aabb_local, aabb_center and aabb_radius up to date, as FCL's computeLocalAABB does.
template <typename BV>
void updateLocalBounds(fcl::BVHModel<BV>& model);

/// Writes the positions of the vertices in [begin, end) to the model. Returns the squared distance
/// from the centre to the farthest one.
template <typename BV>
typename BV::S writePositions(fcl::BVHModel<BV>& model,
                              const fcl::Vector3<typename BV::S>* positions, int begin, int end);

}  // namespace adaptive_bvh
