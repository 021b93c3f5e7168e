#pragma once

#include <array>

#include <fcl/common/types.h>

namespace adaptive_bvh {

/// The corners of a triangle, by value.
template <typename S>
using TrianglePoints = std::array<fcl::Vector3<S>, 3>;

template <typename S>
struct PointPair {
  fcl::Vector3<S> first, second;
};

/// The point of the triangle that is nearest to `x`. Any triangle will do, also a segment or a
/// point.
template <typename S>
fcl::Vector3<S> nearestPoint(const TrianglePoints<S>& triangle, const fcl::Vector3<S>& x);

/// The nearest points of two triangles; of triangles that touch, a common point, twice up to
/// rounding. Slow beside FCL's distance, but without its thresholds on size and area.
template <typename S>
PointPair<S> nearestPoints(const TrianglePoints<S>& a, const TrianglePoints<S>& b);

/// Is the triangle so close to a segment or a point that its normal is mostly rounding?
template <typename S>
bool isThin(const TrianglePoints<S>& triangle);

/// FCL's verdict whether two triangles, given in one frame, intersect. FCL decides by separating
/// axes, of which a thin triangle lacks some: parallel segments touch for it however far apart they
/// are. Such a pair must also be near.
template <typename S>
bool touch(const TrianglePoints<S>& a, const TrianglePoints<S>& b);

/// What FCL says of a contact, in the frame of the triangles.
template <typename S>
struct TriangleContact {
  unsigned count;  ///< of points: 1 or 2
  fcl::Vector3<S> points[2];
  fcl::Vector3<S> normal;
  S depth;
};

/// The contact of two triangles that touch. FCL's own, or where FCL computes none (it needs the
/// planes of both triangles, and points on either side): the middle of their nearest points, the
/// normal of one of them or, when both are thin, one across their edges, and depth 0.
template <typename S>
TriangleContact<S> contactOf(const TrianglePoints<S>& a, const TrianglePoints<S>& b);

}  // namespace adaptive_bvh
