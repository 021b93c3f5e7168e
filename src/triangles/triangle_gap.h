#pragma once

#include <algorithm>
#include <limits>

#include "triangles/feature_distance.h"
#include "triangles/triangle_contact.h"

namespace adaptive_bvh {

/// The nearest points of two triangles and their distance.
struct TriangleGap {
  PointPair points;
  double distance;
};

/// The nearest points of two triangles. The error of the distance is at most 2^-46 of their extent,
/// the largest component of a difference of two corners, whatever their shapes. The distance is 0
/// if and only if the triangles have a common point, which is decided exactly
/// (triangle_intersection.h); then both points are a common point, up to rounding.
TriangleGap gapOf(const TrianglePoints& a, const TrianglePoints& b);

/// Rounding errors of distances of bodies. The error of a separation along a line is relative to
/// the magnitude of the coordinates; the error of a distance of nearest points, which may exceed
/// the triangles' distance, is relative to the distance. docs/bounds.md, 5.
class DistanceRounding {
 public:
  /// `magnitude` bounds the coordinates of both bodies (C in docs/bounds.md).
  explicit DistanceRounding(double magnitude) : of_separations_(8 * 0x1p-52 * magnitude) {}

  /// A bound of the error of a separation along a line.
  double ofSeparations() const { return of_separations_; }
  /// Whether bodies at this rounded distance certainly do not touch.
  bool isClear(double distance) const { return distance > 4 * of_separations_; }
  /// The distance minus both errors: candidates that are not nearer count as equally near. Infinite
  /// if the distance is.
  double below(double distance) const { return distance * (1 - 18 * 0x1p-52) - of_separations_; }

 private:
  double of_separations_;
};

/// Whether two triangles are certainly farther apart than `distance`, by their gap along a normal
/// or along the cross product of an edge of each. Detects most pairs that are farther, and is much
/// cheaper than gapOf. docs/bounds.md, 16.
inline bool areSurelyFarther(const TrianglePoints& a, const TrianglePoints& b, double distance) {
  const std::array<fcl::Vector3d, 5> from_a = {a[1] - a[0], a[2] - a[0], b[0] - a[0], b[1] - a[0],
                                               b[2] - a[0]};
  double extent = 0;
  for (const fcl::Vector3d& x : from_a) extent = std::max(extent, x.lpNorm<Eigen::Infinity>());
  const double enough = distance * (1 + 0x1p-40) + 0x1p-45 * extent;
  const auto areFartherAlong = [&](const fcl::Vector3d& n) {
    const double a1 = n.dot(from_a[0]), a2 = n.dot(from_a[1]);
    const double b0 = n.dot(from_a[2]), b1 = n.dot(from_a[3]), b2 = n.dot(from_a[4]);
    const double gap = std::max(std::min({b0, b1, b2}) - std::max({0., a1, a2}),
                                std::min({0., a1, a2}) - std::max({b0, b1, b2}));
    return gap > enough * n.norm() + 0x1p-960;
  };
  const std::array<fcl::Vector3d, 3> a_edges = {from_a[0], from_a[1], from_a[1] - from_a[0]},
                                     b_edges = {from_a[3] - from_a[2], from_a[4] - from_a[2],
                                                from_a[4] - from_a[3]};
  if (areFartherAlong(a_edges[0].cross(a_edges[1])) ||
      areFartherAlong(b_edges[0].cross(b_edges[1])))
    return true;
  for (const fcl::Vector3d& e : a_edges)
    for (const fcl::Vector3d& f : b_edges)
      if (areFartherAlong(e.cross(f))) return true;
  return false;
}

}  // namespace adaptive_bvh
