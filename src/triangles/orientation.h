#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

#include <fcl/common/types.h>

#include "base/shortcut.h"

// Exact signs of determinants: on which side of a plane or a line a point lies.
namespace adaptive_bvh {

/// An exact sum of products of three doubles, without rounding, overflow or underflow. It consists
/// of two long fixed-point numbers, one for added and one for subtracted products, wide enough for
/// the lowest bit of the smallest product and the highest bit of the largest (a long accumulator:
/// U. Kulisch, "Computer Arithmetic and Validity", 2013). Used for the few decisions that an error
/// bound leaves open.
class ExactSum {
 public:
  /// A number mantissa * 2^exponent whose exponent may be out of the range of a double. The
  /// absolute value of the mantissa is 0 or from 0.5 to 1.
  struct Scaled {
    double mantissa;
    int exponent;

    /// The quotient, with a relative error of 2^-50; infinite or 0 if it is out of range.
    friend double operator/(const Scaled& a, const Scaled& b) {
      if (a.mantissa == 0) return 0;
      return std::ldexp(a.mantissa / b.mantissa, a.exponent - b.exponent);
    }
  };

  /// Adds a * b * c.
  void add(double a, double b, double c) { addProduct(a, b, c, false); }
  /// Subtracts a * b * c.
  void subtract(double a, double b, double c) { addProduct(a, b, c, true); }

  /// The sign of the sum: -1, 0 or 1.
  int sign() const {
    for (std::size_t k = last_; k-- > first_;)
      if (added_[k] != subtracted_[k]) return added_[k] > subtracted_[k] ? 1 : -1;
    return 0;
  }

  /// The sum with a relative error of at most 2^-52.
  Scaled value() const {
    const int sum_sign = sign();
    if (sum_sign == 0) return {0, 0};
    const Limbs difference =
        sum_sign > 0 ? differenceOf(added_, subtracted_) : differenceOf(subtracted_, added_);
    std::size_t top = last_;
    while (difference[top - 1] == 0) --top;
    // The three highest limbs contain more than 128 significant bits.
    const std::size_t lowest = top < 3 ? 0 : top - 3;
    double sum = 0;
    for (std::size_t k = top; k-- > lowest;)
      sum = sum * 0x1p64 + static_cast<double>(difference[k]);
    int exponent;
    const double mantissa = std::frexp(sum_sign * sum, &exponent);
    return {mantissa, exponent + 64 * static_cast<int>(lowest) - kPoint};
  }

 private:
  // The lowest bit of a product is 2^(3 * -1074) or higher; so bit 0 of limb 0 stands for
  // 2^-kPoint. There is room for 2^64 times the largest product, 2^3072.
  static constexpr int kPoint = 3 * 1074;
  static constexpr std::size_t kLimbs = (kPoint + 3 * 1024 + 64) / 64 + 1;
  __extension__ typedef unsigned __int128 Wide;

  /// A fixed-point number of 64-bit limbs, the lowest first.
  using Limbs = std::array<std::uint64_t, kLimbs>;

  /// The difference more - less, for more >= less.
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

  /// Decomposes |x| = integer * 2^exponent, exponent >= -1074. Returns the integer, below 2^53.
  static std::uint64_t integerOf(double x, int& exponent) {
    constexpr int kFraction = 52, kBias = 1075, kExponents = 0x7ff;  // the layout of a double
    std::uint64_t bits;
    std::memcpy(&bits, &x, sizeof(bits));
    const int stored = static_cast<int>(bits >> kFraction) & kExponents;  // 0: a denormal number
    const std::uint64_t one = std::uint64_t(1) << kFraction, fraction = bits & (one - 1);
    exponent = (stored == 0 ? 1 : stored) - kBias;
    return stored == 0 ? fraction : fraction | one;
  }

  void addProduct(double a, double b, double c, bool is_negative) {
    if (a == 0 || b == 0 || c == 0) return;
    int ea, eb, ec;
    const std::uint64_t x = integerOf(a, ea), y = integerOf(b, eb), z = integerOf(c, ec);
    is_negative ^= std::signbit(a) ^ std::signbit(b) ^ std::signbit(c);
    // x * y * z has 159 bits: three limbs, or four when shifted.
    const Wide xy = Wide(x) * y, low = Wide(static_cast<std::uint64_t>(xy)) * z,
               high = (xy >> 64) * z + (low >> 64);
    std::array<std::uint64_t, 4> limbs = {static_cast<std::uint64_t>(low),
                                          static_cast<std::uint64_t>(high),
                                          static_cast<std::uint64_t>(high >> 64), 0};
    const int lowest_bit = ea + eb + ec + kPoint, shift = lowest_bit % 64;
    if (shift > 0) {
      for (std::size_t k = 3; k > 0; --k)
        limbs[k] = limbs[k] << shift | limbs[k - 1] >> (64 - shift);
      limbs[0] <<= shift;
    }
    accumulate(limbs, std::size_t(lowest_bit / 64), is_negative ? subtracted_ : added_);
  }

  /// Adds four limbs to a sum, from limb `begin` on.
  void accumulate(const std::array<std::uint64_t, 4>& limbs, std::size_t begin, Limbs& sum) {
    std::uint64_t carry = 0;
    std::size_t k = begin;
    for (; k < begin + limbs.size() || carry != 0; ++k) {
      const Wide result = Wide(sum[k]) + (k < begin + limbs.size() ? limbs[k - begin] : 0) + carry;
      sum[k] = static_cast<std::uint64_t>(result);
      carry = static_cast<std::uint64_t>(result >> 64);
    }
    first_ = std::min(first_, begin);
    last_ = std::max(last_, k);
  }

  // Added and subtracted products are kept apart: a sum that changed its sign would change all
  // higher limbs.
  Limbs added_{}, subtracted_{};
  std::size_t first_ = kLimbs, last_ = 0;  ///< limbs outside of [first_, last_) are 0 in both
};

/// Adds det(a, b, c) to a sum, or subtracts it if `is_negative`.
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

/// Whether `difference`, the rounded x - y, is exact: its rounding error by Knuth's TwoSum is 0.
inline bool isExact(double x, double y, double difference) {
  const double other = x - difference;
  return (x - (difference + other)) + (other - y) == 0;
}
/// The same for each component.
inline bool isExact(const fcl::Vector3d& x, const fcl::Vector3d& y, const fcl::Vector3d& d) {
  return isExact(x[0], y[0], d[0]) && isExact(x[1], y[1], d[1]) && isExact(x[2], y[2], d[2]);
}

/// Whether all components of three vectors are multiples of a power of two g and below 2^16 g. Then
/// their determinant is computed without rounding: all terms are multiples of g^3 below 2^53 g^3.
inline bool areShort(const fcl::Vector3d& p, const fcl::Vector3d& q, const fcl::Vector3d& r) {
  const double size = std::max(
      {p.lpNorm<Eigen::Infinity>(), q.lpNorm<Eigen::Infinity>(), r.lpNorm<Eigen::Infinity>()});
  if (!(size > 0x1p-300 && size < 0x1p300)) return false;
  const double rounds = std::ldexp(1.5, std::ilogb(size) + 37);  // sums are rounded to g
  const auto isShort = [&](const fcl::Vector3d& v) -> bool {
    return ((v.array() + rounds) - rounds == v.array()).all();
  };
  return isShort(p) && isShort(q) && isShort(r);
}

/// Whether a rounded determinant of three differences certainly has the correct sign. `size` is the
/// product of the largest components of the three differences. With the unit roundoff u = 2^-53,
/// the error of each of the six products is at most 5 u size, and the sum adds 20 u size: 50 u size
/// in total, less than 2^-47 size.
inline bool isCertain(double determinant, double size) {
  return size > 0x1p-800 && size < 0x1p1000 && std::fabs(determinant) > 0x1p-47 * size &&
         isTaken(Shortcut::RoundedPredicates);
}

/// The exact det(a - d, b - d, c - d). p, q and r are the rounded differences.
inline ExactSum exactDeterminant(const fcl::Vector3d& a, const fcl::Vector3d& b,
                                 const fcl::Vector3d& c, const fcl::Vector3d& d,
                                 const fcl::Vector3d& p, const fcl::Vector3d& q,
                                 const fcl::Vector3d& r) {
  ExactSum sum;
  if (isExact(a, d, p) && isExact(b, d, q) && isExact(c, d, r)) {
    if (areShort(p, q, r))  // coordinates with few digits
      sum.add(p.dot(q.cross(r)), 1, 1);
    else
      addDeterminant(sum, p, q, r);
  } else {
    addOrientation(sum, a, b, c, d);
  }
  return sum;
}

/// Whether three vectors lie in a plane perpendicular to a coordinate axis.
inline bool areAcrossAxis(const fcl::Vector3d& p, const fcl::Vector3d& q, const fcl::Vector3d& r) {
  for (int k = 0; k < 3; ++k)
    if (p[k] == 0 && q[k] == 0 && r[k] == 0) return true;
  return false;
}

/// Whether two of four points are equal: with a triangle that is a segment, or a common corner.
inline bool areTwoEqual(const fcl::Vector3d& a, const fcl::Vector3d& b, const fcl::Vector3d& c,
                        const fcl::Vector3d& d) {
  return a == b || a == c || a == d || b == c || b == d || c == d;
}

}  // namespace orientations

/// The side of the plane of a, b and c on which d lies: a number whose sign is that of det(a - d, b
/// - d, c - d), exact for the given numbers (like "orient3d" of Shewchuk 1997, "Adaptive precision
/// floating-point arithmetic and fast robust geometric predicates"). The value is the determinant
/// up to rounding, clamped to the range of a double; it is 0 only if the determinant is.
inline double orientation(const fcl::Vector3d& a, const fcl::Vector3d& b, const fcl::Vector3d& c,
                          const fcl::Vector3d& d) {
  using namespace orientations;
  const fcl::Vector3d p = a - d, q = b - d, r = c - d;
  const double determinant = p.dot(q.cross(r));
  const double size =
      p.lpNorm<Eigen::Infinity>() * q.lpNorm<Eigen::Infinity>() * r.lpNorm<Eigen::Infinity>();
  if (isCertain(determinant, size)) return determinant;
  if (areAcrossAxis(p, q, r) || areTwoEqual(a, b, c, d)) return 0;
  countExact(ExactDecision::Orientation);
  const ExactSum::Scaled exact = exactDeterminant(a, b, c, d, p, q, r).value();
  if (exact.mantissa == 0) return 0;
  const double value = std::ldexp(exact.mantissa, exact.exponent);
  if (value == 0) return std::copysign(std::numeric_limits<double>::denorm_min(), exact.mantissa);
  return std::fabs(value) <= std::numeric_limits<double>::max()
             ? value
             : std::copysign(std::numeric_limits<double>::max(), value);
}

/// The exact sign of orientation(a, b, c, d), if the rounded determinant is not certain.
inline int exactOrientation(const fcl::Vector3d& a, const fcl::Vector3d& b, const fcl::Vector3d& c,
                            const fcl::Vector3d& d) {
  const fcl::Vector3d p = a - d, q = b - d, r = c - d;
  if (orientations::areAcrossAxis(p, q, r) || orientations::areTwoEqual(a, b, c, d)) return 0;
  countExact(ExactDecision::TriangleSides);
  return orientations::exactDeterminant(a, b, c, d, p, q, r).sign();
}

namespace orientations {

/// The sign of left - right, the determinant of two differences of points in the plane each, or 0
/// if rounding could change it. The relative error of each product is 3 u, and their difference
/// adds u of both: 4 u of `size` in total, less than 2^-50.
inline int certainSign(double left, double right) {
  const double determinant = left - right, size = std::fabs(left) + std::fabs(right);
  const bool is_certain = size > 0x1p-900 && size < 0x1p1000 &&
                          std::fabs(determinant) > 0x1p-50 * size &&
                          isTaken(Shortcut::RoundedPredicates);
  return is_certain ? (determinant > 0) - (determinant < 0) : 0;
}

}  // namespace orientations

/// The exact sign of det(p - r, q - r) for points in the plane: 1 if p, q, r are counter-clockwise,
/// 0 if they are collinear, else -1 ("orient2d" of Shewchuk 1997).
inline int planarOrientation(double px, double py, double qx, double qy, double rx, double ry) {
  const int sign = orientations::certainSign((px - rx) * (qy - ry), (py - ry) * (qx - rx));
  if (sign != 0) return sign;
  countExact(ExactDecision::PlanarOrientation);
  ExactSum sum;  // the products of the expanded determinant; rx ry cancels
  sum.add(px, qy, 1);
  sum.subtract(px, ry, 1);
  sum.subtract(rx, qy, 1);
  sum.subtract(py, qx, 1);
  sum.add(py, rx, 1);
  sum.add(ry, qx, 1);
  return sum.sign();
}

/// Whether three points lie exactly on a line.
inline bool areOnALine(const fcl::Vector3d& p, const fcl::Vector3d& q, const fcl::Vector3d& r) {
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    if (planarOrientation(p[i], p[j], q[i], q[j], r[i], r[j]) != 0) return false;
  }
  return true;
}

/// Whether three points lie strictly on the same side of a plane, given their heights or
/// orientations.
inline bool areOnOneSide(const std::array<double, 3>& sides) {
  return (sides[0] > 0 && sides[1] > 0 && sides[2] > 0) ||
         (sides[0] < 0 && sides[1] < 0 && sides[2] < 0);
}

}  // namespace adaptive_bvh
