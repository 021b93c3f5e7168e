#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "triangles/orientation.h"
#include "triangles/triangle_contact.h"

namespace adaptive_bvh {

/// Intersects a ray with triangles. Whether the ray hits the triangle, one of its sides or corners,
/// and whether the hit is behind the origin, is decided exactly for the given numbers, so the ray
/// passes no gap between neighbours. Nearly always the signs of areas decide, of the triangle
/// sheared so that the ray becomes an axis (Woop, Benthin, Wald 2013, "Watertight ray/triangle
/// intersection"); where their error bounds leave a sign open, sums of exact products decide.
/// docs/bounds.md, 16.
class RayTriangle {
 public:
  /// The hit is at origin + t direction = (1 - u - v) a + u b + v c.
  struct Hit {
    /// At least 0, never -0, and 0 only if the origin is in the triangle's plane; infinite if it
    /// exceeds the largest double.
    double t;
    double u, v;
    bool is_front;      ///< the ray sees the corners counter-clockwise
    bool is_on_a_side;  ///< on a side or a corner
  };

  RayTriangle(const fcl::Vector3d& origin, const fcl::Vector3d& direction)
      : RayTriangle(direction) {
    setOrigin(origin);
  }
  /// A ray without an origin; call setOrigin.
  explicit RayTriangle(const fcl::Vector3d& direction) : direction_(direction) {
    // z is the axis of the longest component of the direction; x and y are exchanged if the ray
    // runs against it. Without branches, because they would be mispredicted.
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

  /// Returns whether the ray hits the triangle at t >= 0, and describes the hit. False if the ray
  /// lies in the triangle's plane. If the origin is in the triangle's plane, the hit is at t = 0.
  bool meets(const fcl::Vector3d& a, const fcl::Vector3d& b, const fcl::Vector3d& c,
             Hit& hit) const {
    const Sheared p = sheared(a), q = sheared(b), r = sheared(c);
    const double u = area(r, q), v = area(p, r), w = area(q, p);
    const double size = std::max(std::max(p.size, q.size), r.size);
    const double width = std::max(std::max(p.width(), q.width()), r.width());
    const double error = kAreaError * size * width;
    const auto decideExactly = [&]() -> bool { return meetsExactly({a, b, c}, hit); };
    if (!isInRange(size, width)) return decideExactly();
    // The ray is the z axis: it hits the triangle if the areas between the axis and the three sides
    // have one sign. Their shares in the sum are the barycentric coordinates.
    const double low = std::min(std::min(u, v), w), high = std::max(std::max(u, v), w);
    if (low < -error && high > error) return false;
    const double volume = u * p.z + v * q.z + w * r.z, sum = u + v + w;
    const double least = sum > 0 ? low : -high;  // the smallest area, with the sign of the sum
    const bool is_certain = least > error && std::fabs(sum) > kAccurate * error &&
                            std::fabs(volume) > kVolumeError * size * size * width;
    if (!is_certain) return decideExactly();
    const double depth = volume / sum * per_depth_;
    if (depth < 0) return false;
    const double t = exponent_ == 0 ? depth : atLeastTiny(std::ldexp(depth, -exponent_));
    hit = {t, v / sum, w / sum, sum > 0, false};
    return true;
  }

 private:
  /// A corner relative to the origin, sheared so that the ray is the z axis.
  struct Sheared {
    double x, y, z;
    double size;  ///< the largest absolute component before shearing

    double width() const { return std::max(std::fabs(x), std::fabs(y)); }
  };
  Sheared sheared(const fcl::Vector3d& corner) const {
    const auto from_origin = [&](int k) { return static_cast<double>(corner[k]) - origin_[k]; };
    const double x = from_origin(x_), y = from_origin(y_), z = from_origin(z_);
    return {x - shear_x_ * z, y - shear_y_ * z, z,
            std::max(std::max(std::fabs(x), std::fabs(y)), std::fabs(z))};
  }
  /// Twice the signed area of the triangle of the ray, a and b, projected along the ray.
  static double area(const Sheared& a, const Sheared& b) { return a.x * b.y - a.y * b.x; }

  /// Error bounds, with the unit roundoff u = 2^-53. Let the components of the corners relative to
  /// the origin be at most m, and the sheared components x and y at most s <= 2 m. The sheared
  /// components have an error of at most 7 u m, an area, at most 2 s^2, one of 36 u m s, and the
  /// volume one of 160 u m^2 s.
  static constexpr double kAreaError = 0x1p-47, kVolumeError = 0x1p-45;
  /// If the sum of the areas exceeds its error by this factor, barycentric coordinates and t have
  /// nine correct digits, also at grazing angles.
  static constexpr double kAccurate = 0x1p32;
  /// Whether nothing overflows, or underflows by more than the error bounds allow for.
  static bool isInRange(double size, double width) {
    return size < 0x1p300 && width > size * 0x1p-100 && width > 0x1p-300 &&
           isTaken(Shortcut::RoundedPredicates);
  }

  /// Replaces a 0 that results from underflow by the smallest positive number.
  static double atLeastTiny(double t) {
    return std::max(t, std::numeric_limits<double>::denorm_min());
  }

  using Corners = std::array<fcl::Vector3d, 3>;

  /// Adds det(direction, b - origin, c - origin). It is positive if the ray passes to the left of
  /// the side from b to c, looking against the ray.
  void addSide(ExactSum& sum, const fcl::Vector3d& b, const fcl::Vector3d& c) const {
    addDeterminant(sum, direction_, b, c);
    addDeterminant(sum, direction_, b, origin_, true);
    addDeterminant(sum, direction_, origin_, c, true);
  }

  /// `meets`, by exact sums. Side k is opposite to corner k; `all` is the sum of the three sides.
  bool meetsExactly(const Corners& corners, Hit& hit) const {
    countExact(ExactDecision::RayTriangle);
    ExactSum sides[3], all;
    bool is_left = false, is_right = false, is_on_a_side = false;
    for (std::size_t k = 0; k < 3; ++k) {
      const fcl::Vector3d &b = corners[(k + 1) % 3], &c = corners[(k + 2) % 3];
      addSide(sides[k], b, c);
      addSide(all, b, c);
      const int sign = sides[k].sign();
      is_left = is_left || sign > 0;
      is_right = is_right || sign < 0;
      is_on_a_side = is_on_a_side || sign == 0;
    }
    if (is_left == is_right) return false;  // outside, or the ray lies in the plane
    ExactSum volume;                        // det(a - origin, b - origin, c - origin)
    addOrientation(volume, corners[0], corners[1], corners[2], origin_);
    if (volume.sign() * all.sign() < 0) return false;
    const ExactSum::Scaled sum = all.value();
    const double t = volume.sign() == 0 ? 0 : atLeastTiny(volume.value() / sum);
    hit = {t, sides[1].value() / sum, sides[2].value() / sum, !is_left, is_on_a_side};
    return true;
  }

  fcl::Vector3d origin_ = fcl::Vector3d::Zero(), direction_;
  int x_, y_, z_;             ///< which coordinates are x, y and z of Sheared
  int exponent_;              ///< a very long or short direction is divided by 2^exponent_; else 0
  double shear_x_, shear_y_;  ///< x and y of the direction, divided by its z
  double per_depth_;          ///< t for each unit of z, for the scaled direction
};

}  // namespace adaptive_bvh
