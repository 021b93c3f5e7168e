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
fcl::Vector3d nearestPoint(const TrianglePoints<double>& triangle, const fcl::Vector3d& x);

/// Is the triangle so close to a segment or a point that its normal is mostly rounding?
bool isThin(const TrianglePoints<double>& triangle);

/// The fields of FCL's contact, in the frame of the triangles.
struct TriangleContact {
  unsigned count;  ///< of points: 1 or 2
  fcl::Vector3d points[2];
  fcl::Vector3d normal;
  double depth;
};

/// The contact of two triangles that touch: FCL's, if it computes one. (It needs the planes of both
/// triangles, and points on either side.) Else the middle of their nearest points, with depth 0 and
/// the normal of one of them or, when both are thin, a direction across their edges.
TriangleContact contactOf(const TrianglePoints<double>& a, const TrianglePoints<double>& b);

}  // namespace adaptive_bvh
