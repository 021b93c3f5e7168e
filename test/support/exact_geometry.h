#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/LU>

#include <fcl/math/bv/OBBRSS.h>

namespace adaptive_bvh_test {

/// The judge of the proven bounds: distances in long double, whose rounding is 2,000 times finer
/// than a double's. Every distance here is that of two points found, one of each body: so it is
/// never too small, up to that rounding, and a bound above it is surely wrong.
namespace exact {

using Real = long double;
using Point = Eigen::Matrix<Real, 3, 1>;
using Matrix = Eigen::Matrix<Real, 3, 3>;
using Triangle = std::array<Point, 3>;

template <typename Derived>
auto of(const Eigen::MatrixBase<Derived>& numbers) {
  return numbers.template cast<Real>().eval();
}

/// y = R x + T, as it stands: R need not be orthonormal to the last digit.
struct Placement {
  Matrix R = Matrix::Identity();
  Point T = Point::Zero();

  Point operator()(const Point& x) const { return R * x + T; }
  /// By the transpose of R.
  Point inverse(const Point& x) const { return R.transpose() * (x - T); }
  Triangle operator()(const Triangle& t) const {
    return {(*this)(t[0]), (*this)(t[1]), (*this)(t[2])};
  }
};

template <typename S>
Placement placement(const fcl::Transform3<S>& tf) {
  return {of(tf.linear()), of(tf.translation())};
}

inline Real clamp(Real x, Real low, Real high) { return std::min(std::max(x, low), high); }

/// The nearest point of a segment, or of a point.
inline Point nearestOnSegment(const Point& a, const Point& b, const Point& x) {
  const Point along = b - a;
  const Real length2 = along.squaredNorm();
  return length2 > 0 ? Point(a + along * clamp(along.dot(x - a) / length2, 0, 1)) : a;
}

inline Real distance(const Triangle& t, const Point& x) {
  Real least = std::numeric_limits<Real>::max();
  for (int k = 0; k < 3; ++k)
    least = std::min(least, (nearestOnSegment(t[k], t[(k + 1) % 3], x) - x).norm());
  // The foot on the plane, where it lies in the triangle: by its barycentric coordinates.
  const Point u = t[1] - t[0], v = t[2] - t[0], normal = u.cross(v);
  const Real area2 = normal.squaredNorm();
  if (!(area2 > 0)) return least;
  const Point w = x - t[0];
  const Real b = w.cross(v).dot(normal) / area2, c = u.cross(w).dot(normal) / area2;
  if (b < 0 || c < 0 || b + c > 1) return least;
  return std::min(least, (t[0] + u * b + v * c - x).norm());
}

/// Of two segments, by the lines' nearest points and then alternately from either end.
inline Real distance(const Point& a, const Point& b, const Point& c, const Point& d) {
  const Point u = b - a, v = d - c, w = a - c;
  const Real uu = u.squaredNorm(), uv = u.dot(v), vv = v.squaredNorm();
  const Real determinant = uu * vv - uv * uv;
  Real s = determinant > 0 ? clamp((uv * v.dot(w) - vv * u.dot(w)) / determinant, 0, 1) : Real(0);
  Point p = a + u * s, q = nearestOnSegment(c, d, p);
  p = nearestOnSegment(a, b, q);
  Real least = std::min((p - q).norm(), (p - nearestOnSegment(c, d, p)).norm());
  for (const Point& end : {a, b})
    least = std::min(least, (nearestOnSegment(c, d, end) - end).norm());
  for (const Point& end : {c, d})
    least = std::min(least, (nearestOnSegment(a, b, end) - end).norm());
  return least;
}

/// Does the segment cross the plane of the triangle within it?
inline bool pierces(const Point& a, const Point& b, const Triangle& t) {
  const Point normal = (t[1] - t[0]).cross(t[2] - t[0]);
  const Real da = normal.dot(a - t[0]), db = normal.dot(b - t[0]);
  if (da == db || (da > 0) == (db > 0)) return false;
  const Point x = a + (b - a) * (da / (da - db));
  for (int k = 0; k < 3; ++k)
    if (normal.dot((t[(k + 1) % 3] - t[k]).cross(x - t[k])) < 0) return false;
  return true;
}

/// Two triangles are nearest at two edges, or at a corner and a face; or one's edge pierces the
/// other.
inline Real distance(const Triangle& p, const Triangle& q) {
  Real least = std::numeric_limits<Real>::max();
  for (int i = 0; i < 3; ++i) {
    const Point &p0 = p[i], &p1 = p[(i + 1) % 3];
    if (pierces(p0, p1, q) || pierces(q[i], q[(i + 1) % 3], p)) return 0;
    for (int j = 0; j < 3; ++j) least = std::min(least, distance(p0, p1, q[j], q[(j + 1) % 3]));
    least = std::min(least, std::min(distance(q, p0), distance(p, q[i])));
  }
  return least;
}

/// The parallelogram of a rectangle-swept sphere, as two triangles. Its axes count as they are.
template <typename S>
std::array<Triangle, 2> rectangle(const fcl::RSS<S>& bv, const Placement& placed = {}) {
  const Point corner = of(bv.To), x = of(bv.axis.col(0)) * Real(bv.l[0]),
              y = of(bv.axis.col(1)) * Real(bv.l[1]);
  return {placed(Triangle{corner, Point(corner + x), Point(corner + x + y)}),
          placed(Triangle{corner, Point(corner + y), Point(corner + x + y)})};
}

/// Of two volumes, the second one placed; negative where their spheres overlap.
template <typename S>
Real distance(const fcl::RSS<S>& a, const fcl::RSS<S>& b, const Placement& b_placed) {
  Real least = std::numeric_limits<Real>::max();
  for (const Triangle& p : rectangle(a))
    for (const Triangle& q : rectangle(b, b_placed)) least = std::min(least, distance(p, q));
  return least - Real(a.r) - Real(b.r);
}

/// How far a point lies outside a volume; negative inside.
template <typename S>
Real excess(const fcl::RSS<S>& bv, const Point& x) {
  const auto halves = rectangle(bv);
  return std::min(distance(halves[0], x), distance(halves[1], x)) - Real(bv.r);
}

/// Of a box as it may be read: by what it covers along its axes, and by the sums of its axes.
/// (Their difference is the axes' rounding.)
template <typename S>
Real excess(const fcl::OBB<S>& box, const Point& x) {
  const Matrix axes = of(box.axis);
  const Point d = x - of(box.To), extent = of(box.extent);
  const Point along = axes.transpose() * d, sums = axes.inverse() * d;
  return std::max((along.cwiseAbs() - extent).maxCoeff(), (sums.cwiseAbs() - extent).maxCoeff());
}
template <typename S>
Real excess(const fcl::OBBRSS<S>& bv, const Point& x) {
  return std::max(excess(bv.obb, x), excess(bv.rss, x));
}

}  // namespace exact
}  // namespace adaptive_bvh_test
