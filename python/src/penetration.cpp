#include "adaptive_bvh/penetration.h"

#include "bind.h"
#include "objects.h"
#include "results.h"

namespace adaptive_bvh::python {
namespace docs {
constexpr const char* kVertexContacts =
    R"(Every vertex of `first` that is at most `distance` away from the surface of `second`, or inside
of it.

first: a DeformableMesh. second: another, which must be closed, or a shape.
tf1, tf2: poses that place them in the world.
Returns VertexContacts. A penalty force: -stiffness * ((distance - c.distances) * c.areas)[:, None] *
c.normals. Raises ValueError when the distance is negative or NaN, and when `second` is open; the
message names an edge.)";

constexpr const char* kContactsOfBoth =
    R"(The contacts of both meshes: the vertices of `first` near or inside the body of `second`, and the
vertices of `second` near or inside the body of `first`, as two calls of vertex_contacts return them.

first, second: DeformableMesh, both closed. Returns a pair of VertexContacts; the normals of either
point from the vertex's mesh to the other. For a penalty force use half of the stiffness with each.
Raises ValueError when the distance is negative or NaN, and when a mesh is open; the message names
an edge.)";

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

template <typename Other>
VertexContacts contactsOf(const LockedMesh& first, const Other& second, double distance,
                          const py::object& tf1, const py::object& tf2) {
  return findPlaced<VertexContacts>(
      first, second, Poses(tf1, tf2),
      [&](auto& result, const auto&... placed) { vertexContacts(placed..., distance, result); });
}

auto contactsOfBoth(const LockedMesh& first, const LockedMesh& second, double distance,
                    const py::object& tf1, const py::object& tf2) {
  return findPlaced<std::pair<VertexContacts, VertexContacts>>(
      first, second, Poses(tf1, tf2), [&](auto& result, const auto&... placed) {
        vertexContacts(placed..., distance, result.first, result.second);
      });
}

template <typename Other>
SignedDistance signedDistanceOf(const LockedMesh& first, const Other& second, double tolerance,
                                const py::object& tf1, const py::object& tf2) {
  return queryPlaced(first, second, Poses(tf1, tf2),
                     [&](const auto&... placed) { return signedDistance(placed..., tolerance); });
}

const char* nameOf(const SignedDistance& d) {
  return d.deep_body == DeepBody::First    ? "first"
         : d.deep_body == DeepBody::Second ? "second"
                                           : "none";
}

void bindSignedDistance(py::module_& module) {
  using D = SignedDistance;
  ResultClass<D>(module, "SignedDistance",
                 "The signed distance of two bodies: between `lower` and `upper`.")
      .attribute("lower", &D::lower, "Lower bound of the signed distance.")
      .attribute("upper", &D::upper, "Upper bound of the signed distance.")
      .attribute("deep_body", &nameOf,
                 "'first' or 'second': the body with the deepest point on its surface; 'none' "
                 "where they are apart or touch.")
      .attribute("points", &D::points,
                 "(2, 3) float64: on the first and on the second surface, in the world; their "
                 "difference is the signed distance times the normal.")
      .attribute("normal", &D::normal,
                 "(3,) float64, of length 1, from the first body to the second.");
  const auto define = [&](auto function) {
    module.def("signed_distance", function, "first"_a, "second"_a, "tolerance"_a, py::kw_only(),
               "tf1"_a = py::none(), "tf2"_a = py::none(), docs::kSignedDistance);
  };
  define(&signedDistanceOf<LockedMesh>);
  define(&signedDistanceOf<Shape>);
}

void bindContacts(py::module_& module) {
  using C = VertexContacts;
  ResultClass<C>(
      module, "VertexContacts",
      "Vertices near another body or inside of it, by increasing index. len() counts them.")
      .attribute("vertices", &C::vertices, "(K,) int32: indices.")
      .attribute("distances", &C::distances, "(K,) float64; negative inside.")
      .attribute("positions", &C::positions, "(K, 3) float64, in the world.")
      .attribute("nearest_points", &C::nearest_points,
                 "(K, 3) float64, on the other body, in the world.")
      .attribute("normals", &C::normals,
                 "(K, 3) float64, of length 1, from the mesh to the other body, in the world.")
      .attribute("triangles", &C::triangles, "(K,) int32: of the other mesh; -1 of a shape.")
      .attribute("barycentric", &C::barycentric,
                 "(K, 3) float64: of the nearest points, for the triangles' corners.")
      .attribute("areas", &C::areas, "(K,) float64: a third of the area of the vertex's triangles.")
      .length(&C::vertices);

  const auto define = [&](const char* name, auto function, const char* doc) {
    module.def(name, function, "first"_a, "second"_a, "distance"_a = 0., py::kw_only(),
               "tf1"_a = py::none(), "tf2"_a = py::none(), doc);
  };
  define("vertex_contacts", &contactsOf<LockedMesh>, docs::kVertexContacts);
  define("vertex_contacts", &contactsOf<Shape>, docs::kVertexContacts);
  define("vertex_contacts_of_both", &contactsOfBoth, docs::kContactsOfBoth);
}

}  // namespace

void bindPenetration(py::module_& module) {
  bindContacts(module);
  bindSignedDistance(module);
}

}  // namespace adaptive_bvh::python
