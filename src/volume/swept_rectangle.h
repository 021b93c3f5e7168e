#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include <Eigen/Core>

#include "volume/mesh_view.h"

namespace adaptive_bvh {

/// The plane geometry of a fit: given a frame, which rectangle with which sphere holds the points.
/// Rounding errors here cost tightness, never containment: the fit measures its radius afterwards.

template <typename S>
struct Interval {
  S low = std::numeric_limits<S>::max();
  S high = std::numeric_limits<S>::lowest();

  void add(S low_value, S high_value) {
    low = std::min(low, low_value);
    high = std::max(high, high_value);
  }
  /// An empty interval becomes its middle: every ball then reaches the point from both sides.
  void close() {
    if (low > high) low = high = (low + high) / 2;
  }
  S length() const { return high - low; }
  /// How far x lies beyond the nearer end; negative inside.
  S beyond(S x) const { return std::max(low - x, x - high); }
  void grow(S x, S by) { (x < low ? low -= by : high += by); }
};

/// Points in the frame of the rectangle: x and y along its sides, z along its normal. As arrays of
/// numbers, so that their extents are found by vector instructions.
template <typename S>
class LocalPoints {
 public:
  using Numbers = Eigen::Map<const Eigen::Array<S, Eigen::Dynamic, 1>>;

  void assign(const std::vector<fcl::Vector3<S>>& points, const fcl::Matrix3<S>& frame,
              std::size_t stride = 1) {
    const std::size_t count = (points.size() + stride - 1) / stride;
    for (auto& numbers : numbers_) numbers.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
      const fcl::Vector3<S> q = frame.transpose() * (points[i * stride] - points.front());
      for (int k = 0; k < 3; ++k) numbers_[k][i] = q[k];
    }
  }

  /// Turns the frame by an angle in its plane, given as a unit vector.
  void turn(S cosine, S sine) {
    for (std::size_t i = 0; i < size(); ++i) {
      const S x = numbers_[0][i], y = numbers_[1][i];
      numbers_[0][i] = cosine * x + sine * y;
      numbers_[1][i] = cosine * y - sine * x;
    }
  }

  std::size_t size() const { return numbers_[0].size(); }
  Numbers x() const { return numbers(0); }
  Numbers y() const { return numbers(1); }
  Numbers z() const { return numbers(2); }

 private:
  Numbers numbers(int k) const { return {numbers_[k].data(), Eigen::Index(size())}; }

  std::array<std::vector<S>, 3> numbers_;
};

template <typename S, typename Numbers>
Interval<S> extent(const Numbers& numbers) {
  return {numbers.minCoeff(), numbers.maxCoeff()};
}

/// The plane of the rectangle, as the height z, and the radius of the sphere.
template <typename S>
struct Slab {
  S middle, radius;

  /// How far the sphere reaches sideways at a height, squared.
  S squaredReach(S z) const {
    return std::max(S(0), radius * radius - (z - middle) * (z - middle));
  }
};

template <typename S>
struct Rectangle {
  Interval<S> x, y;

  S sweptArea(S r) const {
    const S a = x.length(), b = y.length();
    return 2 * a * b + S(2 * M_PI) * r * (a + b) + S(4 * M_PI) * r * r;
  }
};

/// After Larsen et al. (1999), PQP: in the plane, a point at height z is reached over
/// w = sqrt(r^2 - z^2), so the rectangle ends w short of it. Points beyond two sides at once may
/// lie outside the round corner: there both sides grow by the least equal step that reaches the
/// point.
template <typename S>
Rectangle<S> rectangleFor(const LocalPoints<S>& points, const Slab<S>& slab) {
  Rectangle<S> rectangle;
  Interval<S>&x = rectangle.x, &y = rectangle.y;
  const auto xs = points.x(), ys = points.y(), zs = points.z();
  for (Eigen::Index i = 0; i < xs.size(); ++i) {
    if (x.beyond(xs[i]) <= 0 && y.beyond(ys[i]) <= 0) continue;  // as w >= 0, no end moves
    const S w = std::sqrt(slab.squaredReach(zs[i]));
    x.add(xs[i] + w, xs[i] - w);
    y.add(ys[i] + w, ys[i] - w);
  }
  x.close();
  y.close();

  for (Eigen::Index i = 0; i < xs.size(); ++i) {
    const S dx = x.beyond(xs[i]);
    const S dy = y.beyond(ys[i]);
    if (dx <= 0 || dy <= 0) continue;
    const S w2 = slab.squaredReach(zs[i]);
    if (dx * dx + dy * dy <= w2) continue;
    // The smaller root g of (dx - g)^2 + (dy - g)^2 = w^2.
    const S step = (dx + dy - std::sqrt(std::max(S(0), 2 * w2 - (dx - dy) * (dx - dy)))) / 2;
    x.grow(xs[i], step);
    y.grow(ys[i], step);
  }
  return rectangle;
}

/// A direction in the plane of the rectangle, of length 1.
template <typename S>
struct Direction {
  S x = 1, y = 0;

  /// By an angle with the given cosine and sine.
  Direction turned(S cosine, S sine) const {
    return {cosine * x - sine * y, sine * x + cosine * y};
  }

  /// The area of the rectangle with this direction around the points, in the plane.
  S boundingArea(const LocalPoints<S>& points) const {
    return extent<S>(x * points.x() + y * points.y()).length() *
           extent<S>(x * points.y() - y * points.x()).length();
  }
};

template <typename S>
struct LeastRectangle {
  explicit LeastRectangle(const LocalPoints<S>& around)
      : points(around), area(direction.boundingArea(around)) {}

  void attempt(const Direction<S>& d) {
    const S a = d.boundingArea(points);
    if (!(a < area)) return;
    area = a;
    direction = d;
  }

  const LocalPoints<S>& points;
  Direction<S> direction;
  S area;
};

/// Principal axes say nothing about a square, and mislead about an L. The least rectangle has a
/// side along two of the points: among four, that is found by trying all pairs. Among more, four
/// directions are tried and the best one refined by halves of the angle between.
template <typename S>
Direction<S> bestDirection(const LocalPoints<S>& points) {
  LeastRectangle<S> least(points);
  if (points.size() <= 4) {
    for (Eigen::Index i = 0; i < points.x().size(); ++i)
      for (Eigen::Index j = 0; j < i; ++j) {
        const S dx = points.x()[i] - points.x()[j], dy = points.y()[i] - points.y()[j];
        const S length = std::sqrt(dx * dx + dy * dy);
        if (length > std::numeric_limits<S>::min()) least.attempt({dx / length, dy / length});
      }
    return least.direction;
  }
  constexpr S kCos45 = S(0.70710678118654752), kCos22 = S(0.92387953251128674),
              kSin22 = S(0.38268343236508977), kCos11 = S(0.98078528040323043),
              kSin11 = S(0.19509032201612825), kCos6 = S(0.99518472667219693),
              kSin6 = S(0.098017140329560604);
  least.attempt({kCos22, kSin22});
  least.attempt({kCos45, kCos45});
  least.attempt({kSin22, kCos22});
  for (const auto& [cosine, sine] : {std::array<S, 2>{kCos11, kSin11}, {kCos6, kSin6}}) {
    const Direction<S> middle = least.direction;
    least.attempt(middle.turned(cosine, sine));
    least.attempt(middle.turned(cosine, -sine));
  }
  return least.direction;
}

}  // namespace adaptive_bvh
