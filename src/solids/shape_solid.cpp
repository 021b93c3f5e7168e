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

/// An FCL shape, and functions that check its sizes.
struct ShapeNumbers {
  const fcl::CollisionGeometryd& shape;
  const char* name;  ///< for messages

  template <typename Shape>
  const Shape& as() const {
    return static_cast<const Shape&>(shape);
  }
  double size(double length) const {
    if (!(length > 0) || !std::isfinite(length))
      throw std::invalid_argument("adaptive_bvh: a size of a " + std::string(name) + " is " +
                                  std::to_string(length) + "; it must be positive and finite");
    return length;
  }
  fcl::Vector3d sizes(const fcl::Vector3d& x) const { return {size(x[0]), size(x[1]), size(x[2])}; }
};

/// A supported type of shape; `read` constructs its Solid.
struct ShapeRow {
  fcl::NODE_TYPE type;
  const char* name;
  void (*read)(const ShapeNumbers& from, ShapeSolid& to);
};

/// The table of all supported shapes. A new shape is a row.
const ShapeRow kShapeRows[] = {
    {fcl::GEOM_SPHERE, "sphere",
     [](const ShapeNumbers& from, ShapeSolid& to) {
       to.make<RoundedSegment>(from.size(from.as<fcl::Sphered>().radius), 0.);
     }},
    {fcl::GEOM_CAPSULE, "capsule",
     [](const ShapeNumbers& from, ShapeSolid& to) {
       const auto& of = from.as<fcl::Capsuled>();
       to.make<RoundedSegment>(from.size(of.radius), from.size(of.lz) / 2);
     }},
    {fcl::GEOM_BOX, "box",
     [](const ShapeNumbers& from, ShapeSolid& to) {
       to.make<BoxSolid>(fcl::Vector3d(from.sizes(from.as<fcl::Boxd>().side) / 2));
     }},
    {fcl::GEOM_CYLINDER, "cylinder",
     [](const ShapeNumbers& from, ShapeSolid& to) {
       const auto& of = from.as<fcl::Cylinderd>();
       to.make<CylinderSolid>(from.size(of.radius), from.size(of.lz) / 2);
     }},
    {fcl::GEOM_CONE, "cone",
     [](const ShapeNumbers& from, ShapeSolid& to) {
       const auto& of = from.as<fcl::Coned>();
       to.make<ConeSolid>(from.size(of.radius), from.size(of.lz) / 2);
     }},
    {fcl::GEOM_ELLIPSOID, "ellipsoid",
     [](const ShapeNumbers& from, ShapeSolid& to) {
       to.make<EllipsoidSolid>(from.sizes(from.as<fcl::Ellipsoidd>().radii));
     }},
    {fcl::GEOM_CONVEX, "convex",
     [](const ShapeNumbers& from, ShapeSolid& to) {
       const auto& of = from.as<fcl::Convexd>();
       const auto& points = of.getVertices();
       to.make<HullSolid>(points.data(), points.size(), of.getFaces(), of.getInteriorPoint());
     }},
    {fcl::GEOM_PLANE, "plane",
     [](const ShapeNumbers& from, ShapeSolid& to) {
       const auto& of = from.as<fcl::Planed>();
       to.make<FlatSolid>(of.n, of.d, false);
     }},
    {fcl::GEOM_HALFSPACE, "half-space", [](const ShapeNumbers& from, ShapeSolid& to) {
       const auto& of = from.as<fcl::Halfspaced>();
       to.make<FlatSolid>(of.n, of.d, true);
     }}};

/// The row of a type, or null.
const ShapeRow* rowOf(fcl::NODE_TYPE type) {
  const auto* const row = std::find_if(std::begin(kShapeRows), std::end(kShapeRows),
                                       [&](const ShapeRow& other) { return other.type == type; });
  return row == std::end(kShapeRows) ? nullptr : row;
}

}  // namespace

ShapeSolid::ShapeSolid(const fcl::CollisionGeometryd& shape) {
  const ShapeRow* const row = rowOf(shape.getNodeType());
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

bool isShape(fcl::NODE_TYPE type) { return rowOf(type) != nullptr; }

const char* nameOfShape(fcl::NODE_TYPE type) {
  const ShapeRow* const row = rowOf(type);
  return row ? row->name : nullptr;
}

}  // namespace adaptive_bvh
