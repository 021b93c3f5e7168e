#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

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

/// The coordinates of a model's boxes: y = scale R^T (x - origin). R are the axes of the root's
/// volume, turned with the body; the origin is near its middle. A flat or long body that lies askew
/// in the mesh's coordinates lies straight in these, and its boxes are tight. The scale is a power
/// of two that brings the body's size to about 1, so that neither huge nor tiny meshes leave the
/// range of single precision.
template <typename S>
class BodyFrame {
 public:
  using Point = fcl::Vector3<S>;

  BodyFrame() : BodyFrame(fcl::Matrix3d::Identity(), Point::Zero(), S(1)) {}

  /// `axes` orthonormal up to the rounding of S; `size` some length of the body, >= 0.
  BodyFrame(const fcl::Matrix3d& axes, const Point& origin, S size) : origin_(origin) {
    turn(orthonormal(axes));  // S may be float
    const int limit = std::numeric_limits<S>::max_exponent - 25;
    const int exponent = size > 0 ? std::min(std::max(std::ilogb(size), -limit), limit) : 0;
    scale_ = std::ldexp(S(1), -exponent);
    unit_ = std::ldexp(S(1), exponent);
  }

  /// Where x is in body coordinates. The largest error of a component is 20 u times the largest
  /// component of the result, u = 2^-24: u from the difference (in S) and u from its conversion,
  /// each relative to |x - origin| scale; u for each of the three entries of R, three products and
  /// two sums, relative to the sum of |R_ki| |x_k - origin_k| scale <= sqrt(3) |x - origin| scale;
  /// and |x - origin| scale <= sqrt(3) times the largest component. See `kError`.
  Float4 toBodyFrame(const Point& x) const {
    return rows_[0] * float4::all(scaled(x[0] - origin_[0])) +
           rows_[1] * float4::all(scaled(x[1] - origin_[1])) +
           rows_[2] * float4::all(scaled(x[2] - origin_[2]));
  }
  /// Where a point in body coordinates is in the model's.
  Point fromBodyFrame(const Float4& y) const {
    return origin_ +
           (axes_ * fcl::Vector3d(double(y[0]), double(y[1]), double(y[2]))).template cast<S>() *
               unit_;
  }
  /// Bounds that error as a share of the largest component in the body: 2^-19 > 20 u.
  static constexpr float kError = 1.f / (1 << 19);

  const fcl::Matrix3d& axes() const { return axes_; }
  const Point& origin() const { return origin_; }
  /// Body units per unit of the mesh, a power of two: products with it are exact.
  S scale() const { return scale_; }

  /// The mesh's units per body unit: the inverse of `scale`, as exact.
  S unit() const { return unit_; }

  void moveOrigin(const Point& origin) { origin_ = origin; }
  /// `axes`: from `orthonormal`.
  void turn(const fcl::Matrix3d& axes) {
    axes_ = axes;
    for (int k = 0; k < 3; ++k)
      rows_[k] = Float4{float(axes_(k, 0)), float(axes_(k, 1)), float(axes_(k, 2)), 0};
  }

 private:
  float scaled(S difference) const { return static_cast<float>(difference * scale_); }

  fcl::Matrix3d axes_;
  Float4 rows_[3];  // of R, which are the columns of R^T
  Point origin_;
  S scale_, unit_;
};

}  // namespace adaptive_bvh
