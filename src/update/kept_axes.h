#pragma once

#include <vector>

#include "geometry/packed_rotation.h"

namespace adaptive_bvh {

/// By node: the axes of its volume, in a frame that three of its vertices span. So they turn as the
/// node does. Four bytes a node.
using KeptAxes = std::vector<PackedRotation>;

}  // namespace adaptive_bvh
