#pragma once

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

/// On which side of the plane of a, b and c a point d lies, the sign of det(a - d, b - d, c - d):
/// without any error for the numbers as they are given (the sign of "orient3d" of Shewchuk 1997,
/// "Adaptive precision floating-point arithmetic and fast robust geometric predicates"). The value
/// is that determinant up to its rounding; it is 0 only where the determinant is.
///
/// With the unit roundoff u = 2^-53 and m, n and p the largest components of the three differences,
/// each of the six products is off by 5 u m n p and their sum by 20 u m n p more: 50 u m n p.
inline double orientation(const fcl::Vector3d& a, const fcl::Vector3d& b, const fcl::Vector3d& c,
                          const fcl::Vector3d& d) {
  const fcl::Vector3d p = a - d, q = b - d, r = c - d;
  const double determinant = p.dot(q.cross(r));
  const double size = p.template lpNorm<Eigen::Infinity>() * q.template lpNorm<Eigen::Infinity>() *
                      r.template lpNorm<Eigen::Infinity>();
  const bool is_in_range = size > 0x1p-800 && size < 0x1p1000;
  if (is_in_range && std::fabs(determinant) > 0x1p-47 * size) return determinant;
  ExactSum sum;
  addOrientation(sum, a, b, c, d);
  const ExactSum::Scaled exact = sum.value();
  if (exact.mantissa == 0) return 0;
  const double value = std::ldexp(exact.mantissa, exact.exponent);
  if (value == 0) return std::copysign(std::numeric_limits<double>::denorm_min(), exact.mantissa);
  return std::fabs(value) <= std::numeric_limits<double>::max()
             ? value
             : std::copysign(std::numeric_limits<double>::max(), value);
}

}  // namespace adaptive_bvh
