#pragma once

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <stdexcept>
#include <string>

#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/cone.h>
#include <fcl/geometry/shape/convex.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/ellipsoid.h>
#include <fcl/geometry/shape/halfspace.h>
#include <fcl/geometry/shape/plane.h>
#include <fcl/geometry/shape/sphere.h>

#include "base/rigid.h"
#include "base/rounding.h"
#include "query/contacts.h"
#include "triangles/convex_distance.h"
#include "triangles/triangle_shape.h"

namespace adaptive_bvh {

/// What encloses a shape: a box and all that is at most a radius away from it. Of a sphere, a
/// capsule, a box, a plane and a half-space it is the shape itself.
struct ShapeCore {
  /// Takes the coordinates of the box to those of the shape.
  fcl::Matrix3d axes = fcl::Matrix3d::Identity();
  fcl::Vector3d low, high;  ///< infinite where the shape is
  double radius = 0;

  bool isBounded() const { return low.allFinite() && high.allFinite(); }
};

/// All x with least <= n x <= most.
inline ShapeCore coreOfSlab(const fcl::Vector3d& n, double least, double most) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const double length = n.norm();
  ShapeCore core;
  core.axes = Eigen::Quaterniond::FromTwoVectors(fcl::Vector3d::UnitX(), n).toRotationMatrix();
  core.low = fcl::Vector3d(least / length, -kInfinity, -kInfinity);
  core.high = fcl::Vector3d(most / length, kInfinity, kInfinity);
  return core;
}

/// Distances from here on do not matter, as FCL prunes.
template <typename S>
double limitOf(const DistanceQuery<S>& query) {
  const S found = query.result.min_distance;
  return static_cast<double>(
      std::max(found - query.request.abs_err, found / (1 + query.request.rel_err)));
}

/// The triangles of an object of a query, as a shape sees them.
template <typename S, typename P = S>
class ShapeTriangles {
 public:
  ShapeTriangles(const PlacedTriangles<S, P>& triangles, int count, const TriangleShape& shape,
                 const fcl::Transform3<S>& shape_tf)
      : triangles_(triangles),
        count_(count),
        shape_(shape),
        shape_tf_(shape_tf),
        to_shape_(shape_tf, triangles.tf) {}

  const PlacedTriangles<S, P>& placed() const { return triangles_; }
  int count() const { return count_; }
  const TriangleShape& shape() const { return shape_; }
  /// In the shape's frame.
  TrianglePoints<double> corners(int triangle) const {
    const TrianglePoints<double> points = triangles_[triangle];
    return {to_shape_(points[0]), to_shape_(points[1]), to_shape_(points[2])};
  }
  TriangleGap gap(int triangle) const { return shape_.gap(corners(triangle)); }
  bool touches(int triangle, ShapeContact& contact) const {
    return shape_.touches(corners(triangle), contact);
  }
  /// Whether no triangle is nearer than `distance`, up to rounding, along the line between the
  /// nearest points of one and the shape or, if that is nearly the same, along the normal of the
  /// triangle. No where that could hide a touch.
  bool areSeparated(int triangle, const PointPair<double>& nearest, double distance) const {
    constexpr double kNearly = 0.999;
    const DistanceRounding rounded = rounding(nearest);
    if (!rounded.isClear(distance)) return false;
    const double least = rounded.below(distance);
    const fcl::Vector3d line = (nearest.first - nearest.second).stableNormalized();
    const TrianglePoints<double> x = corners(triangle);
    const fcl::Vector3d normal = (x[1] - x[0]).cross(x[2] - x[0]).stableNormalized();
    const double cosine = normal.dot(line);
    return areApart(line, least) ||
           (std::abs(cosine) > kNearly && areApart(cosine > 0 ? normal : -normal, least));
  }
  /// Of the distances of all, where these are the nearest points of one and the shape.
  DistanceRounding rounding(const PointPair<double>& nearest) const {
    const auto& geometry = *triangles_.geometry;
    return DistanceRounding(2 * nearest.first.template lpNorm<1>() +
                            nearest.second.template lpNorm<1>() +
                            4 * geometry.aabb_center.template cast<double>().template lpNorm<1>() +
                            8 * double(geometry.aabb_radius));
  }
  fcl::Vector3<S> inWorld(const fcl::Vector3d& x) const {
    return (shape_tf_.template cast<double>() * x).template cast<S>();
  }
  fcl::Vector3<S> turnedToWorld(const fcl::Vector3d& direction) const {
    return (shape_tf_.linear().template cast<double>() * direction).template cast<S>();
  }

 private:
  /// Whether all triangles are at least so far from the shape along a direction of length 1, in its
  /// frame. A few of them come first: they often say so.
  bool areApart(fcl::Vector3d along, double least) const {
    double reach;
    if (const FlatShape* const flat = shape_.flat()) {
      const double side = flat->normal().dot(along) < 0 ? -1 : 1;
      along = side * flat->normal();
      reach = side * flat->offset();
    } else {
      reach = along.dot(shape_.support(along));
    }
    const fcl::Vector3d in_mesh = to_shape_.R.transpose() * along;
    const double from = reach + least - along.dot(to_shape_.T);
    constexpr int kFew = 32;  // one of so many
    for (const int stride : {kFew, 1})
      for (int i = 0; i < count_; i += stride)
        for (const fcl::Vector3d& x : triangles_[i])
          if (!(in_mesh.dot(x) >= from)) return false;
    return true;
  }

  const PlacedTriangles<S, P> triangles_;
  const int count_;
  const TriangleShape& shape_;
  const fcl::Transform3<S> shape_tf_;
  const RelativePlacement to_shape_;
};

namespace shape_sets {

using Point = fcl::Vector3d;

/// The point of a circle around the z axis that is farthest along a direction.
inline Point onCircle(const Point& direction, double radius, double z) {
  const double length = std::hypot(direction[0], direction[1]);
  if (!(length > 0)) return {radius, 0, z};
  return {radius * (direction[0] / length), radius * (direction[1] / length), z};
}

struct Cylinder final : RoundSet {
  double radius, half;
  Cylinder(double r, double h) : radius(r), half(h) {}
  Point support(const Point& direction) const override {
    return onCircle(direction, radius, direction[2] < 0 ? -half : half);
  }
  ShapeSurface surface(const Point& x) const override { return surfaceOfCylinder(x, radius, half); }
  LineInterval along(const Line& line) const override { return lineInCylinder(line, radius, half); }
  Penetration penetration(const TrianglePoints<double>& triangle) const override {
    return cylinderPenetration(triangle, radius, half);
  }
};
/// Its apex is at z = half, its base at -half.
struct Cone final : RoundSet {
  double radius, half;
  Cone(double r, double h) : radius(r), half(h) {}
  Point support(const Point& direction) const override {
    const Point apex(0, 0, half), on_base = onCircle(direction, radius, -half);
    return direction.dot(apex) > direction.dot(on_base) ? apex : on_base;
  }
  ShapeSurface surface(const Point& x) const override { return surfaceOfCone(x, radius, half); }
  LineInterval along(const Line& line) const override { return lineInCone(line, radius, half); }
  Penetration penetration(const TrianglePoints<double>& triangle) const override {
    return conePenetration(triangle, radius, half);
  }
};
struct Ellipsoid final : RoundSet {
  Point radii;
  explicit Ellipsoid(const Point& r) : radii(r) {}
  Point support(const Point& direction) const override {
    const Point scaled = radii.cwiseProduct(direction / direction.lpNorm<Eigen::Infinity>());
    const double length = scaled.norm();
    return length > 0 ? Point(radii.cwiseProduct(scaled / length)) : radii;
  }
  ShapeSurface surface(const Point& x) const override { return surfaceOfEllipsoid(x, radii); }
  LineInterval along(const Line& line) const override { return lineInEllipsoid(line, radii); }
  Penetration penetration(const TrianglePoints<double>& triangle) const override {
    return ellipsoidPenetration(triangle, radii);
  }
};
/// The hull of the vertices. Its faces, as users list them, are not needed.
template <typename S>
struct Hull final : ConvexSet {
  const std::vector<fcl::Vector3<S>>& vertices;
  explicit Hull(const std::vector<fcl::Vector3<S>>& v) : vertices(v) {}
  Point support(const Point& direction) const override {
    const fcl::Vector3<S>* best = &vertices[0];
    double most = direction.dot(best->template cast<double>());
    for (const fcl::Vector3<S>& x : vertices) {
      const double along = direction.dot(x.template cast<double>());
      if (along > most) most = along, best = &x;
    }
    return best->template cast<double>();
  }
};

/// The smallest box of a set along the axes.
inline ShapeCore coreOf(const ConvexSet& set) {
  ShapeCore core;
  for (int k = 0; k < 3; ++k) {
    core.low[k] = set.support(-Point::Unit(k))[k];
    core.high[k] = set.support(Point::Unit(k))[k];
  }
  return core;
}
inline ShapeCore coreAround(const Point& half, double radius) {
  ShapeCore core;
  core.low = -half;
  core.high = half;
  core.radius = radius;
  return core;
}

/// Throws std::invalid_argument where products of a shape's lengths would underflow.
inline void requireSize(const ShapeCore& core) {
  const double size = core.low.cwiseAbs().cwiseMax(core.high.cwiseAbs()).maxCoeff() + core.radius;
  if (size > 0 && size < rounding::shortLength<double>())
    throw std::invalid_argument(
        "adaptive_bvh: a shape is smaller than 2^-204 (3.9e-62) in all directions; choose a larger "
        "unit of length");
}

}  // namespace shape_sets

/// Throws std::invalid_argument where a size of a shape is not positive, or not finite: FCL makes
/// such shapes without a word. Every query of a shape calls this, most by visitShape.
template <typename S>
void requireSizes(const fcl::CollisionGeometry<S>& shape) {
  const auto require = [](std::initializer_list<S> sizes, const char* name) {
    for (const S size : sizes)
      if (!(size > 0) || !std::isfinite(size))
        throw std::invalid_argument("adaptive_bvh: a size of a " + std::string(name) + " is " +
                                    std::to_string(size) + "; it must be positive and finite");
  };
  switch (shape.getNodeType()) {
    case fcl::GEOM_SPHERE:
      return require({static_cast<const fcl::Sphere<S>&>(shape).radius}, "sphere");
    case fcl::GEOM_CAPSULE: {
      const auto& of = static_cast<const fcl::Capsule<S>&>(shape);
      return require({of.radius, of.lz}, "capsule");
    }
    case fcl::GEOM_BOX: {
      const auto& side = static_cast<const fcl::Box<S>&>(shape).side;
      return require({side[0], side[1], side[2]}, "box");
    }
    case fcl::GEOM_CYLINDER: {
      const auto& of = static_cast<const fcl::Cylinder<S>&>(shape);
      return require({of.radius, of.lz}, "cylinder");
    }
    case fcl::GEOM_CONE: {
      const auto& of = static_cast<const fcl::Cone<S>&>(shape);
      return require({of.radius, of.lz}, "cone");
    }
    case fcl::GEOM_ELLIPSOID: {
      const auto& radii = static_cast<const fcl::Ellipsoid<S>&>(shape).radii;
      return require({radii[0], radii[1], radii[2]}, "ellipsoid");
    }
    default: return;
  }
}

/// Calls take(TriangleShape, ShapeCore) with the geometry of a shape of FCL's. Throws
/// std::invalid_argument on others, on shapes that are too small, and where requireSizes does.
template <typename S, typename Take>
void visitShape(const fcl::CollisionGeometry<S>& shape, const Take& take) {
  using namespace shape_sets;
  const auto visit = [&](const TriangleShape& triangle_shape, const ShapeCore& core) {
    requireSize(core);
    take(triangle_shape, core);
  };
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  requireSizes(shape);
  const auto visitRound = [&](const RoundSet& set) { visit(RoundShape(set), coreOf(set)); };
  const auto visitSegment = [&](S radius, S length) {
    const double half = double(length) / 2;
    visit(RoundedSegment(double(radius), half), coreAround(Point(0, 0, half), double(radius)));
  };
  switch (shape.getNodeType()) {
    case fcl::GEOM_SPHERE: return visitSegment(static_cast<const fcl::Sphere<S>&>(shape).radius, 0);
    case fcl::GEOM_CAPSULE: {
      const auto& capsule = static_cast<const fcl::Capsule<S>&>(shape);
      return visitSegment(capsule.radius, capsule.lz);
    }
    case fcl::GEOM_BOX: {
      const Point half = static_cast<const fcl::Box<S>&>(shape).side.template cast<double>() / 2;
      return visit(BoxShape(half), coreAround(half, 0));
    }
    case fcl::GEOM_CYLINDER: {
      const auto& cylinder = static_cast<const fcl::Cylinder<S>&>(shape);
      return visitRound(Cylinder(double(cylinder.radius), double(cylinder.lz) / 2));
    }
    case fcl::GEOM_CONE: {
      const auto& cone = static_cast<const fcl::Cone<S>&>(shape);
      return visitRound(Cone(double(cone.radius), double(cone.lz) / 2));
    }
    case fcl::GEOM_ELLIPSOID:
      return visitRound(
          Ellipsoid(static_cast<const fcl::Ellipsoid<S>&>(shape).radii.template cast<double>()));
    case fcl::GEOM_CONVEX: {
      const Hull<S> hull(static_cast<const fcl::Convex<S>&>(shape).getVertices());
      return visit(HullShape(hull), coreOf(hull));
    }
    case fcl::GEOM_PLANE: {
      const auto& plane = static_cast<const fcl::Plane<S>&>(shape);
      const Point n = plane.n.template cast<double>();
      const double d = double(plane.d), length = n.norm();
      return visit(FlatShape(n / length, d / length, false), coreOfSlab(n, d, d));
    }
    case fcl::GEOM_HALFSPACE: {
      const auto& half_space = static_cast<const fcl::Halfspace<S>&>(shape);
      const Point n = half_space.n.template cast<double>();
      const double d = double(half_space.d), length = n.norm();
      return visit(FlatShape(n / length, d / length, true), coreOfSlab(n, -kInfinity, d));
    }
    default:
      throw std::invalid_argument(
          "adaptive_bvh: there is no query between a mesh and a geometry of this type");
  }
}

}  // namespace adaptive_bvh
