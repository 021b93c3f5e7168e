#include "shapes.h"

#include <cmath>
#include <map>
#include <utility>

#include <pybind11/stl.h>

#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/cone.h>
#include <fcl/geometry/shape/convex.h>
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

/// A type for each shape, so that Python has a class for each.
template <template <typename> class Geometry>
struct Typed : Shape {
  explicit Typed(Shape&& shape) : Shape(std::move(shape)) {}
};

/// An argument of a shape's constructor, which is also a property.
struct Size {
  const char *name, *doc;
};
template <std::size_t>
using Length = double;

/// A shape of some sizes.
template <template <typename> class Primitive, std::size_t... kIndices>
void bindSolid(py::module_& module, const char* name, const char* doc, const char* sizes_doc,
               const Size* sizes, std::index_sequence<kIndices...>) {
  using Solid = Typed<Primitive>;
  py::class_<Solid, Shape> solid(module, name, doc);
  solid.def(py::init([name](Length<kIndices>... lengths) {
              return Solid(Shape::make<Primitive>(name, lengths...));
            }),
            py::arg(sizes[kIndices].name)..., sizes_doc);
  (solid.def_property_readonly(
       sizes[kIndices].name, [](const Shape& self) { return self.size(kIndices); },
       sizes[kIndices].doc),
   ...);
}
template <template <typename> class Primitive, std::size_t kCount>
void bindSolid(py::module_& module, const char* name, const char* doc, const char* sizes_doc,
               const Size (&sizes)[kCount]) {
  bindSolid<Primitive>(module, name, doc, sizes_doc, sizes, std::make_index_sequence<kCount>());
}

void bindSolids(py::module_& module) {
  bindSolid<fcl::Box>(
      module, "Box", "A box around the origin.", "x, y, z: the whole lengths of its sides.",
      {{"x", "The length along x."}, {"y", "The length along y."}, {"z", "The length along z."}});
  bindSolid<fcl::Sphere>(module, "Sphere", "A sphere around the origin.", "radius: a length.",
                         {{"radius", "A length."}});
  bindSolid<fcl::Ellipsoid>(module, "Ellipsoid", "An ellipsoid around the origin.",
                            "a, b, c: half of the extents along x, y and z.",
                            {{"a", "Half of the extent along x."},
                             {"b", "Half of the extent along y."},
                             {"c", "Half of the extent along z."}});
  const char* axial = "radius, lz: two lengths, the second along z.";
  const Size radius = {"radius", "A length."}, lz = {"lz", "Its whole length along z."};
  bindSolid<fcl::Capsule>(
      module, "Capsule", "A capsule: the points within radius of a segment.", axial,
      {radius, {"lz", "The length of the segment along z; the capsule is longer by two radii."}});
  bindSolid<fcl::Cylinder>(module, "Cylinder", "A cylinder.", axial, {radius, lz});
  bindSolid<fcl::Cone>(module, "Cone", "A cone. Its tip is at +lz / 2, its base at -lz / 2.", axial,
                       {radius, lz});
}

/// Throws py::value_error unless triangles enclose a convex body, up to 1e-5 of its extent: each
/// edge has two, which do not bend inward, and there is one body.
void requireConvex(const std::vector<fcl::Vector3d>& points,
                   const std::vector<fcl::Triangle>& triangles) {
  using Edge = std::pair<std::size_t, std::size_t>;
  const auto refuse = [](const std::string& why) { throw py::value_error("Convex: " + why); };
  const auto text = [](const Edge& edge) {
    return "the edge (" + std::to_string(edge.first) + ", " + std::to_string(edge.second) + ")";
  };
  std::map<Edge, std::size_t> corners;  // of an edge as its triangle has it, the third corner
  fcl::Vector3d low = points.front(), high = low;
  for (const fcl::Triangle& t : triangles)
    for (int k = 0; k < 3; ++k) {
      const Edge edge(t[k], t[(k + 1) % 3]);
      if (!corners.emplace(edge, t[(k + 2) % 3]).second)
        refuse("two faces have " + text(edge) + " in the same direction");
      low = low.cwiseMin(points[t[k]]), high = high.cwiseMax(points[t[k]]);
    }
  const double tolerance = 1e-5 * (high - low).maxCoeff();
  for (const auto& [edge, corner] : corners) {
    const auto other = corners.find({edge.second, edge.first});
    if (other == corners.end()) refuse(text(edge) + " has one face");
    const fcl::Vector3d& a = points[edge.first];
    const fcl::Vector3d n = (points[edge.second] - a).cross(points[corner] - a);
    if (n.dot(points[other->second] - a) > tolerance * n.norm())
      refuse("faces bend inward at " + text(edge) + ", or their normals point inward");
  }
  if (points.size() + triangles.size() != corners.size() / 2 + 2)  // Euler's formula
    refuse("a vertex has no face, or there are several bodies");
}

/// Python's Convex.
class Hull final : public Shape {
 public:
  Hull(const py::object& vertices, const py::object& faces)
      : Hull(Rows(vertices, "vertices"), faces) {}

  py::tuple arguments() const override {
    return py::make_tuple(copyOf(convex().getVertices()), copyOf(triangles_));
  }
  std::string text() const override {
    return "<adaptive_bvh.Convex: " + std::to_string(convex().getVertices().size()) +
           " vertices, " + std::to_string(triangles_.size()) + " faces>";
  }

 private:
  Hull(const Rows& rows, const py::object& faces)
      : Hull({rows.begin(), rows.end()}, trianglesFrom(faces, rows.size())) {}
  Hull(std::vector<fcl::Vector3d> points, std::vector<fcl::Triangle> triangles)
      : Shape(make(std::move(points), triangles)), triangles_(std::move(triangles)) {}

  const fcl::Convexd& convex() const { return static_cast<const fcl::Convexd&>(geometry()); }
  template <typename T>
  static py::array copyOf(std::vector<T> rows) {
    py::array copy = adopt(std::move(rows));
    copy.attr("flags").attr("writeable") = false;
    return copy;
  }

  static std::shared_ptr<const fcl::Convexd> make(std::vector<fcl::Vector3d> points,
                                                  const std::vector<fcl::Triangle>& triangles) {
    for (const fcl::Vector3d& point : points)
      if (!(point.lpNorm<Eigen::Infinity>() <= kLargest))
        throw py::value_error("Convex: a coordinate is not finite, or beyond 1e8");
    if (triangles.empty()) throw py::value_error("Convex: there are no faces");
    requireConvex(points, triangles);
    auto faces = std::make_shared<std::vector<int>>();
    for (const fcl::Triangle& t : triangles)
      faces->insert(faces->end(), {3, int(t[0]), int(t[1]), int(t[2])});
    return std::make_shared<fcl::Convexd>(
        std::make_shared<const std::vector<fcl::Vector3d>>(std::move(points)),
        int(triangles.size()), std::move(faces));
  }

  std::vector<fcl::Triangle> triangles_;
};

void bindConvex(py::module_& module) {
  py::class_<Hull, Shape>(module, "Convex", "A convex body, given by the triangles of its surface.")
      .def(py::init<const py::object&, const py::object&>(), "vertices"_a, "faces"_a,
           "vertices: (N, 3). faces: (M, 3) integers, counter-clockwise as seen from outside. They "
           "must enclose a convex body, up to 1e-5 of its extent: ValueError otherwise. Queries "
           "take the convex hull of the vertices.")
      .def_property_readonly(
          "vertices", [](const Hull& self) { return py::object(self.arguments()[0]); },
          "(N, 3) float64, a read-only copy.")
      .def_property_readonly(
          "faces", [](const Hull& self) { return py::object(self.arguments()[1]); },
          "(M, 3) int64, a read-only copy.");
}

/// Plane and Halfspace.
template <template <typename> class Geometry>
void bindUnbounded(py::module_& module, const char* name, const char* what) {
  using Unbounded = Typed<Geometry>;
  py::class_<Unbounded, Shape>(module, name, what)
      .def(py::init([name](const py::object& normal, double offset) {
             return Unbounded(
                 Shape::makeUnbounded<Geometry>(name, pointFrom(normal, "normal"), offset));
           }),
           "normal"_a, "offset"_a = 0.0,
           "normal: (3,), of length 1 to 1e-6. offset: a length, how far from the origin the plane "
           "is along the normal.")
      .def_property_readonly(
          "normal",
          [](const Shape& self) {
            return arrayOf(fcl::Vector3d(self.size(0), self.size(1), self.size(2)));
          },
          "(3,) float64, of length 1.")
      .def_property_readonly(
          "offset", [](const Shape& self) { return self.size(3); }, "A length.");
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
  const std::string text = py::repr(arguments());  // "(1.0,)" of one
  return name_ + (sizes_.size() == 1 ? text.substr(0, text.size() - 2) + ")" : text);
}

void bindShapes(py::module_& module) {
  py::class_<Shape>(
      module, "Shape",
      "A solid of FCL's: Box, Sphere, Capsule, Cylinder, Cone or Ellipsoid, whose "
      "centre is the origin and whose axis is z; a Convex; or a Plane or Halfspace. A "
      "pose places it.")
      .def("__reduce__",
           [](const py::object& self) {  // for copy and pickle
             return py::make_tuple(py::type::of(self), self.cast<const Shape&>().arguments());
           })
      .def("__repr__", &Shape::text);
  bindSolids(module);
  bindConvex(module);
  bindUnbounded<fcl::Plane>(module, "Plane",
                            "The points x with normal . x = offset: both sides are out.");
  bindUnbounded<fcl::Halfspace>(module, "Halfspace",
                                "The points x with normal . x <= offset: the normal points out.");
}

}  // namespace adaptive_bvh::python
