#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include <fcl/common/types.h>

namespace adaptive_bvh {

/// All points origin + t direction; the direction has any length but 0.
struct Line {
  fcl::Vector3d origin, direction;
};

/// The part of a line that is in a convex shape: enter <= t <= leave, or nothing.
struct LineInterval {
  double enter = std::numeric_limits<double>::infinity(), leave = -enter;

  static LineInterval all() {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    return {-kInfinity, kInfinity};
  }
  /// All t with a + t b <= 0.
  static LineInterval whereNotPositive(double a, double b) {
    if (b == 0) return a <= 0 ? all() : LineInterval();
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    return b > 0 ? LineInterval{-kInfinity, -a / b} : LineInterval{-a / b, kInfinity};
  }
  bool isEmpty() const { return !(enter <= leave); }
  LineInterval operator&(const LineInterval& other) const {
    return {std::max(enter, other.enter), std::min(leave, other.leave)};
  }
  /// Of two convex parts of a convex shape, what lies between as well.
  LineInterval joined(const LineInterval& other) const {
    if (isEmpty()) return other;
    if (other.isEmpty()) return *this;
    return {std::min(enter, other.enter), std::max(leave, other.leave)};
  }
};

/// All t with |from + t along| <= radius, in any number of dimensions: from the point of the line
/// that is nearest to the centre on, so that a far origin costs no digits.
template <typename Point>
LineInterval lineInBall(const Point& from, const Point& along, double radius) {
  const double square = along.squaredNorm();
  if (!(square > 0)) return from.norm() <= radius ? LineInterval::all() : LineInterval();
  const double middle = -from.dot(along) / square;
  const double off = (from + middle * along).norm();
  if (!(off <= radius)) return {};
  const double half = std::sqrt((radius - off) * (radius + off) / square);
  return {middle - half, middle + half};
}

/// Where a coordinate is between -half and half.
inline LineInterval lineInSlab(const Line& line, int axis, double half) {
  const double x = line.origin[axis], d = line.direction[axis];
  return LineInterval::whereNotPositive(x - half, d) &
         LineInterval::whereNotPositive(-x - half, -d);
}

/// The line from its nearest point to the origin on: find(line) by that, in the line's own t.
template <typename Find>
LineInterval fromNearest(const Line& line, const Find& find) {
  const double square = line.direction.squaredNorm();
  const double shift = -line.origin.dot(line.direction) / square;
  if (!std::isfinite(shift)) return find(line);
  LineInterval found = find(Line{line.origin + shift * line.direction, line.direction});
  found.enter += shift;
  found.leave += shift;
  return found;
}

}  // namespace adaptive_bvh
