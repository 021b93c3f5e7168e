#pragma once

#include "geometry/axes4.h"
#include "volume/extents.h"

namespace adaptive_bvh {

/// A bounding volume in body coordinates, as a fit decides it.
struct BodyVolume {
  Axes4 axes;
  Float4 corner;  ///< where Extents::corner is
  Extents extents;
};

/// So many are worked on at once, a lane each.
constexpr int kLanes = 4;

}  // namespace adaptive_bvh
