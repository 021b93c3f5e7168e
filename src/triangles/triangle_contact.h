#pragma once

#include <array>

#include <fcl/common/types.h>

namespace adaptive_bvh {

/// The corners of a triangle, by value.
using TrianglePoints = std::array<fcl::Vector3d, 3>;

/// A point of each of two objects.
struct PointPair {
  fcl::Vector3d first, second;
};

/// The point of the triangle nearest to `x`. The triangle may be a segment or a point.
fcl::Vector3d nearestPoint(const TrianglePoints& triangle, const fcl::Vector3d& x);

/// Whether the triangle is so nearly a segment or a point that rounding dominates its normal.
bool isThin(const TrianglePoints& triangle);

/// The fields of FCL's contact, in the frame of the triangles.
struct TriangleContact {
  unsigned count;  ///< number of points: 1 or 2
  fcl::Vector3d points[2];
  fcl::Vector3d normal;
  double depth;
};

/// The contact of two triangles that touch: FCL's, if FCL computes one (FCL needs the planes of
/// both triangles, and points on either side). Otherwise the midpoint of their nearest points, with
/// depth 0 and the normal of one of the triangles or, if both are thin, a direction perpendicular
/// to their edges.
TriangleContact contactOf(const TrianglePoints& a, const TrianglePoints& b);

}  // namespace adaptive_bvh
