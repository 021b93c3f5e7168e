#pragma once

#include <vector>

#include "support/exact_geometry.h"

namespace adaptive_bvh_test {
namespace exact {

// Intersections of convex polyhedra with half-spaces, in long double.

using Polygon = std::vector<Point>;

/// The points x with normal . x <= offset.
struct HalfSpace {
  Point normal;
  Real offset;

  Real height(const Point& x) const { return normal.dot(x) - offset; }
};

/// The part of a convex polygon in a half-space.
inline Polygon clipped(const Polygon& polygon, const HalfSpace& half) {
  Polygon result;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Point &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const Real ha = half.height(a), hb = half.height(b);
    if (ha <= 0) result.push_back(a);
    if ((ha < 0 && hb > 0) || (ha > 0 && hb < 0)) result.push_back(a + (b - a) * (ha / (ha - hb)));
  }
  return result;
}

/// Integrals over a flat or closed surface.
struct Moments {
  Real area = 0, volume = 0;     ///< the volume is that of the cones from the origin
  Point first = Point::Zero();   ///< of the position, over the area
  Point normal = Point::Zero();  ///< times the area

  void add(const Polygon& p, Real factor = 1) {
    for (std::size_t i = 1; i + 1 < p.size(); ++i) {
      const Point across = factor / 2 * (p[i] - p[0]).cross(p[i + 1] - p[0]);
      const Real part = factor < 0 ? -across.norm() : across.norm();
      area += part;
      normal += across;
      first += part / 3 * (p[0] + p[i] + p[i + 1]);
      volume += p[0].dot(across) / 3;
    }
  }
};

/// A tetrahedron whose faces show outward.
struct Tetrahedron {
  std::array<Point, 4> p;

  /// The three corners of face k, counter-clockwise seen from outside; corner k is not among them.
  Polygon face(std::size_t k) const {
    const Point &a = p[(k + 1) % 4], &b = p[(k + 2) % 4], &c = p[(k + 3) % 4];
    const bool flips = (b - a).cross(c - a).dot(p[k] - a) > 0;
    return flips ? Polygon{a, c, b} : Polygon{a, b, c};
  }
  HalfSpace half(std::size_t k) const {
    const Polygon f = face(k);
    Point normal = (f[1] - f[0]).cross(f[2] - f[0]);
    if (normal.norm() > 0) normal.normalize();
    return {normal, normal.dot(f[0])};
  }
  Real volume() const { return (p[1] - p[0]).dot((p[2] - p[0]).cross(p[3] - p[0])) / 6; }
};

/// The part of a polygon inside a tetrahedron.
inline Polygon clipped(Polygon polygon, const Tetrahedron& body) {
  for (std::size_t k = 0; k < 4 && !polygon.empty(); ++k) polygon = clipped(polygon, body.half(k));
  return polygon;
}

/// The parts of the first's faces that are inside the second.
inline Moments insideOf(const Tetrahedron& first, const Tetrahedron& second) {
  Moments sum;
  for (std::size_t k = 0; k < 4; ++k) sum.add(clipped(first.face(k), second));
  return sum;
}

/// The common volume of two tetrahedra in general position.
inline Real commonVolume(const Tetrahedron& a, const Tetrahedron& b) {
  // Seen from a point of the first, so that little cancels.
  Tetrahedron one = a, two = b;
  for (Point& x : one.p) x -= a.p[0];
  for (Point& x : two.p) x -= a.p[0];
  return insideOf(one, two).volume + insideOf(two, one).volume;
}

}  // namespace exact
}  // namespace adaptive_bvh_test
