#pragma once

#include "update/body_volume.h"

namespace adaptive_bvh {

/// The corners of four triangles, a lane each.
struct CornersOf4 {
  float4::Columns p, q, r;
};

/// Their volumes: the rectangle on the longest edge, which has twice the area of the triangle, the
/// least any rectangle has.
void fitTriangles(const CornersOf4& triangles, BodyVolume (&volumes)[kLanes]);

}  // namespace adaptive_bvh
