#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include <fcl/common/types.h>

namespace adaptive_bvh {

/// Upper bounds of norms and sums in spite of rounding, and the ranges of numbers that the library
/// handles without overflow and underflow.
///
/// u = epsilon / 2 is the unit roundoff: fl(a op b) = (a op b)(1 + d) with |d| <= u. tiny()
/// compensates underflow: a square below the smallest normal number loses at most that number, and
/// the root of three such losses is below 2 sqrt(min).
namespace rounding {

template <typename S>
constexpr S epsilon() {
  return std::numeric_limits<S>::epsilon();
}

template <typename S>
constexpr S powerOfTwo(int exponent) {
  return exponent == 0  ? S(1)
         : exponent > 0 ? 2 * powerOfTwo<S>(exponent - 1)
                        : powerOfTwo<S>(exponent + 1) / 2;
}

/// 2 sqrt(min); min is the even power of two 2^(min_exponent - 1).
template <typename S>
constexpr S tiny() {
  constexpr S value = powerOfTwo<S>((std::numeric_limits<S>::min_exponent - 1) / 2 + 1);
  return value;
}

/// The largest coordinate that updates accept. FCL's triangle tests multiply four lengths, which
/// are differences of coordinates, cross products and sums of three: less than 2^9 times the fourth
/// power of the largest coordinate of two bodies side by side. 2^-4 times the fourth root of
/// 2^max_exponent leaves room for that: 2^252 for double, 2^28 for float. Fits, displacements and
/// the sums of their squares need less.
template <typename S>
constexpr S largestCoordinate() {
  constexpr S value = powerOfTwo<S>(std::numeric_limits<S>::max_exponent / 4 - 4);
  return value;
}

/// The shortest length for which a product of four lengths does not underflow, not even for
/// needle-shaped triangles: 2^-204 for double, 2^-25 for float. Shorter inputs are scaled up before
/// their lengths are multiplied.
template <typename S>
constexpr S shortLength() {
  constexpr S value = powerOfTwo<S>(std::numeric_limits<S>::min_exponent / 5);
  return value;
}

/// The scale for an input of this extent: the power of two that brings an extent below
/// shortLength() to about 1; 1 for larger extents and for 0.
template <typename S>
S enlargement(S extent) {
  if (!(extent > 0 && extent < shortLength<S>())) return 1;
  constexpr int kMost = std::numeric_limits<S>::max_exponent - 1;
  return std::ldexp(S(1), std::min(-std::ilogb(extent), kMost));
}

/// At least |v|, for a vector v whose components carry a relative error of at most u each (the
/// difference of two points does). Squares, sums and root add 3u, so the norm is off by a factor of
/// at most 1 + 4u, and the product and sum below by 2u more: 8u = 4 epsilon covers both.
template <typename S>
S norm(const fcl::Vector3<S>& v) {
  const S length = v.norm();
  if (length == 0 && v.isZero(0)) return 0;
  return length * (1 + 4 * epsilon<S>()) + tiny<S>();
}

/// At least a + b, for a, b >= 0: the sum is off by 1 + u, the product by 1 + u, 2 epsilon = 4u.
template <typename S>
S sum(S a, S b) {
  return b == 0 ? a : (a + b) * (1 + 2 * epsilon<S>());
}

}  // namespace rounding
}  // namespace adaptive_bvh
