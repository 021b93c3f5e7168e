#pragma once

#include <array>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "support/random_geometry.h"

namespace adaptive_bvh_test {

/// The judge of intersections: triangles whose corners are whole numbers below 2^25, by arithmetic
/// without rounding. It shares no code and no method with the library. Two triangles have a common
/// point where the origin is in the hull of the nine differences of their corners. By
/// Carathéodory's theorem it then is such a difference, or inside a segment, a triangle or a
/// tetrahedron of them.
namespace integer {

__extension__ typedef __int128 Wide;
struct Point {
  std::int64_t x, y, z;
};
using Triangle = std::array<Point, 3>;

inline Wide dot(const Point& a, const Point& b) {
  return Wide(a.x) * b.x + Wide(a.y) * b.y + Wide(a.z) * b.z;
}
inline Point cross(const Point& a, const Point& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline bool isZero(const Point& a) { return a.x == 0 && a.y == 0 && a.z == 0; }
inline int sign(Wide x) { return (x > 0) - (x < 0); }
inline int side(const Point& a, const Point& b, const Point& c) {
  return sign(dot(a, cross(b, c)));
}

/// Whether the origin is between two points.
inline bool isBetween(const Point& a, const Point& b) {
  return isZero(cross(a, b)) && dot(a, b) <= 0;
}
/// Whether the origin lies inside a triangle with an area.
inline bool isInside(const Point& a, const Point& b, const Point& c) {
  if (side(a, b, c) != 0) return false;
  const Point u = cross(a, b), v = cross(b, c), w = cross(c, a);
  if (isZero(u) || isZero(v) || isZero(w)) return false;  // on a side
  return sign(dot(u, v)) > 0 && sign(dot(v, w)) > 0 && sign(dot(w, u)) > 0;
}
/// Whether the origin lies inside a tetrahedron with a volume.
inline bool isInside(const Point& a, const Point& b, const Point& c, const Point& d) {
  const int s = side(b, c, d);
  return s != 0 && side(a, d, c) == s && side(a, b, d) == s && side(a, c, b) == s;
}

inline bool touch(const Triangle& a, const Triangle& b) {
  std::vector<Point> d;
  for (const Point& p : a)
    for (const Point& q : b) d.push_back({p.x - q.x, p.y - q.y, p.z - q.z});
  for (std::size_t i = 0; i < 9; ++i) {
    if (isZero(d[i])) return true;
    for (std::size_t j = 0; j < i; ++j) {
      if (isBetween(d[i], d[j])) return true;
      for (std::size_t k = 0; k < j; ++k) {
        if (isInside(d[i], d[j], d[k])) return true;
        for (std::size_t l = 0; l < k; ++l)
          if (isInside(d[i], d[j], d[k], d[l])) return true;
      }
    }
  }
  return false;
}

}  // namespace integer

/// Pairs of such triangles, of every kind: on small lattices, in one plane, with parallel edges,
/// segments and points, needles, and such that just meet or just do not.
class IntegerTriangles {
 public:
  using Triangle = integer::Triangle;
  struct Pair {
    Triangle first, second;
  };

  explicit IntegerTriangles(unsigned seed) : random_(seed) {}

  Pair pair() {
    const int size = 1 << (1 + random_.below(24));
    Pair pair{triangle(size), triangle(size)};
    switch (random_.below(5)) {
      case 0:  // a plane across an axis
        for (Triangle* t : {&pair.first, &pair.second})
          for (integer::Point& p : *t) p.z = 1;
        break;
      case 1:  // any plane
        for (Triangle* t : {&pair.first, &pair.second})
          for (integer::Point& p : *t) p = {p.x / 8, p.y / 8, p.x / 8 - 2 * (p.y / 8)};
        break;
      case 2: meet(pair); break;
      default: break;
    }
    return pair;
  }

 private:
  integer::Point point(int size) {
    return {random_.below(size), random_.below(size), random_.below(size)};
  }
  Triangle triangle(int size) {
    Triangle t = {point(size), point(size), point(size)};
    switch (random_.below(6)) {
      case 0: t[2] = between(t[0], t[1], random_.below(5)); break;  // a segment, or a needle
      case 1: t[2] = t[1]; break;
      case 2: t[1] = {t[0].x, t[1].y, t[0].z}, t[2] = {t[2].x, t[0].y, t[0].z}; break;  // a corner
      default: break;
    }
    if (random_.oneIn(20)) t[1] = t[2] = t[0];
    return t;
  }
  /// Near a quarter of the way, or on it.
  static integer::Point between(const integer::Point& a, const integer::Point& b, int quarters) {
    return {a.x + (b.x - a.x) * quarters / 4, a.y + (b.y - a.y) * quarters / 4,
            a.z + (b.z - a.z) * quarters / 4};
  }
  /// Moves the second so that a point of one of its edges, or a corner, is on or near the first.
  void meet(Pair& pair) {
    const Triangle &a = pair.first, &b = pair.second;
    const integer::Point there =
        between(a[0], between(a[1], a[2], random_.below(5)), random_.below(5));
    const integer::Point here = random_.oneIn(2) ? b[0] : between(b[0], b[1], random_.below(5));
    for (integer::Point& p : pair.second)
      p = {p.x + there.x - here.x, p.y + there.y - here.y, p.z + there.z - here.z};
  }

  RandomGeometry random_;
};

}  // namespace adaptive_bvh_test
