#pragma once

#include <cstddef>
#include <limits>

#include <fcl/narrowphase/collision_result.h>
#include <fcl/narrowphase/distance_result.h>

namespace adaptive_bvh {

// FCL leaves what it does not compute uninitialised. Here it is NaN, so that a mistake shows.

template <typename S>
fcl::Vector3<S> unsetPoint() {
  return fcl::Vector3<S>::Constant(std::numeric_limits<S>::quiet_NaN());
}

template <typename S>
void unsetPoints(fcl::DistanceResult<S>& result) {
  for (fcl::Vector3<S>& point : result.nearest_points) point = unsetPoint<S>();
}

/// Position, normal and depth of the contacts from number `first` on. (CollisionResult hands out
/// its contacts only to be read, but it is not const.)
template <typename S>
void unsetFields(fcl::CollisionResult<S>& result, std::size_t first) {
  for (std::size_t i = first; i < result.numContacts(); ++i) {
    auto& contact = const_cast<fcl::Contact<S>&>(result.getContact(i));
    contact.pos = contact.normal = unsetPoint<S>();
    contact.penetration_depth = std::numeric_limits<S>::quiet_NaN();
  }
}

}  // namespace adaptive_bvh
