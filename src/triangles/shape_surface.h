#pragma once

#include "triangles/convex_distance.h"

namespace adaptive_bvh {

/// The point of a shape's surface that is nearest to a point x, and the shape's outward direction
/// there, of length 1: that from one to the other, and where x is on the surface (nearer than 1e-8
/// of the coordinates), that of the surface; on an edge and on a tip the mean of those around it.
struct ShapeSurface {
  double distance;  ///< of x; negative inside
  fcl::Vector3d nearest, outward;
};

// All around the origin and along the z axis, in the shape's frame.

/// Surface of all points at most `radius` from a segment from z = -half to half.
ShapeSurface surfaceOfRoundedSegment(const fcl::Vector3d& x, double radius, double half);
/// Surface of a box, by half its sides.
ShapeSurface surfaceOfBox(const fcl::Vector3d& x, const fcl::Vector3d& half);
/// Surface of all y with n y <= d, n of length 1. The plane n y = d has no inside: its direction
/// points away from it, and is n for points on it.
ShapeSurface surfaceOfHalfSpace(const fcl::Vector3d& x, const fcl::Vector3d& n, double d);
ShapeSurface surfaceOfPlane(const fcl::Vector3d& x, const fcl::Vector3d& n, double d);
/// Surface of a cylinder from z = -half to half.
ShapeSurface surfaceOfCylinder(const fcl::Vector3d& x, double radius, double half);
/// Surface of a cone with its base at z = -half and its tip at half.
ShapeSurface surfaceOfCone(const fcl::Vector3d& x, double radius, double half);
/// Surface of an ellipsoid, by D. Eberly's equation, "Distance from a Point to an Ellipse, an
/// Ellipsoid, or a Hyperellipsoid", which no shape and no point makes imprecise.
ShapeSurface surfaceOfEllipsoid(const fcl::Vector3d& x, const fcl::Vector3d& radii);
/// Surface of a convex set, by its farthest points, up to the errors of convex_distance.h: outside
/// by convexGap, inside by penetrationOf.
ShapeSurface surfaceOfConvexSet(const fcl::Vector3d& x, const ConvexSet& set);

/// A point and an ellipsoid with its axes along the coordinates, in numbers that no size and no
/// ratio of the radii makes imprecise.
struct ScaledEllipsoid {
  int shortest;             ///< axis
  fcl::Vector3d z;          ///< the point's distances from the middle, each by the radius there
  fcl::Vector3d r, excess;  ///< squares of the radii, by that of the shortest; less 1

  ScaledEllipsoid(const fcl::Vector3d& x, const fcl::Vector3d& radii) {
    const double least = radii.minCoeff(&shortest);
    z = x.cwiseAbs().cwiseQuotient(radii);
    for (int k = 0; k < 3; ++k) {
      r[k] = (radii[k] / least) * (radii[k] / least);
      excess[k] = (radii[k] - least) / least * ((radii[k] + least) / least);
    }
  }
};

}  // namespace adaptive_bvh
