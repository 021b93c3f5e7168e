#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "triangles/convex_distance.h"

namespace adaptive_bvh {

/// The shortest of the motions along some directions that take a convex set out of a triangle.
/// `Reach` says how far the set reaches against a direction of length 1.
template <typename Reach>
class ShortestWay {
 public:
  ShortestWay(const TrianglePoints<double>& triangle, const Reach& reach)
      : triangle_(triangle), reach_(reach) {}

  /// Along a direction of any length; nothing where it is 0.
  void tryDirection(const fcl::Vector3d& direction) {
    const double length = direction.norm();
    if (!(length > 0)) return;
    const fcl::Vector3d m = direction / length;
    const double way =
        reach_(m) + std::max({m.dot(triangle_[0]), m.dot(triangle_[1]), m.dot(triangle_[2])});
    if (!(way < depth_)) return;
    depth_ = way;
    normal_ = m;
  }
  void tryBoth(const fcl::Vector3d& direction) {
    tryDirection(direction);
    tryDirection(-direction);
  }
  void tryFaceNormal() {
    if (!isThin(triangle_))
      tryBoth((triangle_[1] - triangle_[0]).cross(triangle_[2] - triangle_[0]));
  }

  const fcl::Vector3d& normal() const { return normal_; }
  /// Less than 0 where they are apart along the normal.
  double signedDepth() const { return depth_; }
  Penetration penetration() const { return {normal_, std::max(depth_, 0.), 0}; }

 private:
  const TrianglePoints<double>& triangle_;
  Reach reach_;
  double depth_ = std::numeric_limits<double>::infinity();
  fcl::Vector3d normal_ = fcl::Vector3d::UnitX();
};

}  // namespace adaptive_bvh
