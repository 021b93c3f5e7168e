#pragma once

#include <vector>

#include <fcl/math/bv/AABB.h>

#include "solids/lines.h"
#include "triangles/convex_distance.h"
#include "triangles/surface_chart.h"
#include "triangles/triangle_gap.h"

namespace adaptive_bvh {

/// Where a triangle and a shape touch.
struct ShapeContact {
  fcl::Vector3d position;  ///< a common point, up to rounding
  fcl::Vector3d normal;    ///< from the triangle to the shape, of length 1
  double depth;            ///< the shape moved so far along the normal is apart from the triangle
};

/// The point of a shape's surface that is nearest to a point x, and the shape's outward direction
/// there, of length 1: that from one to the other, and where x is on the surface (nearer than 1e-8
/// of the coordinates), that of the surface; on an edge and on a tip the mean of those around it.
struct ShapeSurface {
  double distance;  ///< of x; negative inside
  fcl::Vector3d nearest, outward;
};

/// What encloses a shape: a box and all that is at most a radius away from it. Of a sphere, a
/// capsule, a box, a plane and a half-space it is the shape itself.
struct ShapeCore {
  /// Takes the coordinates of the box to those of the shape.
  fcl::Matrix3d axes = fcl::Matrix3d::Identity();
  fcl::Vector3d low, high;  ///< infinite where the shape is
  double radius = 0;

  static ShapeCore around(const fcl::Vector3d& half, double radius = 0) {
    ShapeCore core;
    core.low = -half;
    core.high = half;
    core.radius = radius;
    return core;
  }
  bool isBounded() const { return low.allFinite() && high.allFinite(); }
};

/// The part of a surface over a triangle of parameters.
struct SurfacePatch {
  SurfaceChart chart;
  fcl::Vector3d p, q, r;
};

class FlatSolid;
class HullSolid;
class RoundedSegment;

/// A convex shape in its own frame, in double precision: all that queries ask of FCL's shapes. Made
/// by ShapeSolid (shape_solid.h); each type has a file.
class Solid : public ConvexSet {
 public:
  virtual ~Solid() = default;

  /// What encloses the shape: the smallest box along the axes.
  virtual ShapeCore core() const;
  /// The nearest points, of the triangle and of the shape. 0 where they touch, also where the
  /// triangle is inside.
  virtual TriangleGap gap(const TrianglePoints<double>& triangle) const = 0;
  /// Whether the triangle touches the shape, and where. The depth is the least of all motions that
  /// separate.
  virtual bool touches(const TrianglePoints<double>& triangle, ShapeContact& contact) const;
  /// The point of the surface that is nearest to x.
  virtual ShapeSurface surface(const fcl::Vector3d& x) const = 0;
  /// The part of a line that is in the shape.
  virtual LineInterval along(const Line& line) const = 0;
  /// Adds patches that cover the surface; of a plane and a half-space, a square of it. Those of one
  /// chart follow each other; of charts there are at most three.
  virtual void addPatches(std::vector<SurfacePatch>& patches) const = 0;
  /// Every point of the surface is on a ball of this radius inside the shape.
  virtual double rollingRadius() const { return 0; }
  /// A point in a bounded shape.
  virtual fcl::Vector3d inner() const { return fcl::Vector3d::Zero(); }

  /// The shape as one of these types, or null.
  virtual const RoundedSegment* roundedSegment() const { return nullptr; }
  virtual const FlatSolid* flat() const { return nullptr; }
  virtual const HullSolid* hull() const { return nullptr; }
};

/// A shape where it is in the world.
struct PlacedSolid {
  const Solid& solid;
  fcl::Transform3d tf;
};

/// A box along the world's axes around a shape in its place; infinite where the shape is. Of a
/// convex the smallest one, of others that around the core, as in FCL.
fcl::AABBd worldBoxOf(const PlacedSolid& placed);

}  // namespace adaptive_bvh
