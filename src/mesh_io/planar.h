#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

// Exact predicates of points, segments and triangles in the plane.
namespace adaptive_bvh {

/// A point of the plane.
struct PlanarPoint {
  double x, y;
};

inline bool operator==(const PlanarPoint& a, const PlanarPoint& b) {
  return a.x == b.x && a.y == b.y;
}

using PlanarTriangle = std::array<PlanarPoint, 3>;

/// A budget of work, in steps of a few nanoseconds.
class WorkLimit {
 public:
  explicit WorkLimit(std::size_t steps) : steps_(steps) {}
  void spend(std::size_t steps) { steps_ -= std::min(steps, steps_); }
  bool isSpent() const { return steps_ == 0; }

 private:
  std::size_t steps_;
};

/// An exact sum of a few products, as non-overlapping numbers of increasing size (an "expansion" of
/// J. R. Shewchuk, "Adaptive precision floating-point arithmetic and fast robust geometric
/// predicates", 1997).
class ExpansionSum {
 public:
  /// Adds a b. There may be six products.
  void addProduct(double a, double b) {
    const double product = a * b;
    add(std::fma(a, b, -product));  // the rounding error of the product, exactly
    add(product);
  }

  /// The sign of the sum: 1, 0 or -1.
  int sign() const {
    for (std::size_t k = size_; k-- > 0;)
      if (terms_[k] != 0) return terms_[k] > 0 ? 1 : -1;
    return 0;
  }

 private:
  void add(double number) {
    for (std::size_t k = 0; k < size_; ++k) {  // Knuth's TwoSum with each term
      const double sum = number + terms_[k], other = sum - number;
      terms_[k] = (number - (sum - other)) + (terms_[k] - other);
      number = sum;
    }
    terms_[size_++] = number;
  }

  std::array<double, 12> terms_;
  std::size_t size_ = 0;
};

/// Exact predicates in the plane, for coordinates of at most 1 whose products do not underflow.
/// They count their work.
class PlanarPredicates {
 public:
  explicit PlanarPredicates(WorkLimit& work) : work_(work) {}

  /// 1 if three points are counter-clockwise, -1 if clockwise, 0 if collinear.
  int orientation(const PlanarPoint& a, const PlanarPoint& b, const PlanarPoint& c) const {
    const double ax = a.x - c.x, ay = a.y - c.y, bx = b.x - c.x, by = b.y - c.y;
    const double left = ax * by, right = ay * bx;
    const double determinant = left - right, size = std::fabs(left) + std::fabs(right);
    // The paper's error bound is (3 + 16 u) u times the size, with u = 2^-53.
    if (size > 0x1p-900 && std::fabs(determinant) > 0x1p-51 * size) return determinant > 0 ? 1 : -1;
    if ((ax == 0 || by == 0) && (ay == 0 || bx == 0))
      return 0;  // a difference is 0 only if the numbers are equal
    work_.spend(kExactSteps);
    ExpansionSum sum;  // the determinant, without differences of coordinates
    sum.addProduct(a.x, b.y);
    sum.addProduct(-a.x, c.y);
    sum.addProduct(-c.x, b.y);
    sum.addProduct(-a.y, b.x);
    sum.addProduct(a.y, c.x);
    sum.addProduct(c.y, b.x);
    return sum.sign();
  }

  /// Whether x lies on the segment from a to b, ends excluded.
  bool isWithinSegment(const PlanarPoint& a, const PlanarPoint& b, const PlanarPoint& x) const {
    const auto isBetween = [](double from, double to, double number) {
      return std::min(from, to) < number && number < std::max(from, to);
    };
    return (a.x == b.x ? isBetween(a.y, b.y, x.y) : isBetween(a.x, b.x, x.x)) &&
           orientation(a, b, x) == 0;
  }

  /// Whether a segment has a point in the interior of a counter-clockwise triangle: neither an edge
  /// of the triangle nor the segment itself separates them.
  bool enters(const PlanarPoint& from, const PlanarPoint& to, const PlanarTriangle& t) const {
    if (areOnOneSide(t[0].x, t[1].x, t[2].x, from.x, to.x) ||
        areOnOneSide(t[0].y, t[1].y, t[2].y, from.y, to.y))
      return false;
    work_.spend(kTestSteps);
    int left = 0, right = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const PlanarPoint &a = t[k], &b = t[(k + 1) % 3];
      if (orientation(a, b, from) <= 0 && orientation(a, b, to) <= 0) return false;
      const int side = orientation(from, to, a);
      left += side > 0;
      right += side < 0;
    }
    return left > 0 && right > 0;
  }

  /// Whether the interiors of two counter-clockwise triangles intersect.
  bool overlap(const PlanarTriangle& a, const PlanarTriangle& b) const {
    if (areOnOneSide(a, b, &PlanarPoint::x) || areOnOneSide(a, b, &PlanarPoint::y)) return false;
    work_.spend(kTestSteps);
    return !hasSeparatingEdge(a, b) && !hasSeparatingEdge(b, a);
  }

 private:
  static constexpr std::size_t kExactSteps = 60, kTestSteps = 4;  ///< work, see WorkLimit

  /// Whether the interval of a segment is outside that of a triangle's three coordinates.
  static bool areOnOneSide(double a, double b, double c, double from, double to) {
    return std::max(from, to) <= std::min({a, b, c}) || std::min(from, to) >= std::max({a, b, c});
  }

  /// Whether the intervals of two triangles along coordinate k do not overlap.
  static bool areOnOneSide(const PlanarTriangle& a, const PlanarTriangle& b,
                           double PlanarPoint::*k) {
    const auto [a_least, a_most] = std::minmax({a[0].*k, a[1].*k, a[2].*k});
    const auto [b_least, b_most] = std::minmax({b[0].*k, b[1].*k, b[2].*k});
    return a_most <= b_least || b_most <= a_least;
  }

  /// Whether the second triangle is on the outer side of an edge of the first.
  bool hasSeparatingEdge(const PlanarTriangle& triangle, const PlanarTriangle& other) const {
    for (std::size_t k = 0; k < 3; ++k)
      if (std::all_of(other.begin(), other.end(), [&](const PlanarPoint& p) {
            return orientation(triangle[k], triangle[(k + 1) % 3], p) <= 0;
          }))
        return true;
    return false;
  }

  WorkLimit& work_;
};

}  // namespace adaptive_bvh
