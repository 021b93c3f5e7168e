#pragma once

#include <stdexcept>

#include <fcl/geometry/collision_geometry.h>
#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/cone.h>
#include <fcl/geometry/shape/convex.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/ellipsoid.h>
#include <fcl/geometry/shape/halfspace.h>
#include <fcl/geometry/shape/plane.h>
#include <fcl/geometry/shape/sphere.h>

namespace adaptive_bvh {

/// Calls visit(shape) with a bounded primitive's own type. Throws std::invalid_argument on another.
template <typename S, typename Visit>
auto visitBoundedShape(const fcl::CollisionGeometry<S>& shape, Visit&& visit) {
  switch (shape.getNodeType()) {
    case fcl::GEOM_BOX: return visit(static_cast<const fcl::Box<S>&>(shape));
    case fcl::GEOM_SPHERE: return visit(static_cast<const fcl::Sphere<S>&>(shape));
    case fcl::GEOM_ELLIPSOID: return visit(static_cast<const fcl::Ellipsoid<S>&>(shape));
    case fcl::GEOM_CAPSULE: return visit(static_cast<const fcl::Capsule<S>&>(shape));
    case fcl::GEOM_CONE: return visit(static_cast<const fcl::Cone<S>&>(shape));
    case fcl::GEOM_CYLINDER: return visit(static_cast<const fcl::Cylinder<S>&>(shape));
    case fcl::GEOM_CONVEX: return visit(static_cast<const fcl::Convex<S>&>(shape));
    default:
      throw std::invalid_argument(
          "adaptive_bvh: FCL has no such query between a mesh and this shape (planes and "
          "half-spaces have no distance to a mesh)");
  }
}

/// As visitBoundedShape, and also takes planes and half-spaces.
template <typename S, typename Visit>
auto visitShape(const fcl::CollisionGeometry<S>& shape, Visit&& visit) {
  switch (shape.getNodeType()) {
    case fcl::GEOM_PLANE: return visit(static_cast<const fcl::Plane<S>&>(shape));
    case fcl::GEOM_HALFSPACE: return visit(static_cast<const fcl::Halfspace<S>&>(shape));
    default: return visitBoundedShape(shape, visit);
  }
}

}  // namespace adaptive_bvh
