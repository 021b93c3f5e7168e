#include "solids/shape_solid.h"

#include <algorithm>
#include <cmath>
#include <iterator>
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

#include "base/rounding.h"
#include "solids/box.h"
#include "solids/cone.h"
#include "solids/cylinder.h"
#include "solids/ellipsoid.h"
#include "solids/flat.h"
#include "solids/hull.h"
#include "solids/rounded_segment.h"

namespace adaptive_bvh {
namespace {

/// An FCL shape, and functions that check its sizes and convert them to double precision.
template <typename S>
struct ShapeNumbers {
  const fcl::CollisionGeometry<S>& shape;
  const char* name;  ///< for messages

  template <typename Shape>
  const Shape& as() const {
    return static_cast<const Shape&>(shape);
  }
  double size(S length) const {
    if (!(length > 0) || !std::isfinite(length))
      throw std::invalid_argument("adaptive_bvh: a size of a " + std::string(name) + " is " +
                                  std::to_string(length) + "; it must be positive and finite");
    return static_cast<double>(length);
  }
  fcl::Vector3d sizes(const fcl::Vector3<S>& x) const {
    return {size(x[0]), size(x[1]), size(x[2])};
  }
};

/// A supported type of shape; `read` constructs its Solid.
template <typename S>
struct ShapeRow {
  fcl::NODE_TYPE type;
  const char* name;
  void (*read)(const ShapeNumbers<S>& from, ShapeSolid& to);
};

/// The table of all supported shapes. A new shape is a row.
template <typename S>
const ShapeRow<S> kShapeRows[] = {
    {fcl::GEOM_SPHERE, "sphere",
     [](const ShapeNumbers<S>& from, ShapeSolid& to) {
       to.make<RoundedSegment>(from.size(from.template as<fcl::Sphere<S>>().radius), 0.);
     }},
    {fcl::GEOM_CAPSULE, "capsule",
     [](const ShapeNumbers<S>& from, ShapeSolid& to) {
       const auto& of = from.template as<fcl::Capsule<S>>();
       to.make<RoundedSegment>(from.size(of.radius), from.size(of.lz) / 2);
     }},
    {fcl::GEOM_BOX, "box",
     [](const ShapeNumbers<S>& from, ShapeSolid& to) {
       to.make<BoxSolid>(fcl::Vector3d(from.sizes(from.template as<fcl::Box<S>>().side) / 2));
     }},
    {fcl::GEOM_CYLINDER, "cylinder",
     [](const ShapeNumbers<S>& from, ShapeSolid& to) {
       const auto& of = from.template as<fcl::Cylinder<S>>();
       to.make<CylinderSolid>(from.size(of.radius), from.size(of.lz) / 2);
     }},
    {fcl::GEOM_CONE, "cone",
     [](const ShapeNumbers<S>& from, ShapeSolid& to) {
       const auto& of = from.template as<fcl::Cone<S>>();
       to.make<ConeSolid>(from.size(of.radius), from.size(of.lz) / 2);
     }},
    {fcl::GEOM_ELLIPSOID, "ellipsoid",
     [](const ShapeNumbers<S>& from, ShapeSolid& to) {
       to.make<EllipsoidSolid>(from.sizes(from.template as<fcl::Ellipsoid<S>>().radii));
     }},
    {fcl::GEOM_CONVEX, "convex",
     [](const ShapeNumbers<S>& from, ShapeSolid& to) {
       const auto& of = from.template as<fcl::Convex<S>>();
       const auto& points = of.getVertices();
       to.make<HullSolid>(Points(points.data()), points.size(), of.getFaces(),
                          fcl::Vector3d(of.getInteriorPoint().template cast<double>()));
     }},
    {fcl::GEOM_PLANE, "plane",
     [](const ShapeNumbers<S>& from, ShapeSolid& to) {
       const auto& of = from.template as<fcl::Plane<S>>();
       to.make<FlatSolid>(fcl::Vector3d(of.n.template cast<double>()), double(of.d), false);
     }},
    {fcl::GEOM_HALFSPACE, "half-space", [](const ShapeNumbers<S>& from, ShapeSolid& to) {
       const auto& of = from.template as<fcl::Halfspace<S>>();
       to.make<FlatSolid>(fcl::Vector3d(of.n.template cast<double>()), double(of.d), true);
     }}};

/// The row of a type, or null.
template <typename S>
const ShapeRow<S>* rowOf(fcl::NODE_TYPE type) {
  const auto* const row =
      std::find_if(std::begin(kShapeRows<S>), std::end(kShapeRows<S>),
                   [&](const ShapeRow<S>& other) { return other.type == type; });
  return row == std::end(kShapeRows<S>) ? nullptr : row;
}

}  // namespace

template <typename S>
ShapeSolid::ShapeSolid(const fcl::CollisionGeometry<S>& shape) {
  const ShapeRow<S>* const row = rowOf<S>(shape.getNodeType());
  if (!row)
    throw std::invalid_argument(
        "adaptive_bvh: there is no query between a mesh and a geometry of this type");
  row->read({shape, row->name}, *this);
  core_ = solid_->core();
  const double size =
      core_.low.cwiseAbs().cwiseMax(core_.high.cwiseAbs()).maxCoeff() + core_.radius;
  if (size > 0 && size < rounding::shortLength<double>())
    throw std::invalid_argument(
        "adaptive_bvh: a shape is smaller than 2^-204 (3.9e-62) in all directions; choose a larger "
        "unit of length");
}

template ShapeSolid::ShapeSolid(const fcl::CollisionGeometry<float>&);
template ShapeSolid::ShapeSolid(const fcl::CollisionGeometry<double>&);

bool isShape(fcl::NODE_TYPE type) { return rowOf<double>(type) != nullptr; }

const char* nameOfShape(fcl::NODE_TYPE type) {
  const ShapeRow<double>* const row = rowOf<double>(type);
  return row ? row->name : nullptr;
}

}  // namespace adaptive_bvh
