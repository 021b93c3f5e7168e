#pragma once

#include <algorithm>
#include <limits>

#include "triangles/convex_distance.h"

namespace adaptive_bvh {

/// All points origin + t direction; the direction has any length but 0.
struct Line {
  fcl::Vector3d origin, direction;
};

/// The part of a line that is in a convex shape: enter <= t <= leave, or nothing.
struct LineInterval {
  double enter = std::numeric_limits<double>::infinity(), leave = -enter;

  static LineInterval all() {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    return {-kInfinity, kInfinity};
  }
  bool isEmpty() const { return !(enter <= leave); }
  LineInterval operator&(const LineInterval& other) const {
    return {std::max(enter, other.enter), std::min(leave, other.leave)};
  }
};

// Of shapes around the origin and along the z axis, as in shape_surface.h.

LineInterval lineInRoundedSegment(const Line& line, double radius, double half);
LineInterval lineInBox(const Line& line, const fcl::Vector3d& half);
/// All y with n y <= d. A line along the plane is in it as a whole or not at all.
LineInterval lineInHalfSpace(const Line& line, const fcl::Vector3d& n, double d);
/// The plane n y = d. A line along the plane does not meet it.
LineInterval lineInPlane(const Line& line, const fcl::Vector3d& n, double d);
LineInterval lineInCylinder(const Line& line, double radius, double half);
/// The base at z = -half, the tip at half.
LineInterval lineInCone(const Line& given, double radius, double half);
LineInterval lineInEllipsoid(const Line& line, const fcl::Vector3d& radii);
/// By planes through farthest points, up to the errors of convexGap.
LineInterval lineInConvexSet(const Line& line, const ConvexSet& set);

}  // namespace adaptive_bvh
