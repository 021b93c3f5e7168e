#pragma once

#include <array>
#include <cmath>
#include <cstdint>

namespace adaptive_bvh {

/// A sum of products of three doubles, without any rounding, overflow or underflow: one long fixed-
/// point number that holds the lowest bit of the smallest product and the highest of the largest
/// (U. Kulisch, "Computer Arithmetic and Validity", 2013: a long accumulator). For the few
/// decisions that an error bound leaves open; a product takes some 20 ns.
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
    if (isNegative()) return -1;
    for (const std::uint64_t limb : limbs_)
      if (limb != 0) return 1;
    return 0;
  }

  /// The sum with a relative error of at most 2^-52.
  Scaled value() const {
    ExactSum magnitude = *this;
    if (isNegative()) magnitude.negate();
    std::size_t top = kLimbs;
    while (top > 0 && magnitude.limbs_[top - 1] == 0) --top;
    if (top == 0) return {0, 0};
    // Three limbs hold more than 128 bits from the highest one on.
    double sum = 0;
    for (std::size_t k = 0; k < 3 && k < top; ++k)
      sum = sum * 0x1p64 + static_cast<double>(magnitude.limbs_[top - 1 - k]);
    const std::size_t lowest = top < 3 ? 0 : top - 3;
    int exponent;
    const double mantissa = std::frexp(isNegative() ? -sum : sum, &exponent);
    return {mantissa, exponent + 64 * static_cast<int>(lowest) - kPoint};
  }

 private:
  // A product's lowest bit is 2^(3 * -1074) or higher; 2^64 of the largest, 2^3072, stay in range.
  static constexpr int kPoint = 3 * 1074;
  static constexpr std::size_t kLimbs = (kPoint + 3 * 1024 + 64) / 64 + 1;
  __extension__ typedef unsigned __int128 Wide;

  bool isNegative() const { return limbs_[kLimbs - 1] >> 63 != 0; }
  void negate() {
    bool carry = true;
    for (std::uint64_t& limb : limbs_) {
      limb = ~limb + carry;
      carry = carry && limb == 0;
    }
  }

  /// x = whole * 2^exponent.
  static std::uint64_t wholeOf(double x, int& exponent) {
    const double fraction = std::frexp(std::fabs(x), &exponent);
    exponent -= 53;
    return static_cast<std::uint64_t>(std::ldexp(fraction, 53));
  }

  void addProduct(double a, double b, double c, bool is_negative) {
    if (a == 0 || b == 0 || c == 0) return;
    int ea, eb, ec;
    const std::uint64_t x = wholeOf(a, ea), y = wholeOf(b, eb), z = wholeOf(c, ec);
    is_negative ^= std::signbit(a) ^ std::signbit(b) ^ std::signbit(c);
    // x * y * z, of 159 bits, as three limbs. A denormal's whole number ends in zeros, which make
    // up for an exponent below -1074.
    const Wide xy = Wide(x) * y, low = Wide(static_cast<std::uint64_t>(xy)) * z,
               high = (xy >> 64) * z + (low >> 64);
    std::array<std::uint64_t, 4> limbs = {static_cast<std::uint64_t>(low),
                                          static_cast<std::uint64_t>(high),
                                          static_cast<std::uint64_t>(high >> 64), 0};
    int at = ea + eb + ec + kPoint;
    for (; at < 0; ++at) {  // these bits are zeros
      limbs[0] = limbs[0] >> 1 | limbs[1] << 63;
      limbs[1] = limbs[1] >> 1 | limbs[2] << 63;
      limbs[2] >>= 1;
    }
    const int shift = at % 64;
    if (shift > 0)
      for (std::size_t k = 3; k < 4; --k)
        limbs[k] = limbs[k] << shift | (k > 0 ? limbs[k - 1] >> (64 - shift) : 0);
    accumulate(limbs, static_cast<std::size_t>(at / 64), is_negative);
  }

  void accumulate(const std::array<std::uint64_t, 4>& limbs, std::size_t at, bool is_negative) {
    std::uint64_t carry = 0;
    for (std::size_t k = 0; at + k < kLimbs; ++k) {
      if (k >= limbs.size() && carry == 0) break;
      const std::uint64_t limb = k < limbs.size() ? limbs[k] : 0;
      std::uint64_t& sum = limbs_[at + k];
      const Wide result = is_negative ? Wide(sum) - limb - carry : Wide(sum) + limb + carry;
      sum = static_cast<std::uint64_t>(result);
      carry = static_cast<std::uint64_t>(result >> 64) & 1;
    }
  }

  std::array<std::uint64_t, kLimbs> limbs_{};  ///< the lowest first; negative as two's complement
};

}  // namespace adaptive_bvh
