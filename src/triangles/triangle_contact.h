#pragma once

#include <array>

#include <fcl/common/types.h>

namespace adaptive_bvh {

/// The corners of a triangle, by value.
template <typename S>
using TrianglePoints = std::array<fcl::Vector3<S>, 3>;

template <typename To, typename From>
TrianglePoints<To> pointsAs(const TrianglePoints<From>& t) {
  return {t[0].template cast<To>(), t[1].template cast<To>(), t[2].template cast<To>()};
}

template <typename S>
struct PointPair {
  fcl::Vector3<S> first, second;
};

/// The point of the triangle that is nearest to `x`. The triangle may be a segment or a point.
template <typename S>
fcl::Vector3<S> nearestPoint(const TrianglePoints<S>& triangle, const fcl::Vector3<S>& x);

/// The nearest points of two triangles, of gapOf.
template <typename S>
PointPair<S> nearestPoints(const TrianglePoints<S>& a, const TrianglePoints<S>& b);

/// Is the triangle so close to a segment or a point that its normal is mostly rounding?
template <typename S>
bool isThin(const TrianglePoints<S>& triangle);

/// The fields of FCL's contact, in the frame of the triangles.
template <typename S>
struct TriangleContact {
  unsigned count;  ///< of points: 1 or 2
  fcl::Vector3<S> points[2];
  fcl::Vector3<S> normal;
  S depth;
};

/// The contact of two triangles that touch: FCL's, if it computes one. (It needs the planes of both
/// triangles, and points on either side.) Else the middle of their nearest points, with depth 0 and
/// the normal of one of them or, when both are thin, a direction across their edges.
template <typename S>
TriangleContact<S> contactOf(const TrianglePoints<S>& a, const TrianglePoints<S>& b);

}  // namespace adaptive_bvh
