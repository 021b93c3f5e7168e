#include "triangles/nearness_order.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace adaptive_bvh {
namespace {

/// An unevaluated sum of two doubles, where the second is at most half a unit in the last place
/// of the first: 106 bits (Dekker 1971, "A floating-point technique for extending the available
/// precision").
struct Precise {
  double high = 0, low = 0;

  Precise operator-() const { return {-high, -low}; }
};

/// The exact sum of two doubles (Knuth's TwoSum).
Precise sumOf(double a, double b) {
  const double sum = a + b, added = sum - a;  // the part of b that the rounded sum contains
  return {sum, (a - (sum - added)) + (b - added)};
}
Precise operator+(const Precise& a, const Precise& b) {
  const Precise high = sumOf(a.high, b.high), low = sumOf(a.low, b.low);
  const Precise sum = sumOf(high.high, high.low + low.high);
  return sumOf(sum.high, sum.low + low.low);
}
Precise operator-(const Precise& a, const Precise& b) { return a + -b; }
Precise operator*(const Precise& a, const Precise& b) {
  const double product = a.high * b.high, error = std::fma(a.high, b.high, -product);
  return sumOf(product, error + (a.high * b.low + a.low * b.high));
}
Precise operator/(const Precise& a, const Precise& b) {
  const double first = a.high / b.high;
  const Precise rest = a - Precise{first, 0} * b;
  return sumOf(first, rest.high / b.high);
}

struct PreciseVector {
  Precise x, y, z;
};
PreciseVector difference(const fcl::Vector3d& a, const fcl::Vector3d& b) {
  return {sumOf(a[0], -b[0]), sumOf(a[1], -b[1]), sumOf(a[2], -b[2])};
}
/// Multiplies by a power of two, without error.
PreciseVector scaled(const PreciseVector& v, double by) {
  const auto times = [&](const Precise& x) -> Precise { return {by * x.high, by * x.low}; };
  return {times(v.x), times(v.y), times(v.z)};
}
/// The edge from a to b, scaled by a power of two to a length of about 1.
PreciseVector direction(const fcl::Vector3d& a, const fcl::Vector3d& b) {
  constexpr int kMost = std::numeric_limits<double>::max_exponent - 1;
  const double size = (b - a).lpNorm<Eigen::Infinity>();
  const int exponent = size > 0 ? std::min(-std::ilogb(size), kMost) : 0;
  return scaled(difference(b, a), std::ldexp(1., exponent));
}
Precise dot(const PreciseVector& a, const PreciseVector& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
PreciseVector cross(const PreciseVector& a, const PreciseVector& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// The squared distance, times scale^2, of x from the feature that contains a place of the face:
/// the plane, the line of a side, or a corner. Planes and lines are given by directions of edges,
/// so products keep their digits however small the face is.
Precise squaredDistance(const fcl::Vector3d& x, const std::array<fcl::Vector3d, 3>& face,
                        const feature_distance::FacePlace& place, double scale) {
  const fcl::Vector3d &from = face[place.edge], &to = face[(place.edge + 1) % 3];
  const PreciseVector vector = scaled(difference(x, from), scale);
  if (place.is_inside) {
    const PreciseVector normal =
        cross(direction(from, to), direction(from, face[(place.edge + 2) % 3]));
    const Precise height = dot(normal, vector);
    return height * height / dot(normal, normal);
  }
  if (place.along == 0) return dot(vector, vector);
  const PreciseVector edge = direction(from, to), across = cross(vector, edge);
  return dot(across, across) / dot(edge, edge);
}

}  // namespace

PreciseSquare::PreciseSquare(const fcl::Vector3d& x, const std::array<fcl::Vector3d, 3>& face,
                             const feature_distance::FacePlace& place, double scale) {
  const Precise square = squaredDistance(x, face, place, scale);
  high_ = square.high;
  low_ = square.low;
}

bool PreciseSquare::isLess(const PreciseSquare& other) const {
  return (other.high_ - high_) + (other.low_ - low_) > 0x1p-80 * other.high_;
}

}  // namespace adaptive_bvh
