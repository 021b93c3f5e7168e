#include "triangles/triangle_contact.h"

#include <cmath>
#include <limits>

#include "base/rounding.h"
#include "triangles/feature_distance.h"
#include "triangles/triangle_gap.h"

namespace adaptive_bvh {
namespace {

template <typename S>
using Point = fcl::Vector3<S>;

template <typename S>
Point<S> normalOf(const TrianglePoints<S>& t) {
  return (t[1] - t[0]).cross(t[2] - t[0]);
}

template <typename S>
Point<S> longestEdge(const TrianglePoints<S>& t) {
  Point<S> longest = t[1] - t[0];
  for (const Point<S>& edge : {Point<S>(t[2] - t[1]), Point<S>(t[0] - t[2])})
    if (edge.squaredNorm() > longest.squaredNorm()) longest = edge;
  return longest;
}

template <typename S>
Point<S> anyNormal(const TrianglePoints<S>& a, const TrianglePoints<S>& b) {
  if (!isThin(a)) return normalOf(a).stableNormalized();
  if (!isThin(b)) return -normalOf(b).stableNormalized();
  const Point<S> e = longestEdge(a), f = longestEdge(b), across = e.cross(f);
  if (across.norm() > rounding::epsilon<S>() * 64 * e.norm() * f.norm())
    return across.stableNormalized();
  if (!e.isZero(0)) return e.stableNormalized().unitOrthogonal();
  return f.isZero(0) ? Point<S>::UnitZ() : f.stableNormalized().unitOrthogonal();
}

/// The plane of a triangle that is not thin: n x = t, n of length 1.
template <typename S>
struct Plane {
  explicit Plane(const TrianglePoints<S>& triangle) : n(normalOf(triangle).normalized()) {
    t = n.dot(triangle[0]);
  }
  Point<S> n;
  S t;
};

/// The corners of a triangle that are deepest below a plane; none where all lie on one side.
template <typename S>
struct Deepest {
  Deepest(const TrianglePoints<S>& triangle, const Plane<S>& plane) {
    constexpr double kOn = 1e-5, kAsDeep = 1e-6;  // FCL's
    bool is_above = true, is_below = true;
    for (const Point<S>& x : triangle) {
      const S below = plane.t - plane.n.dot(x);
      is_above = is_above && double(below) < -kOn;
      is_below = is_below && double(below) > kOn;
      if (below > depth) {
        depth = below;
        count = 0;
      } else if (!(double(below) + kAsDeep >= double(depth))) {
        continue;
      }
      if (count < 2) points[count++] = x;
    }
    if (is_above || is_below) count = 0;
  }

  S depth = std::numeric_limits<S>::lowest();
  unsigned count = 0;
  Point<S> points[2];
};

/// FCL's contact of two triangles that meet, neither of them thin: the corners of one that are
/// deepest below the plane of the other, where that is less deep. No points where rounding hides
/// that they meet.
template <typename S>
TriangleContact<S> contactByPlanes(const TrianglePoints<S>& a, const TrianglePoints<S>& b) {
  const Plane<S> of_a(a), of_b(b);
  const Deepest<S> of_first(a, of_b), of_second(b, of_a);
  const bool is_second = of_first.depth > of_second.depth;
  const Deepest<S>& deepest = is_second ? of_second : of_first;
  return {deepest.count,
          {deepest.points[0], deepest.points[1]},
          is_second ? of_a.n : Point<S>(-of_b.n),
          deepest.depth};
}

template <typename S>
bool isComplete(const TriangleContact<S>& contact) {
  bool finite = contact.normal.allFinite() && std::isfinite(contact.depth);
  for (unsigned i = 0; i < contact.count; ++i) finite = finite && contact.points[i].allFinite();
  return contact.count > 0 && finite;
}

}  // namespace

template <typename S>
Point<S> nearestPoint(const TrianglePoints<S>& t, const Point<S>& x) {
  Point<S> nearest;
  feature_distance::Face<S>(t).distance(x, nearest);
  return nearest;
}

template <typename S>
PointPair<S> nearestPoints(const TrianglePoints<S>& a, const TrianglePoints<S>& b) {
  const PointPair<double> nearest = gapOf(pointsAs<double>(a), pointsAs<double>(b)).points;
  return {nearest.first.template cast<S>(), nearest.second.template cast<S>()};
}

/// The sine of the angle between the edges, times their lengths over the longest one's: below the
/// root of epsilon the normal's direction is off by as much as the triangle is wide.
template <typename S>
bool isThin(const TrianglePoints<S>& t) {
  return normalOf(t).norm() <= std::sqrt(rounding::epsilon<S>()) * longestEdge(t).squaredNorm();
}

template <typename S>
TriangleContact<S> contactOf(const TrianglePoints<S>& a, const TrianglePoints<S>& b) {
  TriangleContact<S> contact;
  if (!isThin(a) && !isThin(b)) {
    contact = contactByPlanes(a, b);
    if (isComplete(contact)) return contact;
  }
  const PointPair<S> nearest = nearestPoints(a, b);
  contact.count = 1;
  contact.points[0] = contact.points[1] = (nearest.first + nearest.second) / 2;
  contact.normal = anyNormal(a, b);
  contact.depth = 0;
  return contact;
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                        \
  template fcl::Vector3<S> nearestPoint(const TrianglePoints<S>&, const fcl::Vector3<S>&); \
  template PointPair<S> nearestPoints(const TrianglePoints<S>&, const TrianglePoints<S>&); \
  template bool isThin(const TrianglePoints<S>&);                                          \
  template TriangleContact<S> contactOf(const TrianglePoints<S>&, const TrianglePoints<S>&);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
