#include "triangles/triangle_contact.h"

#include <cmath>

#include <fcl/narrowphase/detail/traversal/collision/intersect.h>

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
  feature_distance::Face<S>(t).nearest(x, nearest);
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
  contact.count = 0;
  const bool thin = isThin(a) || isThin(b);  // then FCL would read a plane that it did not set
  if (!thin &&
      fcl::detail::Intersect<S>::intersect_Triangle(a[0], a[1], a[2], b[0], b[1], b[2],
                                                    contact.points, &contact.count, &contact.depth,
                                                    &contact.normal) &&
      isComplete(contact))
    return contact;
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
