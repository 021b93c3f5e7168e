#pragma once

#include <array>
#include <cmath>
#include <limits>

#include <fcl/common/types.h>

#include "geometry/exact_sum.h"

namespace adaptive_bvh {

/// Adds det(a, b, c) to a sum, or subtracts it.
inline void addDeterminant(ExactSum& sum, const fcl::Vector3d& a, const fcl::Vector3d& b,
                           const fcl::Vector3d& c, bool is_negative = false) {
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    is_negative ? sum.subtract(a[k], b[i], c[j]) : sum.add(a[k], b[i], c[j]);
    is_negative ? sum.add(a[k], b[j], c[i]) : sum.subtract(a[k], b[j], c[i]);
  }
}

/// Adds det(a - d, b - d, c - d).
inline void addOrientation(ExactSum& sum, const fcl::Vector3d& a, const fcl::Vector3d& b,
                           const fcl::Vector3d& c, const fcl::Vector3d& d) {
  addDeterminant(sum, a, b, c);
  addDeterminant(sum, d, b, c, true);
  addDeterminant(sum, a, d, c, true);
  addDeterminant(sum, a, b, d, true);
}

namespace orientations {

/// Whether x - y is a double. If so, the rest of the rounded difference is 0 (Knuth's TwoSum).
inline bool isExact(double x, double y, double difference) {
  const double other = x - difference;
  return (x - (difference + other)) + (other - y) == 0;
}
inline bool isExact(const fcl::Vector3d& x, const fcl::Vector3d& y, const fcl::Vector3d& z) {
  return isExact(x[0], y[0], z[0]) && isExact(x[1], y[1], z[1]) && isExact(x[2], y[2], z[2]);
}

/// Whether a determinant of three differences has the sign that was computed. `size`: the product
/// of the largest components of the three. With the unit roundoff u = 2^-53 each of the six
/// products is off by 5 u times that, and their sum by 20 u more: 50 u.
inline bool isCertain(double determinant, double size) {
  return size > 0x1p-800 && size < 0x1p1000 && std::fabs(determinant) > 0x1p-47 * size;
}

/// det(a - d, b - d, c - d) without any error, of rounded differences p, q and r.
inline ExactSum exactly(const fcl::Vector3d& a, const fcl::Vector3d& b, const fcl::Vector3d& c,
                        const fcl::Vector3d& d, const fcl::Vector3d& p, const fcl::Vector3d& q,
                        const fcl::Vector3d& r) {
  ExactSum sum;
  if (isExact(a, d, p) && isExact(b, d, q) && isExact(c, d, r))
    addDeterminant(sum, p, q, r);  // as for coordinates of few digits
  else
    addOrientation(sum, a, b, c, d);
  return sum;
}

/// Whether three vectors lie in a plane across an axis.
inline bool areAcrossAxis(const fcl::Vector3d& p, const fcl::Vector3d& q, const fcl::Vector3d& r) {
  for (int k = 0; k < 3; ++k)
    if (p[k] == 0 && q[k] == 0 && r[k] == 0) return true;
  return false;
}

}  // namespace orientations

/// On which side of the plane of a, b and c a point d lies, the sign of det(a - d, b - d, c - d):
/// without any error for the numbers as they are given (the sign of "orient3d" of Shewchuk 1997,
/// "Adaptive precision floating-point arithmetic and fast robust geometric predicates"). The value
/// is that determinant up to its rounding; it is 0 only where the determinant is.
inline double orientation(const fcl::Vector3d& a, const fcl::Vector3d& b, const fcl::Vector3d& c,
                          const fcl::Vector3d& d) {
  using namespace orientations;
  const fcl::Vector3d p = a - d, q = b - d, r = c - d;
  const double determinant = p.dot(q.cross(r));
  const double size = p.template lpNorm<Eigen::Infinity>() * q.template lpNorm<Eigen::Infinity>() *
                      r.template lpNorm<Eigen::Infinity>();
  if (isCertain(determinant, size)) return determinant;
  if (areAcrossAxis(p, q, r)) return 0;
  const ExactSum::Scaled exact = exactly(a, b, c, d, p, q, r).value();
  if (exact.mantissa == 0) return 0;
  const double value = std::ldexp(exact.mantissa, exact.exponent);
  if (value == 0) return std::copysign(std::numeric_limits<double>::denorm_min(), exact.mantissa);
  return std::fabs(value) <= std::numeric_limits<double>::max()
             ? value
             : std::copysign(std::numeric_limits<double>::max(), value);
}

/// Only its sign, where a rounded determinant did not tell.
inline int exactOrientation(const fcl::Vector3d& a, const fcl::Vector3d& b, const fcl::Vector3d& c,
                            const fcl::Vector3d& d) {
  const fcl::Vector3d p = a - d, q = b - d, r = c - d;
  if (orientations::areAcrossAxis(p, q, r)) return 0;
  return orientations::exactly(a, b, c, d, p, q, r).sign();
}

/// The sign of det(p - r, q - r) of points in a plane, without any error: 1 where they are counter-
/// clockwise, 0 where they are on one line. Each product is off by 3 u of itself, their difference
/// by u of both: 4 u in all ("orient2d" of Shewchuk 1997).
inline int planarOrientation(double px, double py, double qx, double qy, double rx, double ry) {
  const double left = (px - rx) * (qy - ry), right = (py - ry) * (qx - rx);
  const double determinant = left - right, size = std::fabs(left) + std::fabs(right);
  const bool is_in_range = size > 0x1p-900 && size < 0x1p1000;
  if (is_in_range && std::fabs(determinant) > 0x1p-50 * size) return determinant > 0 ? 1 : -1;
  ExactSum sum;
  sum.add(px, qy, 1);
  sum.subtract(px, ry, 1);
  sum.subtract(rx, qy, 1);
  sum.subtract(py, qx, 1);
  sum.add(py, rx, 1);
  sum.add(ry, qx, 1);
  return sum.sign();
}

/// Whether three points are all on one side of a plane, and none in it, by their heights or
/// orientations.
inline bool areOnOneSide(const std::array<double, 3>& sides) {
  return (sides[0] > 0 && sides[1] > 0 && sides[2] > 0) ||
         (sides[0] < 0 && sides[1] < 0 && sides[2] < 0);
}

}  // namespace adaptive_bvh
