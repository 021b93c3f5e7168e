#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include <fcl/common/types.h>

namespace adaptive_bvh {

/// The line of points origin + t direction; the direction may have any length but 0.
struct Line {
  fcl::Vector3d origin, direction;
};

/// The interval of a line inside a convex shape: enter <= t <= leave, or empty.
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
  /// The smallest interval that contains both: valid for two convex parts of one convex shape.
  LineInterval joined(const LineInterval& other) const {
    if (isEmpty()) return other;
    if (other.isEmpty()) return *this;
    return {std::min(enter, other.enter), std::max(leave, other.leave)};
  }
};

/// The interval with |origin + t direction| <= radius, in any number of dimensions. Computed
/// relative to the line's point nearest to the centre, so that a far origin costs no accuracy.
template <typename Point>
LineInterval lineInBall(const Point& origin, const Point& direction, double radius) {
  const double square = direction.squaredNorm();
  if (!(square > 0)) return origin.norm() <= radius ? LineInterval::all() : LineInterval();
  const double middle = -origin.dot(direction) / square;
  const double distance = (origin + middle * direction).norm();  // of the line from the centre
  if (!(distance <= radius)) return {};
  const double half = std::sqrt((radius - distance) * (radius + distance) / square);
  return {middle - half, middle + half};
}

/// The interval where a coordinate is between -half and half.
inline LineInterval lineInSlab(const Line& line, int axis, double half) {
  const double x = line.origin[axis], d = line.direction[axis];
  return LineInterval::whereNotPositive(x - half, d) &
         LineInterval::whereNotPositive(-x - half, -d);
}

/// Calls find(line) with the line's origin moved to its point nearest to the coordinate origin, and
/// returns the result in the given line's t.
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
