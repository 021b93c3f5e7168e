#pragma once

#include "fcl/shape_geometry.h"
#include "triangles/shape_surface.h"

namespace adaptive_bvh {

/// Calls visit(surface), where surface(x) is the ShapeSurface of a point in the frame of a shape of
/// FCL's. Throws std::invalid_argument on other geometry.
template <typename S, typename Visit>
void visitSurface(const fcl::CollisionGeometry<S>& shape, const Visit& visit) {
  using Point = fcl::Vector3d;
  const auto visitSegment = [&](double radius, double length) {
    visit([=](const Point& x) { return surfaceOfRoundedSegment(x, radius, length / 2); });
  };
  switch (shape.getNodeType()) {
    case fcl::GEOM_SPHERE:
      return visitSegment(double(static_cast<const fcl::Sphere<S>&>(shape).radius), 0);
    case fcl::GEOM_CAPSULE: {
      const auto& capsule = static_cast<const fcl::Capsule<S>&>(shape);
      return visitSegment(double(capsule.radius), double(capsule.lz));
    }
    case fcl::GEOM_BOX: {
      const Point half = static_cast<const fcl::Box<S>&>(shape).side.template cast<double>() / 2;
      return visit([=](const Point& x) { return surfaceOfBox(x, half); });
    }
    case fcl::GEOM_CYLINDER: {
      const auto& cylinder = static_cast<const fcl::Cylinder<S>&>(shape);
      const double radius = double(cylinder.radius), half = double(cylinder.lz) / 2;
      return visit([=](const Point& x) { return surfaceOfCylinder(x, radius, half); });
    }
    case fcl::GEOM_CONE: {
      const auto& cone = static_cast<const fcl::Cone<S>&>(shape);
      const double radius = double(cone.radius), half = double(cone.lz) / 2;
      return visit([=](const Point& x) { return surfaceOfCone(x, radius, half); });
    }
    case fcl::GEOM_ELLIPSOID: {
      const Point radii =
          static_cast<const fcl::Ellipsoid<S>&>(shape).radii.template cast<double>();
      return visit([=](const Point& x) { return surfaceOfEllipsoid(x, radii); });
    }
    case fcl::GEOM_CONVEX: {
      const shape_sets::Hull<S> hull(static_cast<const fcl::Convex<S>&>(shape).getVertices());
      return visit([&](const Point& x) { return surfaceOfConvexSet(x, hull); });
    }
    case fcl::GEOM_PLANE: {
      const auto& plane = static_cast<const fcl::Plane<S>&>(shape);
      const Point n = plane.n.template cast<double>();
      const double d = double(plane.d), length = n.norm();
      return visit([&](const Point& x) { return surfaceOfPlane(x, n / length, d / length); });
    }
    case fcl::GEOM_HALFSPACE: {
      const auto& solid = static_cast<const fcl::Halfspace<S>&>(shape);
      const Point n = solid.n.template cast<double>();
      const double d = double(solid.d), length = n.norm();
      return visit([&](const Point& x) { return surfaceOfHalfSpace(x, n / length, d / length); });
    }
    default:
      throw std::invalid_argument(
          "adaptive_bvh: there are no contacts of vertices with a geometry of this type");
  }
}

}  // namespace adaptive_bvh
