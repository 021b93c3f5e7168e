#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

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
    // Without branches, which would be guesses.
    constexpr int kAxes[] = {0, 1, 2, 0, 1};
    const double x = std::fabs(direction[0]), y = std::fabs(direction[1]),
                 z = std::fabs(direction[2]);
    z_ = z > std::max(x, y) ? 2 : static_cast<int>(y > x);
    const int is_backward = direction[z_] < 0;
    x_ = kAxes[z_ + 1 + is_backward];
    y_ = kAxes[z_ + 2 - is_backward];
    const double longest = std::fabs(direction[z_]);
    const bool needs_scale = longest < 0x1p-500 || longest > 0x1p500;
    exponent_ = needs_scale ? std::ilogb(longest) : 0;
    const auto scaled = [&](int k) -> double {
      return needs_scale ? std::ldexp(direction[k], -exponent_) : direction[k];
    };
    per_depth_ = 1 / scaled(z_);
    shear_x_ = scaled(x_) / scaled(z_);
    shear_y_ = scaled(y_) / scaled(z_);
  }

  void setOrigin(const fcl::Vector3d& origin) { origin_ = origin; }

  /// False when the ray, from its origin on, does not meet the triangle, or lies in its plane. An
  /// origin in the triangle's plane is met at t = 0.
  template <typename S>
  bool meets(const fcl::Vector3<S>& a, const fcl::Vector3<S>& b, const fcl::Vector3<S>& c,
             Hit& hit) const {
    const Sheared p = sheared(a), q = sheared(b), r = sheared(c);
    const double u = area(r, q), v = area(p, r), w = area(q, p);
    const double size = std::max(std::max(p.size, q.size), r.size);
    const double width = std::max(std::max(p.width(), q.width()), r.width());
    const double error = kAreaError * size * width;
    const auto exactly = [&]() -> bool {
      return meetsExactly(
          {a.template cast<double>(), b.template cast<double>(), c.template cast<double>()}, hit);
    };
    if (!isInRange(size, width)) return exactly();
    const double low = std::min(std::min(u, v), w), high = std::max(std::max(u, v), w);
    if (low < -error && high > error) return false;
    const double volume = u * p.z + v * q.z + w * r.z, sum = u + v + w;
    const double least = sum > 0 ? low : -high;
    const bool is_certain = least > error && std::fabs(sum) > kAccurate * error &&
                            std::fabs(volume) > kVolumeError * size * size * width;
    if (!is_certain) return exactly();
    const double depth = volume / sum * per_depth_;
    if (depth < 0) return false;
    const double t = exponent_ == 0 ? depth : atLeastTiny(std::ldexp(depth, -exponent_));
    hit = {t, v / sum, w / sum, sum > 0, false};
    return true;
  }

 private:
  struct Sheared {
    double x, y, z;
    double size;  ///< the largest component before it was sheared

    double width() const { return std::max(std::fabs(x), std::fabs(y)); }
  };
  template <typename S>
  Sheared sheared(const fcl::Vector3<S>& corner) const {
    const auto from_origin = [&](int k) { return static_cast<double>(corner[k]) - origin_[k]; };
    const double x = from_origin(x_), y = from_origin(y_), z = from_origin(z_);
    return {x - shear_x_ * z, y - shear_y_ * z, z,
            std::max(std::max(std::fabs(x), std::fabs(y)), std::fabs(z))};
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

  /// What is not 0 may have become 0.
  static double atLeastTiny(double t) {
    return std::max(t, std::numeric_limits<double>::denorm_min());
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
    const double along = volume.sign() == 0 ? 0 : atLeastTiny(volume.value() / sum);
    hit = {along, sides[1].value() / sum, sides[2].value() / sum, !is_left, is_on_a_side};
    return true;
  }

  fcl::Vector3d origin_ = fcl::Vector3d::Zero(), direction_;
  int x_, y_, z_;
  int exponent_;  ///< by which a very long or short direction is scaled; else 0
  double shear_x_, shear_y_, per_depth_;
};

}  // namespace adaptive_bvh
