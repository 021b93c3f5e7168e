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

/// A number in exact arithmetic, such as a sum of products of three doubles: sums, differences and
/// products without rounding, overflow or underflow. Used for the few decisions that an error bound
/// leaves open. A sign, and an integer of 64-bit limbs times a power of 2^64.
///
/// kLimbs suffices for products of three doubles, from 2^-3222 to 2^3072, and for those of six
/// lengths that differences of accepted coordinates have (rounding::largestCoordinate): bits from
/// 2^(6 * -1074) to 2^(6 * 255), 125 limbs. Each of six factors may begin with a limb of which one
/// bit counts, and a result takes up to 4 limbs more before it is trimmed.
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

  ExactSum(double x = 0) : is_negative_(x < 0) {  // NOLINT(google-explicit-constructor)
    if (x == 0) return;
    constexpr int kFraction = 52, kBias = 1075, kExponents = 0x7ff;  // the layout of a double
    std::uint64_t bits;
    std::memcpy(&bits, &x, sizeof(bits));
    const unsigned stored = unsigned(bits >> kFraction) & kExponents;  // 0: a denormal number
    const std::uint64_t one = std::uint64_t(1) << kFraction, fraction = bits & (one - 1);
    const unsigned lowest_bit = std::max(stored, 1u) + (64 * kOffset - kBias);
    const Wide integer = Wide(stored == 0 ? fraction : fraction | one) << (lowest_bit % 64);
    begin_ = int(lowest_bit / 64) - kOffset;
    set(1, Wide(set(0, integer)));
    size_ = 2;
    trim();
    if (limbs_[0] != 0) return;
    limbs_[0] = limbs_[1];
    ++begin_;
    size_ = 1;
  }
  ExactSum(const ExactSum& other) { *this = other; }
  ExactSum& operator=(const ExactSum& other) {
    begin_ = other.begin_;
    size_ = other.size_;
    is_negative_ = other.is_negative_;
    for (int k = 0; k < size_; ++k) limbs_[k] = other.limbs_[k];
    return *this;
  }

  friend ExactSum operator+(const ExactSum& a, const ExactSum& b) {
    return sum(a, b, b.is_negative_);
  }
  friend ExactSum operator-(const ExactSum& a, const ExactSum& b) {
    return sum(a, b, !b.is_negative_);
  }
  friend ExactSum operator*(const ExactSum& a, const ExactSum& b) {
    ExactSum product;
    product.is_negative_ = a.is_negative_ != b.is_negative_;
    product.begin_ = a.begin_ + b.begin_;
    product.size_ = a.size_ + b.size_;
    for (int k = 0; k < a.size_; ++k) product.limbs_[k] = 0;
    for (int j = 0; j < b.size_; ++j) {
      std::uint64_t carry = 0;
      for (int i = 0; i < a.size_; ++i)
        carry = product.set(i + j, Wide(a.limbs_[i]) * b.limbs_[j] + product.limbs_[i + j] + carry);
      product.limbs_[j + a.size_] = carry;
    }
    product.trim();
    return product;
  }
  friend bool operator<(const ExactSum& a, const ExactSum& b) { return (a - b).sign() < 0; }

  /// Adds a * b * c.
  void add(double a, double b, double c) { *this = *this + ExactSum(a) * b * c; }
  /// Subtracts a * b * c.
  void subtract(double a, double b, double c) { add(-a, b, c); }

  /// The sign of the sum: -1, 0 or 1.
  int sign() const { return size_ == 0 ? 0 : is_negative_ ? -1 : 1; }

  /// The sum with a relative error of at most 2^-52.
  Scaled value() const {
    // The three highest limbs contain more than 128 significant bits.
    const int lowest = std::max(size_ - 3, 0);
    double sum = 0;
    for (int k = size_; k-- > lowest;) sum = sum * 0x1p64 + static_cast<double>(limbs_[k]);
    int exponent;
    const double mantissa = std::frexp(is_negative_ ? -sum : sum, &exponent);
    return {mantissa, exponent + 64 * (begin_ + lowest)};
  }

 private:
  static constexpr int kLimbs = 144, kOffset = 17;
  __extension__ typedef unsigned __int128 Wide;

  /// The sum of a and b, where b gets the sign `is_negative`.
  static ExactSum sum(const ExactSum& a, const ExactSum& b, bool is_negative) {
    if (b.size_ == 0) return a;
    ExactSum result;
    const std::uint64_t flip = a.is_negative_ == is_negative ? 0 : ~std::uint64_t(0);
    result.is_negative_ = a.is_negative_;
    result.begin_ = a.size_ == 0 ? b.begin_ : std::min(a.begin_, b.begin_);
    result.size_ = std::max(a.end(), b.end()) - result.begin_ + 1;
    std::uint64_t carry = flip & 1;
    for (int k = 0; k < result.size_; ++k)
      carry = result.set(
          k, Wide(a.limb(result.begin_ + k)) + (b.limb(result.begin_ + k) ^ flip) + carry);
    if (flip && !carry) result.negate();
    result.trim();
    return result;
  }
  /// Turns the limbs, those of a negative number in two's complement, into its absolute value.
  void negate() {
    is_negative_ = !is_negative_;
    std::uint64_t carry = 1;
    for (int k = 0; k < size_; ++k) carry = set(k, Wide(~limbs_[k]) + carry);
  }
  int end() const { return size_ == 0 ? std::numeric_limits<int>::min() / 2 : begin_ + size_; }
  /// The limb of the weight 2^(64 k), which need not be stored.
  std::uint64_t limb(int k) const {
    return k >= begin_ && k < begin_ + size_ ? limbs_[k - begin_] : 0;
  }
  /// Sets a limb to the lower half of a number. Returns the higher half.
  std::uint64_t set(int k, Wide number) {
    limbs_[k] = static_cast<std::uint64_t>(number);
    return static_cast<std::uint64_t>(number >> 64);
  }
  /// Removes the highest limbs that are 0.
  void trim() {
    while (size_ > 0 && limbs_[size_ - 1] == 0) --size_;
  }

  std::uint64_t limbs_[kLimbs];  ///< `size_` of them, the lowest first; the highest is not 0
  int begin_ = 0, size_ = 0;     ///< the weight of the first is 2^(64 begin_)
  bool is_negative_ = false;
};

/// Adds det(a, b, c) to a sum, or subtracts it if `is_negative`.
inline void addDeterminant(ExactSum& sum, const fcl::Vector3d& a, const fcl::Vector3d& b,
                           const fcl::Vector3d& c, bool is_negative = false) {
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    const ExactSum minor = ExactSum(b[i]) * c[j] - ExactSum(b[j]) * c[i];
    sum = sum + ExactSum(is_negative ? -a[k] : a[k]) * minor;
  }
}

/// Adds det(a - d, b - d, c - d).
inline void addOrientation(ExactSum& sum, const fcl::Vector3d& a, const fcl::Vector3d& b,
                           const fcl::Vector3d& c, const fcl::Vector3d& d) {
  const auto from = [&](const fcl::Vector3d& x, int k) -> ExactSum {
    return ExactSum(x[k]) - d[k];
  };
  const ExactSum p[3] = {from(b, 0), from(b, 1), from(b, 2)},
                 q[3] = {from(c, 0), from(c, 1), from(c, 2)};
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    sum = sum + from(a, k) * (p[i] * q[j] - p[j] * q[i]);
  }
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
    if (areShort(p, q, r)) return p.dot(q.cross(r));  // coordinates with few digits
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
  const double size = p.template lpNorm<Eigen::Infinity>() * q.template lpNorm<Eigen::Infinity>() *
                      r.template lpNorm<Eigen::Infinity>();
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
