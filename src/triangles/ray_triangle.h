#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "triangles/orientation.h"
#include "triangles/triangle_contact.h"

namespace adaptive_bvh {

/// A ray and a triangle. Whether the ray meets the triangle, its sides, its corners, and whether
/// that is behind the origin, is decided without any error, for the numbers as they are given. So
/// neighbours leave no gap. Almost always by the signs of areas of the triangle sheared such that
/// the ray is an axis (Woop, Benthin, Wald 2013, "Watertight ray/triangle intersection"); where
/// their error bounds leave a sign open, by sums of exact products. docs/bounds.md, 16.
class RayTriangle {
 public:
  struct Hit {
    /// >= 0, never -0, and 0 only where the origin is in the triangle's plane; infinite where it is
    /// larger than any double.
    double t;
    double u, v;
    bool is_front;      ///< seen counter-clockwise
    bool is_on_a_side;  ///< or on a corner
  };

  RayTriangle(const fcl::Vector3d& origin, const fcl::Vector3d& direction)
      : RayTriangle(direction) {
    setOrigin(origin);
  }
  /// From where setOrigin says.
  explicit RayTriangle(const fcl::Vector3d& direction) : direction_(direction) {
    direction.cwiseAbs().maxCoeff(&z_);
    x_ = (z_ + 1) % 3;
    y_ = (z_ + 2) % 3;
    if (direction[z_] < 0) std::swap(x_, y_);
    exponent_ = std::ilogb(direction[z_]);
    const auto scaled = [&](int k) { return std::ldexp(direction[k], -exponent_); };
    per_depth_ = 1 / scaled(z_);
    shear_x_ = scaled(x_) / scaled(z_);
    shear_y_ = scaled(y_) / scaled(z_);
  }

  void setOrigin(const fcl::Vector3d& origin) { origin_ = origin; }

  /// False when the ray, from its origin on, does not meet the triangle, or lies in its plane. An
  /// origin in the triangle's plane is met at t = 0.
  bool meets(const fcl::Vector3d& a, const fcl::Vector3d& b, const fcl::Vector3d& c,
             Hit& hit) const {
    const Sheared p = sheared(a), q = sheared(b), r = sheared(c);
    const double u = area(r, q), v = area(p, r), w = area(q, p);
    const double size = std::max(std::max(p.size, q.size), r.size);
    const double width = std::max(std::max(p.width(), q.width()), r.width());
    const double error = kAreaError * size * width;
    if (!isInRange(size, width)) return meetsExactly({a, b, c}, hit);
    if ((u < -error || v < -error || w < -error) && (u > error || v > error || w > error))
      return false;
    const double volume = u * p.z + v * q.z + w * r.z, sum = u + v + w;
    const double least = sum > 0 ? std::min(std::min(u, v), w) : -std::max(std::max(u, v), w);
    const bool is_certain = least > error && std::fabs(sum) > kAccurate * error &&
                            std::fabs(volume) > kVolumeError * size * size * width;
    if (!is_certain) return meetsExactly({a, b, c}, hit);
    const double depth = volume / sum * per_depth_;
    if (depth < 0) return false;
    hit = {std::ldexp(depth, -exponent_), v / sum, w / sum, sum > 0, false};
    return true;
  }

 private:
  struct Sheared {
    double x, y, z;
    double size;  ///< the largest component before it was sheared

    double width() const { return std::max(std::fabs(x), std::fabs(y)); }
  };
  Sheared sheared(const fcl::Vector3d& corner) const {
    const fcl::Vector3d d = corner - origin_;
    return {d[x_] - shear_x_ * d[z_], d[y_] - shear_y_ * d[z_], d[z_],
            d.template lpNorm<Eigen::Infinity>()};
  }
  static double area(const Sheared& a, const Sheared& b) { return a.x * b.y - a.y * b.x; }

  /// With the unit roundoff u = 2^-53, corners seen from the origin of at most m in each component,
  /// and sheared components x and y of at most s <= 2 m: these are off by 7 u m, an area, at most
  /// 2 s^2, by 36 u m s, and the volume by 160 u m^2 s.
  static constexpr double kAreaError = 0x1p-47, kVolumeError = 0x1p-45;
  /// Areas whose sum is larger than their error by this have barycentric coordinates to six digits.
  static constexpr double kAccurate = 0x1p20;
  /// Nothing overflows, nor underflows by more than the errors cover.
  static bool isInRange(double size, double width) {
    return size < 0x1p300 && width > size * 0x1p-100 && width > 0x1p-300;
  }

  using Corners = std::array<fcl::Vector3d, 3>;

  /// Adds det(direction, b - origin, c - origin): positive where the ray passes the side from b to
  /// c on its left, seen against the ray.
  void addSide(ExactSum& sum, const fcl::Vector3d& b, const fcl::Vector3d& c) const {
    addDeterminant(sum, direction_, b, c);
    addDeterminant(sum, direction_, b, origin_, true);
    addDeterminant(sum, direction_, origin_, c, true);
  }

  bool meetsExactly(const Corners& t, Hit& hit) const {
    ExactSum sides[3], all;
    bool is_left = false, is_right = false, is_on_a_side = false;
    for (std::size_t k = 0; k < 3; ++k) {
      const fcl::Vector3d &b = t[(k + 1) % 3], &c = t[(k + 2) % 3];
      addSide(sides[k], b, c);
      addSide(all, b, c);
      const int sign = sides[k].sign();
      is_left = is_left || sign > 0;
      is_right = is_right || sign < 0;
      is_on_a_side = is_on_a_side || sign == 0;
    }
    if (is_left == is_right) return false;  // outside, or the ray lies in the plane
    ExactSum volume;                        // det(a - origin, b - origin, c - origin)
    addOrientation(volume, t[0], t[1], t[2], origin_);
    if (volume.sign() * all.sign() < 0) return false;
    const ExactSum::Scaled sum = all.value();
    double along = volume.value() / sum;
    if (along == 0 && volume.sign() != 0) along = std::numeric_limits<double>::denorm_min();
    hit = {along, sides[1].value() / sum, sides[2].value() / sum, !is_left, is_on_a_side};
    return true;
  }

  fcl::Vector3d origin_ = fcl::Vector3d::Zero(), direction_;
  int x_, y_, z_;
  int exponent_;  ///< of the direction's largest component, which is scaled to 1 to 2
  double shear_x_, shear_y_, per_depth_;
};

}  // namespace adaptive_bvh
