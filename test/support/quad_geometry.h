#pragma once

#include <algorithm>
#include <array>
#include <cfloat>
#include <cmath>

#include <Eigen/Core>

namespace adaptive_bvh_test {

/// The judge of distances of two triangles: the textbook's way (normals, determinants, signs of
/// volumes) in quadruple precision, where needles and nearly parallel edges of doubles have 60 bits
/// to spare. It shares no code with the library, nor with FCL.
namespace quad {

#if LDBL_MANT_DIG >= 113
using Real = long double;
#else
__extension__ typedef __float128 Real;
#endif

struct Point {
  Real x, y, z;
};
using Triangle = std::array<Point, 3>;

inline Point operator+(const Point& a, const Point& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Point operator-(const Point& a, const Point& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Point operator*(Real s, const Point& a) { return {s * a.x, s * a.y, s * a.z}; }
inline Real dot(const Point& a, const Point& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Point cross(const Point& a, const Point& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline Real absolute(Real x) { return x < 0 ? -x : x; }
/// By Newton's method, from double precision on.
inline Real root(Real x) {
  if (!(x > 0)) return 0;
  Real r = Real(std::sqrt(static_cast<double>(x)));
  if (!(r > 0)) r = x;  // below the range of double
  for (int i = 0; i < 3; ++i) r = (r + x / r) / 2;
  return r;
}
inline Real size(const Point& a) { return std::max({absolute(a.x), absolute(a.y), absolute(a.z)}); }

inline Point of(const Eigen::Matrix<double, 3, 1>& p) {
  return {Real(p[0]), Real(p[1]), Real(p[2])};
}

/// Squared sines up to this are rounding of positions that were computed in quadruple precision.
constexpr Real kParallel = 1e-56;

inline Real squaredDistance(const Point& x, const Point& a, const Point& b) {
  const Point u = b - a;
  const Real square = dot(u, u);
  const Real t =
      square > 0 ? std::min(std::max(dot(x - a, u) / square, Real(0)), Real(1)) : Real(0);
  const Point away = x - a - t * u;
  return dot(away, away);
}
inline Real squaredDistance(const Point& x, const Triangle& t) {
  Real least = squaredDistance(x, t[0], t[1]);
  least = std::min(least, squaredDistance(x, t[1], t[2]));
  least = std::min(least, squaredDistance(x, t[2], t[0]));
  const Point u = t[1] - t[0], v = t[2] - t[0], normal = cross(u, v);
  const Real square = dot(normal, normal);
  if (!(square > kParallel * dot(u, u) * dot(v, v))) return least;
  for (std::size_t k = 0; k < 3; ++k)
    if (dot(normal, cross(t[(k + 1) % 3] - t[k], x - t[k])) < 0) return least;
  const Real height = dot(normal, x - t[0]);
  return std::min(least, height * height / square);
}
/// Where both nearest points of the lines lie inside, else nothing: the ends are vertices.
inline Real squaredDistanceInside(const Point& a, const Point& b, const Point& c, const Point& d) {
  const Point u = b - a, v = d - c, w = c - a, normal = cross(u, v);
  const Real square = dot(normal, normal);
  if (!(square > kParallel * dot(u, u) * dot(v, v))) return Real(-1);
  const Real s = dot(cross(w, v), normal) / square, t = dot(cross(w, u), normal) / square;
  if (s < 0 || s > 1 || t < 0 || t > 1) return Real(-1);
  const Real height = dot(w, normal);
  return height * height / square;
}

/// Six times the signed volume as its edges from d give it; 0 where it is mostly rounding.
inline Real volumeFrom(const Point& d, const Point& a, const Point& b, const Point& c) {
  const Point u = a - d, v = b - d, w = c - d;
  const Real volume = dot(u, cross(v, w)), rounding = size(u) * size(v) * size(w) * Real(0x1p-106);
  return absolute(volume) <= rounding ? Real(0) : volume;
}
/// Six times the signed volume; 0 where it is mostly rounding from each of the corners: a corner
/// whose edges are all long leaves nothing of the others' short edge.
inline Real volume(const Point& a, const Point& b, const Point& c, const Point& d) {
  Real volume = volumeFrom(d, a, b, c);
  if (volume == 0) volume = -volumeFrom(a, d, b, c);
  if (volume == 0) volume = -volumeFrom(b, a, d, c);
  if (volume == 0) volume = -volumeFrom(c, a, b, d);
  return volume;
}
/// Whether a segment that does not lie in the triangle's plane meets the triangle.
inline bool meets(const Point& p, const Point& q, const Triangle& t) {
  const Real above = volume(t[0], t[1], t[2], p), below = volume(t[0], t[1], t[2], q);
  if ((above > 0 && below > 0) || (above < 0 && below < 0) || (above == 0 && below == 0))
    return false;
  bool is_left = false, is_right = false;
  for (std::size_t k = 0; k < 3; ++k) {
    const Real side = volume(p, q, t[k], t[(k + 1) % 3]);
    is_left = is_left || side > 0;
    is_right = is_right || side < 0;
  }
  return is_left != is_right;
}

inline Real distance(const Triangle& a, const Triangle& b) {
  Real least = squaredDistance(a[0], b);
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t next = (i + 1) % 3;
    if (meets(a[i], a[next], b) || meets(b[i], b[next], a)) return 0;
    least = std::min({least, squaredDistance(a[i], b), squaredDistance(b[i], a)});
    for (std::size_t j = 0; j < 3; ++j) {
      const Real inside = squaredDistanceInside(a[i], a[next], b[j], b[(j + 1) % 3]);
      if (inside >= 0) least = std::min(least, inside);
    }
  }
  return root(least);
}
/// Whether they have a common point, or are so near that 113 bits do not decide.
inline bool touch(const Triangle& a, const Triangle& b) {
  Real extent = 0;
  for (const Triangle* t : {&a, &b})
    for (const Point& x : *t) extent = std::max(extent, size(x - a[0]));
  return distance(a, b) <= extent * Real(0x1p-90);
}
inline Real distance(const Point& x, const Triangle& t) { return root(squaredDistance(x, t)); }

}  // namespace quad
}  // namespace adaptive_bvh_test
