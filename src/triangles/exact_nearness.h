#pragma once

#include <array>

#include "triangles/triangle_contact.h"

namespace adaptive_bvh {

/// Decides whether two features are at most a distance apart, without any error for the given
/// numbers. For the few pairs whose rounded distance is the limit up to its error; the others are
/// decided by their rounded distance, at a tenth of the cost. docs/bounds.md, 16.
class ExactNearness {
 public:
  using Segment = std::array<fcl::Vector3d, 2>;

  /// `distance`: from 0 to infinity. `radii`: the sum of the radii of balls around both bodies.
  ExactNearness(double distance, double radii)
      : distance_(distance),
        surely_near_(distance * (1 - kError) - 2 * kError * radii),
        surely_farther_(distance * (1 + kError) + 2 * kError * radii) {}

  /// Whether a vertex and a face are near, given their computed distance (FeatureDistance).
  bool areNear(double computed, const fcl::Vector3d& x, const TrianglePoints& face) const {
    if (computed < surely_near_) return true;
    return computed <= surely_farther_ && areNear(x, face);
  }
  /// Whether two edges are near.
  bool areNear(double computed, const Segment& a, const Segment& b) const {
    if (computed < surely_near_) return true;
    return computed <= surely_farther_ && areNear(a, b);
  }
  /// Whether two triangles are near, given their computed distance (gapOf).
  bool areNear(double computed, const TrianglePoints& a, const TrianglePoints& b) const {
    if (computed < surely_near_ || computed == 0) return true;  // 0: they touch
    return computed <= surely_farther_ && distance_ > 0 && areTrianglesNear(a, b);
  }
  /// Whether the computed distance of two triangles or features leaves open that they are near.
  bool mayBeNear(double computed) const { return computed <= surely_farther_; }

 private:
  /// Bounds the error of a computed distance, relative to the largest distance of two corners.
  static constexpr double kError = 0x1p-45;

  bool areNear(const fcl::Vector3d& x, const TrianglePoints& face) const;
  bool areNear(const Segment& a, const Segment& b) const;
  bool areTrianglesNear(const TrianglePoints& a, const TrianglePoints& b) const;

  double distance_, surely_near_, surely_farther_;
};

}  // namespace adaptive_bvh
