#pragma once

#include <cmath>
#include <stdexcept>
#include <string>

#include <fcl/common/types.h>

#include "base/number_text.h"

namespace adaptive_bvh {

/// A rigid transform of points between two frames, y = R x + T, in double precision. Every query
/// transforms the second mesh to the frame of the first by these same numbers, so all queries agree
/// whether two triangles touch.
struct RelativePlacement {
  fcl::Matrix3d R = fcl::Matrix3d::Identity();
  fcl::Vector3d T = fcl::Vector3d::Zero();

  RelativePlacement() = default;
  /// The transform from frame `from` to frame `to`, which are given by their poses in the world.
  RelativePlacement(const fcl::Transform3d& to, const fcl::Transform3d& from) {
    const fcl::Matrix3d from_world = to.linear().transpose();
    R = from_world * from.linear();
    T = from_world * (from.translation() - to.translation());
  }

  fcl::Vector3d operator()(const fcl::Vector3d& x) const { return R * x + T; }
};

/// Throws std::invalid_argument unless a transform is a rigid motion: finite, without scale, shear
/// or reflection. `kLargestError` bounds the deviation of R^T R from the identity; it leaves room
/// for a rotation composed of many.
inline void requireRigid(const fcl::Transform3d& tf) {
  constexpr double kLargestError = 1e-6;
  const fcl::Matrix3d R = tf.linear();
  const double error =
      (R.transpose() * R - fcl::Matrix3d::Identity()).squaredNorm();  // NaN stays NaN
  const bool is_rotation =
      error <= kLargestError * kLargestError && R.col(0).dot(R.col(1).cross(R.col(2))) > 0;
  if (!is_rotation || !tf.translation().allFinite())
    throw std::invalid_argument(
        "adaptive_bvh: a transform is not a rigid motion: its rotation must be orthonormal (to "
        "1e-6) "
        "with determinant 1, and all numbers finite");
}

// The functions below throw std::invalid_argument if a number that the user has given is not in the
// range that its query accepts. The message has the argument's name.

inline void requireDistance(double distance, const char* name = "distance") {
  if (!(distance >= 0))
    throw std::invalid_argument("adaptive_bvh: " + std::string(name) + " is " + textOf(distance) +
                                "; 0 or a positive length is needed");
}

inline void requireTolerance(double tolerance) { requireDistance(tolerance, "tolerance"); }

inline void requireSeparation(double separation) {
  if (!(separation >= 0) || !std::isfinite(separation))
    throw std::invalid_argument("adaptive_bvh: the distance is " + textOf(separation) +
                                "; 0 or a positive, finite length is needed");
}

}  // namespace adaptive_bvh
