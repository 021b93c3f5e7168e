#include "shapes.h"

#include <utility>

#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/cone.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/ellipsoid.h>
#include <fcl/geometry/shape/sphere.h>

namespace adaptive_bvh::python {
namespace {

// Beyond these the products of four lengths in FCL's solver overflow in single precision, or
// vanish.
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

}  // namespace

Shape::Shape(const char* name, std::vector<double> sizes) : name_(name), sizes_(std::move(sizes)) {
  for (const double size : sizes_)
    if (!(size >= kSmallest && size <= kLargest))
      throw py::value_error(name_ + ": a size is " + std::string(py::str(py::float_(size))) +
                            "; 1e-8 to 1e8 is possible");
}

std::string Shape::text() const {
  std::string text = name_ + "(";
  for (std::size_t i = 0; i < sizes_.size(); ++i)
    text += (i ? ", " : "") + std::string(py::repr(py::float_(sizes_[i])));
  return text + ")";
}

void bindShapes(py::module_& module) {
  py::class_<Shape>(module, "Shape",
                    "A solid of FCL's: Box, Sphere, Capsule, Cylinder, Cone or Ellipsoid. Its "
                    "centre is the origin, its axis z; a pose places it.")
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
}

}  // namespace adaptive_bvh::python
