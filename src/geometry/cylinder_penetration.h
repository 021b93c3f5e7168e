#pragma once

#include "geometry/convex_distance.h"

namespace adaptive_bvh {

/// How deep a triangle is in a cylinder around the z axis, from -half to half, that it touches. By
/// the directions in which the way out can be shortest: docs/bounds.md, 17.
Penetration cylinderPenetration(const TrianglePoints<double>& triangle, double radius, double half);

}  // namespace adaptive_bvh
