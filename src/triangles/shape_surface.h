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

/// Of all that is at most `radius` from a segment from z = -half to half.
ShapeSurface surfaceOfRoundedSegment(const fcl::Vector3d& x, double radius, double half);
/// Of a box, of half its sides.
ShapeSurface surfaceOfBox(const fcl::Vector3d& x, const fcl::Vector3d& half);
/// Of all y with n y <= d, n of length 1. Of the plane n y = d, which has no inside, the direction
/// is away from it, and n on it.
ShapeSurface surfaceOfHalfSpace(const fcl::Vector3d& x, const fcl::Vector3d& n, double d);
ShapeSurface surfaceOfPlane(const fcl::Vector3d& x, const fcl::Vector3d& n, double d);
/// Of a cylinder from z = -half to half.
ShapeSurface surfaceOfCylinder(const fcl::Vector3d& x, double radius, double half);
/// Of a cone with its base at z = -half and its tip at half.
ShapeSurface surfaceOfCone(const fcl::Vector3d& x, double radius, double half);
/// Of an ellipsoid, by the equation of D. Eberly, "Distance from a Point to an Ellipse, an
/// Ellipsoid, or a Hyperellipsoid", which no shape and no point makes imprecise.
ShapeSurface surfaceOfEllipsoid(const fcl::Vector3d& x, const fcl::Vector3d& radii);
/// Of a convex set, by its farthest points, up to the errors of convex_distance.h: outside by
/// convexGap, inside by penetrationOf.
ShapeSurface surfaceOfConvexSet(const fcl::Vector3d& x, const ConvexSet& set);

}  // namespace adaptive_bvh
