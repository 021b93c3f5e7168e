#pragma once

#include <cmath>

#include "volume/swept_rectangle.h"

namespace adaptive_bvh {

/// How far some points extend along each of three axes.
struct Ranges {
  Interval<float> x, y, z;
};

/// What holds some points along given axes, in single precision: a rectangle with a sphere, whose
/// plane is that of the first two axes.
struct Extents {
  float corner[3];  ///< the least of the rectangle
  float sides[2];   ///< of the rectangle
  float radius;     ///< with which it holds the points, as computed
  Ranges ranges{};  ///< of the points; set where Volume::kHasBox

  /// Of the surface.
  float area() const {
    return 2 * sides[0] * sides[1] + float(2 * M_PI) * radius * (sides[0] + sides[1]) +
           float(4 * M_PI) * radius * radius;
  }
};

/// Of points along the axes, whose third coordinates are in `z`. Which sphere suits them is
/// judged on a few of them; `few` is work space.
Extents extentsOf(const LocalPoints<float>& points, const Interval<float>& z,
                  LocalPoints<float>& few);

}  // namespace adaptive_bvh
