#pragma once

#include <algorithm>
#include <cmath>

#include <fcl/common/types.h>

#include "geometry/float4.h"

namespace adaptive_bvh {

/// The axes next to some that are nearly orthonormal (Gram and Schmidt).
inline fcl::Matrix3d orthonormal(fcl::Matrix3d axes) {
  for (int k = 0; k < 3; ++k) {
    for (int j = 0; j < k; ++j) axes.col(k) -= axes.col(j) * axes.col(j).dot(axes.col(k));
    axes.col(k).normalize();
  }
  return axes;
}

/// The coordinates of a four-wide tree: y = scale R^T (x - origin), R a rotation, in double
/// precision. The scale is a power of two.
struct BodyCoordinates {
  fcl::Matrix3d to_body = fcl::Matrix3d::Identity();  ///< scale R^T
  fcl::Vector3d origin = fcl::Vector3d::Zero();
  double scale = 1;

  BodyCoordinates() = default;
  BodyCoordinates(const fcl::Matrix3d& axes, const fcl::Vector3d& from, double to_scale)
      : to_body(to_scale * axes.transpose()), origin(from), scale(to_scale) {}
  /// About a point, along axes that are orthonormal up to rounding, with the scale that brings a
  /// length to between 1 and 2.
  static BodyCoordinates about(const fcl::Vector3d& middle, const fcl::Matrix3d& along,
                               double length) {
    constexpr int kMost = 999;  // so that the scale and its inverse are numbers with all digits
    const int exponent = length > 0 ? std::clamp(std::ilogb(length), -kMost, kMost) : 0;
    return {orthonormal(along), middle, std::ldexp(1., -exponent)};
  }

  fcl::Matrix3d axes() const { return to_body.transpose() / scale; }
  fcl::Vector3d operator()(const fcl::Vector3d& x) const { return to_body * (x - origin); }
};

/// Coordinates of points, rounded to single precision, and what that took off them.
class RoundedCoordinates {
 public:
  explicit RoundedCoordinates(const BodyCoordinates& coordinates) : origin_(coordinates.origin) {
    const fcl::Matrix3d& m = coordinates.to_body;
    for (int k = 0; k < 3; ++k)
      columns_[k] = Column{Pack<double>{m(0, k), m(1, k)}, Pack<double>{m(2, k), 0}};
  }

  ADAPTIVE_BVH_INLINE void operator()(const fcl::Vector3d& x, Float4& rounded,
                                      Float4& residual) const {
    const Column y = along(x - origin_);
    rounded = float4::narrowed(y.xy, y.z);
    residual =
        float4::narrowed(y.xy - float4::widenedXy(rounded), y.z - float4::widenedZw(rounded));
  }

 private:
  struct Column {
    Pack<double> xy, z;  ///< z, and 0
  };
  ADAPTIVE_BVH_INLINE Column along(const fcl::Vector3d& x) const {
    const auto sum = [&](Pack<double> Column::*part) -> Pack<double> {
      using packs::all;
      return columns_[0].*part * all(x[0]) + columns_[1].*part * all(x[1]) +
             columns_[2].*part * all(x[2]);
    };
    return {sum(&Column::xy), sum(&Column::z)};
  }

  const fcl::Vector3d origin_;
  Column columns_[3];
};

}  // namespace adaptive_bvh
