#include "shapes.h"

#include <cmath>
#include <utility>

#include <pybind11/stl.h>

#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/cone.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/ellipsoid.h>
#include <fcl/geometry/shape/halfspace.h>
#include <fcl/geometry/shape/plane.h>
#include <fcl/geometry/shape/sphere.h>

#include "arrays.h"
#include "bind.h"
#include "results.h"

namespace adaptive_bvh::python {
namespace {

// Products of four such lengths are far from overflow and underflow.
constexpr double kSmallest = 1e-8, kLargest = 1e8;

// A type for each shape, so that Python has a class for each.
struct Box : Shape {
  Box(double x, double y, double z) : Shape(make<fcl::Box>("Box", x, y, z)) {}
};
struct Sphere : Shape {
  explicit Sphere(double radius) : Shape(make<fcl::Sphere>("Sphere", radius)) {}
};
struct Capsule : Shape {
  Capsule(double radius, double lz) : Shape(make<fcl::Capsule>("Capsule", radius, lz)) {}
};
struct Cylinder : Shape {
  Cylinder(double radius, double lz) : Shape(make<fcl::Cylinder>("Cylinder", radius, lz)) {}
};
struct Cone : Shape {
  Cone(double radius, double lz) : Shape(make<fcl::Cone>("Cone", radius, lz)) {}
};
struct Ellipsoid : Shape {
  Ellipsoid(double a, double b, double c) : Shape(make<fcl::Ellipsoid>("Ellipsoid", a, b, c)) {}
};

struct Plane : Shape {
  Plane(const py::object& normal, double offset)
      : Shape(makeUnbounded<fcl::Plane>("Plane", pointFrom(normal, "normal"), offset)) {}
};
struct Halfspace : Shape {
  Halfspace(const py::object& normal, double offset)
      : Shape(makeUnbounded<fcl::Halfspace>("Halfspace", pointFrom(normal, "normal"), offset)) {}
};

/// A property for each size.
template <typename Class>
void addSizes(Class& type, const std::vector<std::pair<const char*, const char*>>& sizes) {
  for (std::size_t i = 0; i < sizes.size(); ++i)
    type.def_property_readonly(
        sizes[i].first, [i](const Shape& self) { return self.size(i); }, sizes[i].second);
}

void bindRound(py::module_& module) {
  py::class_<Sphere, Shape> sphere(module, "Sphere", "A sphere around the origin.");
  sphere.def(py::init<double>(), py::arg("radius"), "radius: a length.");
  addSizes(sphere, {{"radius", "A length."}});
  py::class_<Ellipsoid, Shape> ellipsoid(module, "Ellipsoid", "An ellipsoid around the origin.");
  ellipsoid.def(py::init<double, double, double>(), py::arg("a"), py::arg("b"), py::arg("c"),
                "a, b, c: half of the extents along x, y and z.");
  addSizes(ellipsoid, {{"a", "Half of the extent along x."},
                       {"b", "Half of the extent along y."},
                       {"c", "Half of the extent along z."}});
}

/// Those with the axis z.
template <typename T>
void bindAxial(py::module_& module, const char* name, const char* what, const char* length) {
  py::class_<T, Shape> shape(module, name, what);
  shape.def(py::init<double, double>(), py::arg("radius"), py::arg("lz"),
            "radius, lz: two lengths, the second along z.");
  addSizes(shape, {{"radius", "A length."}, {"lz", length}});
}

/// Plane and Halfspace.
template <typename T>
void bindUnbounded(py::module_& module, const char* name, const char* what) {
  py::class_<T, Shape>(module, name, what)
      .def(py::init<const py::object&, double>(), py::arg("normal"), py::arg("offset") = 0.0,
           "normal: (3,), of length 1 to 1e-6. offset: a length, how far from the origin the plane "
           "is along the normal.")
      .def_property_readonly(
          "normal",
          [](const Shape& self) {
            return arrayOf(fcl::Vector3d(self.size(0), self.size(1), self.size(2)));
          },
          "(3,) float64, of length 1.")
      .def_property_readonly(
          "offset", [](const Shape& self) { return self.size(3); }, "A length.")
      .def("__repr__", [type = std::string(name)](const Shape& self) {
        const auto number = [&](std::size_t i) {
          return std::string(py::repr(py::float_(self.size(i))));
        };
        return type + "((" + number(0) + ", " + number(1) + ", " + number(2) + "), " + number(3) +
               ")";
      });
}

}  // namespace

Eigen::Vector3d Shape::unitNormal(const std::string& name, const Eigen::Vector3d& normal,
                                  double offset) {
  const double length = normal.norm();
  if (!(std::abs(length - 1) <= 1e-6))
    throw py::value_error(name + ": the normal has the length " +
                          std::string(py::str(py::float_(length))) + "; 1 is needed");
  if (!(std::abs(offset) <= kLargest))
    throw py::value_error(name + ": the offset is " + std::string(py::str(py::float_(offset))) +
                          "; -1e8 to 1e8 is possible");
  return normal / length;
}

Shape::Shape(const char* name, std::vector<double> sizes) : name_(name), sizes_(std::move(sizes)) {
  for (const double size : sizes_)
    if (!(size >= kSmallest && size <= kLargest))
      throw py::value_error(name_ + ": a size is " + std::string(py::str(py::float_(size))) +
                            "; 1e-8 to 1e8 is possible");
}

py::tuple Shape::arguments() const {
  constexpr std::size_t kUnbounded = 4;  // a normal and an offset; solids have three sizes at most
  if (sizes_.size() == kUnbounded)
    return py::make_tuple(py::make_tuple(sizes_[0], sizes_[1], sizes_[2]), sizes_[3]);
  return py::tuple(py::cast(sizes_));
}

std::string Shape::text() const {
  std::string text = name_ + "(";
  for (std::size_t i = 0; i < sizes_.size(); ++i)
    text += (i ? ", " : "") + std::string(py::repr(py::float_(sizes_[i])));
  return text + ")";
}

void bindShapes(py::module_& module) {
  py::class_<Shape>(module, "Shape",
                    "A solid of FCL's: Box, Sphere, Capsule, Cylinder, Cone or Ellipsoid, whose "
                    "centre is the origin and whose axis is z; or a Plane or Halfspace. A pose "
                    "places it.")
      .def("__reduce__",
           [](const py::object& self) {  // for copy and pickle
             return py::make_tuple(py::type::of(self), self.cast<const Shape&>().arguments());
           })
      .def("__repr__", &Shape::text);
  py::class_<Box, Shape> box(module, "Box", "A box around the origin.");
  box.def(py::init<double, double, double>(), py::arg("x"), py::arg("y"), py::arg("z"),
          "x, y, z: the whole lengths of its sides.");
  addSizes(
      box,
      {{"x", "The length along x."}, {"y", "The length along y."}, {"z", "The length along z."}});
  bindRound(module);
  bindAxial<Capsule>(module, "Capsule", "A capsule: the points within radius of a segment.",
                     "The length of the segment along z; the capsule is longer by two radii.");
  bindAxial<Cylinder>(module, "Cylinder", "A cylinder.", "Its whole length along z.");
  bindAxial<Cone>(module, "Cone", "A cone. Its tip is at +lz / 2, its base at -lz / 2.",
                  "Its whole length along z.");
  bindUnbounded<Plane>(module, "Plane",
                       "The points x with normal . x = offset: both sides are out.");
  bindUnbounded<Halfspace>(module, "Halfspace",
                           "The points x with normal . x <= offset: the normal points out.");
}

}  // namespace adaptive_bvh::python
