#pragma once

#include <limits>

#include "geometry/triangle_contact.h"

namespace adaptive_bvh {

/// The nearest points of two triangles and their distance, 0 where it is mostly rounding.
struct TriangleGap {
  PointPair<double> points;
  double distance;
};

/// Off by less than 2^-46 of the largest coordinate. 2^-48 of the extent is sixteen epsilon: by so
/// much the points of triangles that intersect may differ.
inline TriangleGap gapOf(const TrianglePoints<double>& a, const TrianglePoints<double>& b) {
  const PointPair<double> points = nearestPoints(a, b);
  const double distance = (points.first - points.second).norm();
  double extent = 0;
  for (std::size_t k = 0; k < 3; ++k)
    extent = std::max({extent, (a[k] - a[0]).template lpNorm<Eigen::Infinity>(),
                       (b[k] - a[0]).template lpNorm<Eigen::Infinity>()});
  constexpr double kNothing = 16 * std::numeric_limits<double>::epsilon();
  return {points, distance <= kNothing * extent ? 0 : distance};
}

}  // namespace adaptive_bvh
