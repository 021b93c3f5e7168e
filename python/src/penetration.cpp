#include "penetration.h"

#include "arrays.h"
#include "either.h"
#include "locked_mesh.h"
#include "objects.h"
#include "shapes.h"
#include "text.h"

namespace adaptive_bvh::python {
namespace docs {
constexpr const char* kVertexContacts =
    R"(Every vertex of `mesh` that is at most `margin` away from the surface of `other`, or inside of
it.

other: a DeformableMesh, which must be closed, or a shape.
Returns VertexContacts. A penalty force: -stiffness * ((margin - c.distances) * c.areas)[:, None] *
c.normals. Raises ValueError when the margin is negative or NaN, and when `other` is open; the
message names an edge.)";

constexpr const char* kContactsOfBoth =
    R"(The contacts of both meshes: the vertices of `first` near or inside the body of `second`, and the
vertices of `second` near or inside the body of `first`, as two calls of vertex_contacts return them.

first, second: DeformableMesh, both closed. Returns a pair of VertexContacts; the normals of either
point from the vertex's mesh to the other. For a penalty force use half of the stiffness with each.
Raises ValueError when the margin is negative or NaN, and when a mesh is open; the message names an
edge.)";

constexpr const char* kSignedDistance =
    R"(The signed distance of two closed bodies: the distance where they are apart, and minus the depth
where one reaches into the other: the largest distance to the other's surface that any point of
either surface has inside of the other body.

first, second: DeformableMesh, closed; `second` may be a shape with an inside.
tolerance: the bounds differ by at most so much.
Returns SignedDistance. Raises ValueError when the tolerance is negative or NaN, and when a mesh is
open; the message names an edge.)";
}  // namespace docs

namespace {

/// N or N x 3 numbers.
using Doubles = py::array_t<double>;

}  // namespace

template <typename S>
ContactArrays contactArrays(VertexContacts<S>&& c) {
  const auto count = static_cast<py::ssize_t>(c.size());
  ContactArrays arrays;
  arrays.vertices = adopt<std::int32_t>(std::move(c.vertices), {count});
  arrays.triangles = adopt<std::int32_t>(std::move(c.triangles), {count});
  arrays.distances = adoptDoubles<S>(std::move(c.distances), {count});
  arrays.positions = adoptDoubles<S>(std::move(c.positions), {count, 3});
  arrays.nearest_points = adoptDoubles<S>(std::move(c.nearest_points), {count, 3});
  arrays.normals = adoptDoubles<S>(std::move(c.normals), {count, 3});
  arrays.barycentric = adoptDoubles<S>(std::move(c.barycentric), {count, 3});
  arrays.areas = adoptDoubles<S>(std::move(c.areas), {count});
  return arrays;
}

template ContactArrays contactArrays(VertexContacts<double>&&);
template ContactArrays contactArrays(VertexContacts<float>&&);

namespace {

ContactArrays arraysOf(Either<VertexContacts>&& contacts, const LockedMesh& mesh) {
  return std::move(contacts).take(mesh.isDouble(),
                                  [](auto&& c) { return contactArrays(std::move(c)); });
}

ContactArrays contactsWithMesh(const LockedMesh& mesh, const LockedMesh& other, double margin,
                               const py::object& tf, const py::object& other_tf) {
  const Poses poses(tf, other_tf, "tf", "other_tf");
  Either<VertexContacts> result;
  LockedMesh::queryPair(mesh, other, [&](const auto& a, const auto& b) {
    using S = ScalarOf<decltype(a)>;
    vertexContacts(a, poseAs<S>(poses.tf1), b, poseAs<S>(poses.tf2), static_cast<S>(margin),
                   result.as<S>());
  });
  return arraysOf(std::move(result), mesh);
}

std::pair<ContactArrays, ContactArrays> contactsOfBoth(const LockedMesh& first,
                                                       const LockedMesh& second, double margin,
                                                       const py::object& tf1,
                                                       const py::object& tf2) {
  const Poses poses(tf1, tf2, "tf1", "tf2");
  Either<VertexContacts> of_first, of_second;
  LockedMesh::queryPair(first, second, [&](const auto& a, const auto& b) {
    using S = ScalarOf<decltype(a)>;
    vertexContacts(a, poseAs<S>(poses.tf1), b, poseAs<S>(poses.tf2), static_cast<S>(margin),
                   of_first.as<S>(), of_second.as<S>());
  });
  return {arraysOf(std::move(of_first), first), arraysOf(std::move(of_second), second)};
}

ContactArrays contactsWithShape(const LockedMesh& mesh, const Shape& shape, double margin,
                                const py::object& tf, const py::object& other_tf) {
  const Poses poses(tf, other_tf, "tf", "other_tf");
  Either<VertexContacts> result;
  mesh.query([&](const auto& m) {
    using S = ScalarOf<decltype(m)>;
    const fcl::CollisionGeometry<S>& geometry = *shape.geometry<S>();
    vertexContacts(m, poseAs<S>(poses.tf1), geometry, poseAs<S>(poses.tf2), static_cast<S>(margin),
                   result.as<S>());
  });
  return arraysOf(std::move(result), mesh);
}

/// A SignedDistance of numbers of either type.
struct BodyDistance : Bound {
  SignedDistance<double> found;

  const char* deepBody() const {
    return found.deep_body == DeepBody::First    ? "first"
           : found.deep_body == DeepBody::Second ? "second"
                                                 : "none";
  }
  Doubles points() const {
    Doubles array(std::vector<py::ssize_t>{2, 3});
    for (int i = 0; i < 2; ++i)
      for (int k = 0; k < 3; ++k)
        array.mutable_at(i, k) = found.points[static_cast<std::size_t>(i)][k];
    return array;
  }
  Doubles normal() const {
    Doubles array(3);
    for (int k = 0; k < 3; ++k) array.mutable_at(k) = found.normal[k];
    return array;
  }
};

template <typename S>
SignedDistance<double> inDouble(const SignedDistance<S>& d) {
  return {double(d.lower),
          double(d.upper),
          d.deep_body,
          {d.points[0].template cast<double>(), d.points[1].template cast<double>()},
          d.normal.template cast<double>(),
          d.searches};
}

BodyDistance distanceOfMeshes(const LockedMesh& first, const LockedMesh& second, double tolerance,
                              const py::object& tf1, const py::object& tf2) {
  const Poses poses(tf1, tf2, "tf1", "tf2");
  BodyDistance result;
  LockedMesh::queryPair(first, second, [&](const auto& a, const auto& b) {
    using S = ScalarOf<decltype(a)>;
    result.found = inDouble(signedDistance(a, poseAs<S>(poses.tf1), b, poseAs<S>(poses.tf2),
                                           static_cast<S>(tolerance)));
  });
  return result;
}

BodyDistance distanceToShape(const LockedMesh& first, const Shape& second, double tolerance,
                             const py::object& tf1, const py::object& tf2) {
  const Poses poses(tf1, tf2, "tf1", "tf2");
  BodyDistance result;
  first.query([&](const auto& mesh) {
    using S = ScalarOf<decltype(mesh)>;
    const fcl::CollisionGeometry<S>& shape = *second.geometry<S>();
    result.found = inDouble(signedDistance(mesh, poseAs<S>(poses.tf1), shape, poseAs<S>(poses.tf2),
                                           static_cast<S>(tolerance)));
  });
  return result;
}

void bindSignedDistance(py::module_& module) {
  py::class_<BodyDistance>(module, "SignedDistance",
                           "The signed distance of two bodies: between `lower` and `upper`.")
      .def_property_readonly(
          "lower", [](const BodyDistance& d) { return d.found.lower; },
          "Lower bound of the signed distance.")
      .def_property_readonly(
          "upper", [](const BodyDistance& d) { return d.found.upper; },
          "Upper bound of the signed distance.")
      .def_property_readonly("deep_body", &BodyDistance::deepBody,
                             "'first' or 'second': the body with the deepest point on its surface; "
                             "'none' where they are apart or touch.")
      .def_property_readonly("points", &BodyDistance::points,
                             "(2, 3) float64: on the first and on the second surface, in the "
                             "world; their difference is the signed distance times the normal.")
      .def_property_readonly("normal", &BodyDistance::normal,
                             "(3,) float64, of length 1, from the first body to the second.")
      .def("__repr__", TextOf({"lower", "upper", "deep_body", "points", "normal"}));
  const auto define = [&](auto function) {
    module.def("signed_distance", function, py::arg("first"), py::arg("second"),
               py::arg("tolerance"), py::arg("tf1") = py::none(), py::arg("tf2") = py::none(),
               docs::kSignedDistance);
  };
  define(&distanceOfMeshes);
  define(&distanceToShape);
}

void bindContacts(py::module_& module) {
  py::class_<ContactArrays>(
      module, "VertexContacts",
      "Vertices near another body or inside of it, by increasing index. len() counts them.")
      .def_readonly("vertices", &ContactArrays::vertices, "(K,) int32: indices.")
      .def_readonly("distances", &ContactArrays::distances, "(K,) float64; negative inside.")
      .def_readonly("positions", &ContactArrays::positions, "(K, 3) float64, in the world.")
      .def_readonly("nearest_points", &ContactArrays::nearest_points,
                    "(K, 3) float64, on the other body, in the world.")
      .def_readonly("normals", &ContactArrays::normals,
                    "(K, 3) float64, of length 1, from the mesh to the other body, in the world.")
      .def_readonly("triangles", &ContactArrays::triangles,
                    "(K,) int32: of the other mesh; -1 of a shape.")
      .def_readonly("barycentric", &ContactArrays::barycentric,
                    "(K, 3) float64: of the nearest points, for the triangles' corners.")
      .def_readonly("areas", &ContactArrays::areas,
                    "(K,) float64: a third of the area of the vertex's triangles.")
      .def("__len__", [](const ContactArrays& self) { return self.vertices.shape(0); })
      .def("__repr__", TextOf({"vertices", "distances", "positions", "nearest_points", "normals",
                               "triangles", "barycentric", "areas"}));
  const auto define = [&](auto function) {
    module.def("vertex_contacts", function, py::arg("mesh"), py::arg("other"),
               py::arg("margin") = 0., py::arg("tf") = py::none(), py::arg("other_tf") = py::none(),
               docs::kVertexContacts);
  };
  define(&contactsWithMesh);
  define(&contactsWithShape);
  module.def("vertex_contacts_of_both", &contactsOfBoth, py::arg("first"), py::arg("second"),
             py::arg("margin") = 0., py::arg("tf1") = py::none(), py::arg("tf2") = py::none(),
             docs::kContactsOfBoth);
}

}  // namespace

void bindPenetration(py::module_& module) {
  bindContacts(module);
  bindSignedDistance(module);
}

}  // namespace adaptive_bvh::python
