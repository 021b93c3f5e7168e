#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

#include <fcl/common/types.h>

namespace adaptive_bvh {

/// A sum of products of three doubles, without any rounding, overflow or underflow: two long fixed-
/// point numbers, of what was added and subtracted, that hold the lowest bit of the smallest
/// product and the highest of the largest (U. Kulisch, "Computer Arithmetic and Validity", 2013: a
/// long accumulator). For the few decisions that an error bound leaves open.
class ExactSum {
 public:
  /// A number whose exponent may be out of the range of a double: mantissa * 2^exponent. The
  /// mantissa is 0 or from 0.5 to 1, with a sign.
  struct Scaled {
    double mantissa;
    int exponent;

    /// The quotient with a relative error of 2^-50; infinite or 0 where it is out of range.
    friend double operator/(const Scaled& a, const Scaled& b) {
      if (a.mantissa == 0) return 0;
      return std::ldexp(a.mantissa / b.mantissa, a.exponent - b.exponent);
    }
  };

  /// Adds a * b * c.
  void add(double a, double b, double c) { addProduct(a, b, c, false); }
  /// Subtracts a * b * c.
  void subtract(double a, double b, double c) { addProduct(a, b, c, true); }

  /// -1, 0 or 1.
  int sign() const {
    for (std::size_t k = last_; k-- > first_;)
      if (added_[k] != subtracted_[k]) return added_[k] > subtracted_[k] ? 1 : -1;
    return 0;
  }

  /// The sum with a relative error of at most 2^-52.
  Scaled value() const {
    const int its_sign = sign();
    if (its_sign == 0) return {0, 0};
    const Limbs difference =
        its_sign > 0 ? differenceOf(added_, subtracted_) : differenceOf(subtracted_, added_);
    std::size_t top = last_;
    while (difference[top - 1] == 0) --top;
    // Three limbs hold more than 128 bits from the highest one on.
    const std::size_t lowest = top < 3 ? 0 : top - 3;
    double sum = 0;
    for (std::size_t k = top; k-- > lowest;)
      sum = sum * 0x1p64 + static_cast<double>(difference[k]);
    int exponent;
    const double mantissa = std::frexp(its_sign * sum, &exponent);
    return {mantissa, exponent + 64 * static_cast<int>(lowest) - kPoint};
  }

 private:
  // A product's lowest bit is 2^(3 * -1074) or higher; 2^64 of the largest, 2^3072, stay in range.
  static constexpr int kPoint = 3 * 1074;
  static constexpr std::size_t kLimbs = (kPoint + 3 * 1024 + 64) / 64 + 1;
  __extension__ typedef unsigned __int128 Wide;

  /// The lowest limb first.
  using Limbs = std::array<std::uint64_t, kLimbs>;

  /// The first number is the larger one.
  Limbs differenceOf(const Limbs& more, const Limbs& less) const {
    Limbs difference{};
    std::uint64_t borrow = 0;
    for (std::size_t k = first_; k < last_; ++k) {
      const Wide limb = Wide(more[k]) - less[k] - borrow;
      difference[k] = static_cast<std::uint64_t>(limb);
      borrow = static_cast<std::uint64_t>(limb >> 64) & 1;
    }
    return difference;
  }

  /// |x| = whole * 2^exponent, the exponent at least -1074.
  static std::uint64_t wholeOf(double x, int& exponent) {
    constexpr int kFraction = 52, kBias = 1075, kExponents = 0x7ff;
    std::uint64_t bits;
    std::memcpy(&bits, &x, sizeof(bits));
    const int stored = static_cast<int>(bits >> kFraction) & kExponents;
    const std::uint64_t one = std::uint64_t(1) << kFraction, fraction = bits & (one - 1);
    exponent = (stored == 0 ? 1 : stored) - kBias;
    return stored == 0 ? fraction : fraction | one;
  }

  void addProduct(double a, double b, double c, bool is_negative) {
    if (a == 0 || b == 0 || c == 0) return;
    int ea, eb, ec;
    const std::uint64_t x = wholeOf(a, ea), y = wholeOf(b, eb), z = wholeOf(c, ec);
    is_negative ^= std::signbit(a) ^ std::signbit(b) ^ std::signbit(c);
    // x * y * z, of 159 bits, as three limbs; shifted, as four.
    const Wide xy = Wide(x) * y, low = Wide(static_cast<std::uint64_t>(xy)) * z,
               high = (xy >> 64) * z + (low >> 64);
    std::array<std::uint64_t, 4> limbs = {static_cast<std::uint64_t>(low),
                                          static_cast<std::uint64_t>(high),
                                          static_cast<std::uint64_t>(high >> 64), 0};
    const int at = ea + eb + ec + kPoint, shift = at % 64;
    if (shift > 0) {
      for (std::size_t k = 3; k > 0; --k)
        limbs[k] = limbs[k] << shift | limbs[k - 1] >> (64 - shift);
      limbs[0] <<= shift;
    }
    accumulate(limbs, static_cast<std::size_t>(at / 64), is_negative ? subtracted_ : added_);
  }

  void accumulate(const std::array<std::uint64_t, 4>& limbs, std::size_t at, Limbs& sum) {
    std::uint64_t carry = 0;
    std::size_t k = at;
    for (; k < at + limbs.size() || carry != 0; ++k) {
      const Wide result = Wide(sum[k]) + (k < at + limbs.size() ? limbs[k - at] : 0) + carry;
      sum[k] = static_cast<std::uint64_t>(result);
      carry = static_cast<std::uint64_t>(result >> 64);
    }
    first_ = std::min(first_, at);
    last_ = std::max(last_, k);
  }

  // Apart, so that no sum changes its sign, which would change all limbs above.
  Limbs added_{}, subtracted_{};
  std::size_t first_ = kLimbs, last_ = 0;  ///< the limbs of either that are not 0
};

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

/// The sign of the determinant, if a rounded determinant did not decide it.
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
