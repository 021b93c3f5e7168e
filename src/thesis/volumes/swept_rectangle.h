#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include <fcl/common/types.h>

#include "base/pack.h"

namespace adaptive_bvh {

/// Points as three arrays of numbers, for vector instructions. The last pack is filled up with
/// copies of the first point: they change neither extents nor sums about that point. The arrays
/// only grow, so from the largest set on nothing is allocated.
template <typename S>
class PointArrays {
 public:
  using Point = fcl::Vector3<S>;

  void clear() { size_ = 0; }
  /// Reserves memory for `more` points, at most `kGranule`. Call it before adding them.
  void makeRoomFor(std::size_t more) {
    if (size_ + more > numbers_[0].size()) makeRoom(2 * numbers_[0].size() + kGranule);
  }
  void add(const Point& p) {
    for (int k = 0; k < 3; ++k) numbers_[k][size_] = p[k];
    ++size_;
  }
  /// After the last point.
  void fillUp() {
    for (std::size_t i = size_; i % packs::kSize<S> != 0; ++i)
      for (auto& numbers : numbers_) numbers[i] = numbers[0];
  }

  /// Every `stride`-th of some points.
  void assign(const PointArrays& points, std::size_t stride) {
    clear();
    for (std::size_t i = 0; i < points.size(); i += stride) {
      makeRoomFor(1);
      add(points[i]);
    }
    fillUp();
  }

  /// Some points in a frame about the first of them.
  void assign(const PointArrays& points, const fcl::Matrix3<S>& frame) {
    if (numbers_[0].size() < points.size()) makeRoom((points.size() / kGranule + 1) * kGranule);
    size_ = points.size();
    const Point first = points[0];
    for (std::size_t i = 0; i < size_; i += packs::kSize<S>) {
      const Pack<S> x = points.pack(0, i) - first[0], y = points.pack(1, i) - first[1],
                    z = points.pack(2, i) - first[2];
      for (int k = 0; k < 3; ++k)
        packs::store<S>(frame(0, k) * x + frame(1, k) * y + frame(2, k) * z, &numbers_[k][i]);
    }
  }

  /// Turns the frame by an angle in its plane of x and y, given as a unit vector.
  void turn(S cosine, S sine) {
    for (std::size_t i = 0; i < size_; i += packs::kSize<S>) {
      const Pack<S> x = pack(0, i), y = pack(1, i);
      packs::store<S>(cosine * x + sine * y, &numbers_[0][i]);
      packs::store<S>(cosine * y - sine * x, &numbers_[1][i]);
    }
  }

  std::size_t size() const { return size_; }
  Point operator[](std::size_t i) const { return {numbers_[0][i], numbers_[1][i], numbers_[2][i]}; }
  /// Coordinate k of the points from i on, a multiple of the pack's size.
  ADAPTIVE_BVH_INLINE Pack<S> pack(int k, std::size_t i) const {
    return packs::load(&numbers_[k][i]);
  }

 private:
  static constexpr std::size_t kGranule = 64;  // a multiple of the pack's size
  void makeRoom(std::size_t points) {
    for (auto& numbers : numbers_) numbers.resize(points);
  }

  std::array<std::vector<S>, 3> numbers_;
  std::size_t size_ = 0;
};

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

/// The least and the largest of many numbers.
template <typename S>
class Extent {
 public:
  ADAPTIVE_BVH_INLINE void add(const Pack<S>& low, const Pack<S>& high) {
    low_ = packs::lower(low_, low);
    high_ = packs::upper(high_, high);
  }
  ADAPTIVE_BVH_INLINE void add(const Pack<S>& numbers) { add(numbers, numbers); }
  Interval<S> interval() const { return {packs::smallest(low_), packs::largest(high_)}; }

 private:
  Pack<S> low_ = packs::all(std::numeric_limits<S>::max());
  Pack<S> high_ = packs::all(std::numeric_limits<S>::lowest());
};

/// Points in the frame of the rectangle: x and y along its sides, z along its normal.
template <typename S>
using LocalPoints = PointArrays<S>;

template <typename S>
Interval<S> heights(const LocalPoints<S>& points) {
  Extent<S> z;
  for (std::size_t i = 0; i < points.size(); i += packs::kSize<S>) z.add(points.pack(2, i));
  return z.interval();
}

/// The plane of the rectangle, as the height z, and the radius of the sphere.
template <typename S>
struct Slab {
  S middle, radius;

  /// Half the chord of the sphere at some heights, squared.
  ADAPTIVE_BVH_INLINE Pack<S> squaredHalfChord(const Pack<S>& z) const {
    return packs::upper(Pack<S>{}, radius * radius - (z - middle) * (z - middle));
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

/// Lets both sides grow by the least equal step that reaches a point beyond them: by dx and dy,
/// with w^2 the squared half chord of the sphere there. The step is the smaller root g of
/// (dx - g)^2 + (dy - g)^2 = w^2.
template <typename S>
void growCorner(Rectangle<S>& rectangle, S x, S y, S w2) {
  const S dx = rectangle.x.beyond(x), dy = rectangle.y.beyond(y);
  if (dx <= 0 || dy <= 0 || dx * dx + dy * dy <= w2) return;
  const S step = (dx + dy - std::sqrt(std::max(S(0), 2 * w2 - (dx - dy) * (dx - dy)))) / 2;
  rectangle.x.grow(x, step);
  rectangle.y.grow(y, step);
}

/// After Larsen et al. (1999), PQP: in the plane, a point at height z is reached over
/// w = sqrt(r^2 - z^2), so the rectangle ends w short of it. Points beyond two sides at once may
/// lie outside the round corner: `growCorners` lets both sides grow there.
template <typename S>
Rectangle<S> rectangleWithoutCorners(const LocalPoints<S>& points, const Slab<S>& slab) {
  Extent<S> x, y;
  for (std::size_t i = 0; i < points.size(); i += packs::kSize<S>) {
    const Pack<S> w = packs::squareRoot(slab.squaredHalfChord(points.pack(2, i)));
    x.add(points.pack(0, i) + w, points.pack(0, i) - w);
    y.add(points.pack(1, i) + w, points.pack(1, i) - w);
  }
  Rectangle<S> rectangle{x.interval(), y.interval()};
  rectangle.x.close();
  rectangle.y.close();
  return rectangle;
}

template <typename S>
void growCorners(Rectangle<S>& rectangle, const LocalPoints<S>& points, const Slab<S>& slab) {
  for (std::size_t i = 0; i < points.size(); i += packs::kSize<S>) {
    const Pack<S> px = points.pack(0, i), py = points.pack(1, i);
    const Pack<S> dx = packs::upper<Pack<S>>(rectangle.x.low - px, px - rectangle.x.high);
    const Pack<S> dy = packs::upper<Pack<S>>(rectangle.y.low - py, py - rectangle.y.high);
    const Pack<S> w2 = slab.squaredHalfChord(points.pack(2, i));
    if (packs::any((dx > 0) & (dy > 0) & (dx * dx + dy * dy > w2)))
      for (std::size_t k = 0; k < packs::kSize<S>; ++k)
        growCorner<S>(rectangle, px[k], py[k], w2[k]);
  }
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
    Extent<S> along, across;
    for (std::size_t i = 0; i < points.size(); i += packs::kSize<S>) {
      const Pack<S> px = points.pack(0, i), py = points.pack(1, i);
      along.add(x * px + y * py);
      across.add(x * py - y * px);
    }
    return along.interval().length() * across.interval().length();
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
    for (std::size_t i = 0; i < points.size(); ++i)
      for (std::size_t j = 0; j < i; ++j) {
        const fcl::Vector3<S> d = points[i] - points[j];
        const S length = std::sqrt(d[0] * d[0] + d[1] * d[1]);
        if (length > std::numeric_limits<S>::min()) least.attempt({d[0] / length, d[1] / length});
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
