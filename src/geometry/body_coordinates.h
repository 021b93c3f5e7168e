#pragma once

#include <algorithm>
#include <cmath>

#include "geometry/body_frame.h"

namespace adaptive_bvh {

/// The coordinates of a four-wide tree: y = scale R^T (x - origin), R a rotation, in double
/// precision. The scale is a power of two.
struct BodyCoordinates {
  fcl::Matrix3d to_body = fcl::Matrix3d::Identity();  ///< scale R^T
  fcl::Vector3d origin = fcl::Vector3d::Zero();
  double scale = 1;

  BodyCoordinates() = default;
  BodyCoordinates(const fcl::Matrix3d& axes, const fcl::Vector3d& from, double to_scale)
      : to_body(to_scale * axes.transpose()), origin(from), scale(to_scale) {}
  /// Those of a frame, with a scale that brings `size`, in its units, to between 1 and 2.
  template <typename S>
  BodyCoordinates(const BodyFrame<S>& frame, float size)
      : BodyCoordinates(
            frame.axes(), frame.origin().template cast<double>(),
            std::ldexp(static_cast<double>(frame.scale()), -std::ilogb(std::max(size, 1e-30f)))) {}

  fcl::Matrix3d axes() const { return to_body.transpose() / scale; }
  fcl::Vector3d operator()(const fcl::Vector3d& x) const { return to_body * (x - origin); }
};

}  // namespace adaptive_bvh
