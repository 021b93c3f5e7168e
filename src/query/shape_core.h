#pragma once

#include <limits>

#include <fcl/common/types.h>

namespace adaptive_bvh {

/// What encloses a shape: a box and all that is at most a radius away from it. Of a sphere, a
/// capsule, a box, a plane and a half-space it is the shape itself.
struct ShapeCore {
  /// Takes the coordinates of the box to those of the shape.
  fcl::Matrix3d axes = fcl::Matrix3d::Identity();
  fcl::Vector3d low, high;  ///< infinite where the shape is
  double radius = 0;

  bool isBounded() const { return low.allFinite() && high.allFinite(); }
};

/// All x with least <= n x <= most.
inline ShapeCore coreOfSlab(const fcl::Vector3d& n, double least, double most) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const double length = n.norm();
  ShapeCore core;
  core.axes = Eigen::Quaterniond::FromTwoVectors(fcl::Vector3d::UnitX(), n).toRotationMatrix();
  core.low = fcl::Vector3d(least / length, -kInfinity, -kInfinity);
  core.high = fcl::Vector3d(most / length, kInfinity, kInfinity);
  return core;
}

}  // namespace adaptive_bvh
