#pragma once

#include <vector>

#include <fcl/math/bv/AABB.h>

#include "solids/lines.h"
#include "triangles/convex_distance.h"
#include "triangles/surface_chart.h"
#include "triangles/triangle_gap.h"

namespace adaptive_bvh {

/// The contact of a triangle and a shape.
struct ShapeContact {
  fcl::Vector3d position;  ///< a common point, up to rounding
  fcl::Vector3d normal;    ///< unit vector from the triangle to the shape
  double depth;            ///< translating the shape by this along the normal separates the two
};

/// The point of a shape's surface nearest to a point x, and the unit outward direction there: the
/// direction between the two points, or, if x is on the surface (nearer than 1e-8 of the
/// coordinates), the surface's normal; on edges and tips the mean of the adjacent normals.
struct ShapeSurface {
  double distance;  ///< signed distance of x, negative inside
  fcl::Vector3d nearest, outward;
};

/// An enclosing volume of a shape: all points within a radius of a box. It equals the shape for a
/// sphere, a capsule, a box, a plane and a half-space.
struct ShapeCore {
  /// Rotation from the box's coordinates to the shape's.
  fcl::Matrix3d axes = fcl::Matrix3d::Identity();
  fcl::Vector3d low, high;  ///< infinite if the shape is
  double radius = 0;

  /// The core with a box around the origin, given by half its sides.
  static ShapeCore around(const fcl::Vector3d& half, double radius = 0) {
    ShapeCore core;
    core.low = -half;
    core.high = half;
    core.radius = radius;
    return core;
  }
  bool isBounded() const { return low.allFinite() && high.allFinite(); }
};

/// The part of a surface over a triangle p, q, r of parameters.
struct SurfacePatch {
  SurfaceChart chart;
  fcl::Vector3d p, q, r;
};

class FlatSolid;
class HullSolid;
class RoundedSegment;

/// A convex shape in its own frame, in double precision: the interface through which queries use
/// FCL's shapes. ShapeSolid makes it (shape_solid.h); each type has its own file.
class Solid : public ConvexSet {
 public:
  virtual ~Solid() = default;

  /// An enclosing volume; by default the smallest axis-aligned box.
  virtual ShapeCore core() const;
  /// The nearest points of the triangle (first) and the shape. The distance is 0 if they touch,
  /// also if the triangle is inside.
  virtual TriangleGap gap(const TrianglePoints& triangle) const = 0;
  /// Whether the triangle touches the shape; if so, sets the contact. Its depth is the length of
  /// the shortest translation that separates them.
  virtual bool touches(const TrianglePoints& triangle, ShapeContact& contact) const;
  /// The surface point nearest to x.
  virtual ShapeSurface surface(const fcl::Vector3d& x) const = 0;
  /// The interval of a line inside the shape.
  virtual LineInterval lineInside(const Line& line) const = 0;
  /// Adds patches that cover the surface; for a plane or a half-space, a square of it. Patches of
  /// one chart are contiguous; there are at most three charts.
  virtual void addPatches(std::vector<SurfacePatch>& patches) const = 0;
  /// A radius such that every surface point is on a ball of this radius inside the shape.
  virtual double rollingRadius() const { return 0; }
  /// A point inside a bounded shape.
  virtual fcl::Vector3d innerPoint() const { return fcl::Vector3d::Zero(); }

  /// Downcasts: the shape as one of these types, or null.
  virtual const RoundedSegment* roundedSegment() const { return nullptr; }
  virtual const FlatSolid* flat() const { return nullptr; }
  virtual const HullSolid* hull() const { return nullptr; }
};

/// A shape with its pose in the world.
struct PlacedSolid {
  const Solid& solid;
  fcl::Transform3d tf;
};

/// An axis-aligned world box around a placed shape; infinite if the shape is. For a convex the
/// smallest box, for other shapes the box around the core, as in FCL.
fcl::AABBd worldBoxOf(const PlacedSolid& placed);

}  // namespace adaptive_bvh
