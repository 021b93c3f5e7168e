#pragma once

#include <fcl/geometry/collision_geometry.h>

namespace adaptive_bvh {

/// Throws std::invalid_argument, with the names of both types, where FCL has no such query: there
/// FCL prints a warning and answers "very far apart" or "no contact", or crashes.
void requireDistance(fcl::NODE_TYPE first, fcl::NODE_TYPE second);
void requireCollision(fcl::NODE_TYPE first, fcl::NODE_TYPE second);

}  // namespace adaptive_bvh
