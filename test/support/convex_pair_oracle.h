#pragma once

#include <algorithm>
#include <vector>

#include "support/quad_geometry.h"
#include "support/shape_oracle.h"

namespace adaptive_bvh_test {

/// A shape in its place, as the judge of pairs of shapes knows it, in long double.
struct JudgedConvex {
  using Real = exact::Real;
  using Point = exact::Point;

  JudgedShape shape;
  exact::Placement place;

  JudgedConvex(const JudgedShape& judged, const fcl::Transform3d& tf)
      : shape(judged), place(exact::placement(tf)) {}

  /// Of a point of the world; 0 inside.
  Real distance(const Point& x) const { return shape.distance(place.inverse(x)); }
  /// The largest n x of the body; may be infinite.
  Real reach(const Point& n) const { return shape.reach(place.R.transpose() * n) + n.dot(place.T); }
};

namespace convex_pairs {

using exact::Point;
using exact::Real;

/// How far the second must move along n, of length 1, to get past the first; negative where they
/// are apart along n.
inline Real way(const JudgedConvex& first, const JudgedConvex& second, const Point& n) {
  return first.reach(n) + second.reach(-n);
}

/// The largest gap of two bodies along directions near one, by a compass search in long double.
inline Real widestGap(const JudgedConvex& first, const JudgedConvex& second, Point n) {
  constexpr int kDirections = 12;
  Real best = -way(first, second, n);
  for (Real step = 1e-3L; step > 1e-15L; step *= 0.7L) {
    const Point u = n.unitOrthogonal(), v = n.cross(u);
    for (int k = 0; k < kDirections; ++k) {
      const Real angle = Real(2 * M_PI) * k / kDirections + step;
      const Point m = (n + step * (std::cos(angle) * u + std::sin(angle) * v)).normalized();
      const Real gap = -way(first, second, m);
      if (gap > best) best = gap, n = m;
    }
  }
  return best;
}

// Closed forms, in quadruple precision.

inline quad::Point quadOf(const Point& x) {
  return {quad::Real(x[0]), quad::Real(x[1]), quad::Real(x[2])};
}

/// Of two segments.
inline Real distance(const Point& a, const Point& b, const Point& c, const Point& d) {
  const quad::Point p = quadOf(a), q = quadOf(b), r = quadOf(c), s = quadOf(d);
  quad::Real least = std::min({quad::squaredDistance(p, r, s), quad::squaredDistance(q, r, s),
                               quad::squaredDistance(r, p, q), quad::squaredDistance(s, p, q)});
  const quad::Real inside = quad::squaredDistanceInside(p, q, r, s);
  if (inside >= 0) least = std::min(least, inside);
  return Real(quad::root(least));
}

/// The faces of a box in its place.
inline std::vector<quad::Triangle> boxFaces(const Point& half, const exact::Placement& place) {
  const int faces[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                            {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  const auto corner = [&](int i) {
    const Point sides(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1);
    return quadOf(place(Point(half.cwiseProduct(sides))));
  };
  std::vector<quad::Triangle> triangles;
  for (const auto& f : faces) triangles.push_back({corner(f[0]), corner(f[1]), corner(f[2])});
  return triangles;
}
/// Of two boxes that are not inside of each other, over all pairs of faces.
inline Real distance(const std::vector<quad::Triangle>& a, const std::vector<quad::Triangle>& b) {
  quad::Real least = quad::distance(a[0], b[0]);
  for (const quad::Triangle& p : a)
    for (const quad::Triangle& q : b) least = std::min(least, quad::distance(p, q));
  return Real(least);
}

/// How deep two boxes are in each other: by the directions of faces and of products of edges.
inline Real boxDepth(const Point& half1, const exact::Placement& place1, const Point& half2,
                     const exact::Placement& place2) {
  Real least = std::numeric_limits<Real>::infinity();
  const auto tryDirection = [&](Point n) {
    if (n.norm() < 1e-9L) return;
    n.normalize();
    const Real middles = std::fabs(n.dot(place1.T - place2.T));
    const Real halves = (place1.R.transpose() * n).cwiseAbs().dot(half1) +
                        (place2.R.transpose() * n).cwiseAbs().dot(half2);
    least = std::min(least, halves - middles);
  };
  for (int i = 0; i < 3; ++i) {
    tryDirection(place1.R.col(i));
    tryDirection(place2.R.col(i));
    for (int j = 0; j < 3; ++j) tryDirection(place1.R.col(i).cross(place2.R.col(j)));
  }
  return least;
}

}  // namespace convex_pairs
}  // namespace adaptive_bvh_test
