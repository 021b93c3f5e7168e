#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>

namespace adaptive_bvh {

/// A number in exact arithmetic: sums, differences and products without rounding, overflow or
/// underflow. Used for the few decisions that an error bound leaves open. A sign, and an integer of
/// 64-bit limbs times a power of 2^64. (Orientations stay with
/// ExactSum, which adds products of three doubles alone: with this class `collide` of tilted
/// lattices of tenths took 149 instead of 88 ms.)
///
/// kLimbs suffices for products of six lengths that differences of accepted coordinates have
/// (rounding::largestCoordinate): bits from 2^(6 * -1074) to 2^(6 * 255), 125 limbs. Each of six
/// factors may begin with a limb of which one bit counts, and a result takes up to 4 limbs more
/// before it is trimmed.
class ExactNumber {
 public:
  ExactNumber(double x = 0) : is_negative_(x < 0) {  // NOLINT(google-explicit-constructor)
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
  ExactNumber(const ExactNumber& other) { *this = other; }
  ExactNumber& operator=(const ExactNumber& other) {
    if (this == &other) return *this;
    begin_ = other.begin_;
    size_ = other.size_;
    is_negative_ = other.is_negative_;
    for (int k = 0; k < size_; ++k) limbs_[k] = other.limbs_[k];
    return *this;
  }

  friend ExactNumber operator+(const ExactNumber& a, const ExactNumber& b) {
    return sum(a, b, b.is_negative_);
  }
  friend ExactNumber operator-(const ExactNumber& a, const ExactNumber& b) {
    return sum(a, b, !b.is_negative_);
  }
  friend ExactNumber operator*(const ExactNumber& a, const ExactNumber& b) {
    ExactNumber product;
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
  friend bool operator<(const ExactNumber& a, const ExactNumber& b) { return (a - b).sign() < 0; }

  /// The sign: -1, 0 or 1.
  int sign() const { return size_ == 0 ? 0 : is_negative_ ? -1 : 1; }

 private:
  static constexpr int kLimbs = 144, kOffset = 17;
  __extension__ typedef unsigned __int128 Wide;

  /// The sum of a and b, where b gets the sign `is_negative`.
  static ExactNumber sum(const ExactNumber& a, const ExactNumber& b, bool is_negative) {
    if (b.size_ == 0) return a;
    ExactNumber result;
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

}  // namespace adaptive_bvh
