#include "query.h"

#include <limits>
#include <optional>

#include <pybind11/stl.h>

#include "adaptive_bvh/query.h"
#include "adaptive_bvh/self_collision.h"
#include "bind.h"
#include "ignored.h"
#include "objects.h"
#include "results.h"

namespace adaptive_bvh::python {
namespace docs {
constexpr const char* kDistance =
    R"(The exact distance of two meshes, of a mesh and a shape in either order, or of two shapes.

tf1, tf2: poses that place them in the world.
nearest_points: False leaves out the points, which are then NaN.
Returns a DistanceResult.)";

constexpr const char* kDistanceValue =
    "A length. 0 where the two touch: also where one is a shape that has its surface inside.";

constexpr const char* kDistancePoints =
    "The nearest points, (2, 3) float64, in the world: of the first object and of the second. "
    "Where "
    "they touch both are a common point.";

constexpr const char* kCollide =
    R"(Where two meshes, a mesh and a shape, or two shapes touch.

tf1, tf2: poses that place them in the world.
max_contacts: stops when it has so many, and says so in `reached_limit`; None finds all.
enable_contact: False leaves out points, normals and depths, which are then NaN. Faster.
solid: meshes are filled, as shapes always are: a body inside of a closed mesh touches it. Where no
    triangle touches, there is one contact for each component inside of the other mesh, and one for a
    shape inside: its depth is how far a vertex of the component, or a point of the shape, is from the
    surface around it. ValueError when a mesh is open; the message names an edge.
Returns Contacts.)";

constexpr const char* kSelfCollide =
    R"(Where a mesh touches itself: one contact for each pair of triangles, the smaller index first.

tf: a pose that places the mesh in the world.
max_contacts, enable_contact: as of collide.
ignored: what is left out: pairs of triangles, (K, 2) integers in any order; a SurfaceNeighbourhood;
    Ignored, for both and for other neighbours than those with a common vertex; or None.)";

constexpr const char* kContacts =
    "Contacts in arrays side by side: contact i is row i of each. len() counts them.";

constexpr const char* kContactPairs =
    "(K, 2) int32: the triangle of the first object and of the second, -1 for a shape. Two meshes "
    "can have two contacts for one pair.";
}  // namespace docs

Nearest::Nearest(const fcl::DistanceResultd& result, bool is_swapped)
    : distance(result.min_distance),
      points{result.nearest_points[is_swapped], result.nearest_points[!is_swapped]},
      triangles{static_cast<int>(is_swapped ? result.b2 : result.b1),
                static_cast<int>(is_swapped ? result.b1 : result.b2)} {}

void Contacts::add(const fcl::Contactd& contact, bool is_swapped) {
  const int first = static_cast<int>(contact.b1), second = static_cast<int>(contact.b2);
  pairs.push_back(is_swapped ? std::array{second, first} : std::array{first, second});
  points.push_back(contact.pos);
  normals.push_back(is_swapped ? fcl::Vector3d(-contact.normal) : contact.normal);
  depths.push_back(contact.penetration_depth);
}

namespace {

/// Two shapes as the bodies 0 and 1 of a scene, which answers them; nothing of other objects.
std::optional<Scene> sceneOfShapes(const py::object& o1, const py::object& o2,
                                   const py::object& tf1, const py::object& tf2) {
  if (!asShape(o1) || !asShape(o2)) return std::nullopt;
  const Poses poses(tf1, tf2);
  Scene scene;
  scene.add(asShape(o1)->geometryPointer(), poses.tf1);
  scene.add(asShape(o2)->geometryPointer(), poses.tf2);
  scene.update();
  return scene;
}

Nearest distanceOf(const py::object& o1, const py::object& o2, const py::object& tf1,
                   const py::object& tf2, bool nearest_points) {
  if (auto shapes = sceneOfShapes(o1, o2, tf1, tf2)) {
    Nearest nearest(shapes->distance());
    if (!nearest_points)
      nearest.points.fill(fcl::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()));
    return nearest;
  }
  const Objects objects(o1, o2, tf1, tf2);
  fcl::DistanceResultd result;
  objects.query([&](const auto&... placed) {
    adaptive_bvh::distance(placed..., fcl::DistanceRequestd(nearest_points), result);
  });
  return Nearest(result, objects.is_swapped);
}

Contacts contactsOf(const fcl::CollisionRequestd& request, const fcl::CollisionResultd& result,
                    bool is_swapped) {
  Contacts contacts;
  contacts.reached_limit = result.numContacts() >= request.num_max_contacts;
  for (std::size_t i = 0; i < result.numContacts(); ++i)
    contacts.add(result.getContact(i), is_swapped);
  return contacts;
}

fcl::CollisionRequestd requestOf(const std::optional<long long>& max_contacts, bool contact) {
  if (max_contacts && *max_contacts < 0)
    throw py::value_error("max_contacts is " + std::to_string(*max_contacts) +
                          "; 0 or more is needed, or None for all");
  const auto all = static_cast<long long>(std::numeric_limits<int>::max());
  return fcl::CollisionRequestd(static_cast<std::size_t>(max_contacts.value_or(all)), contact);
}

Contacts collideOf(const py::object& o1, const py::object& o2, const py::object& tf1,
                   const py::object& tf2, const std::optional<long long>& max_contacts,
                   bool enable_contact, bool solid) {
  const fcl::CollisionRequestd request = requestOf(max_contacts, enable_contact);
  if (const auto shapes = sceneOfShapes(o1, o2, tf1, tf2)) {
    Contacts contacts;
    SceneCollisions found;
    shapes->collide({request.num_max_contacts, enable_contact}, found);
    for (const fcl::Contactd& contact : found.contacts) contacts.add(contact, false);
    contacts.reached_limit = found.contacts.size() >= request.num_max_contacts;
    return contacts;
  }
  const Objects objects(o1, o2, tf1, tf2);
  fcl::CollisionResultd result;
  objects.query(
      [&](const auto&... placed) { adaptive_bvh::collide(placed..., request, result, solid); });
  return contactsOf(request, result, objects.is_swapped);
}

Contacts selfCollideOf(const LockedMesh& mesh, const py::object& tf,
                       const std::optional<long long>& max_contacts, bool enable_contact,
                       const py::object& ignored) {
  if (asMesh(tf) || asShape(tf))
    throw py::type_error("self_collide takes one mesh, and then a pose, which is no " +
                         typeNameOf(tf) + "; for two objects, call collide(first, second)");
  const fcl::CollisionRequestd request = requestOf(max_contacts, enable_contact);
  const fcl::Transform3d pose = poseFrom(tf, "tf");
  const IgnoredArgument out(ignored, IgnoredArgument::Triangles, true);
  const auto result = find<fcl::CollisionResultd>(
      mesh, [&](auto& found, const Mesh& m) { selfCollide(m, pose, out.get(), request, found); });
  return contactsOf(request, result, false);
}

void bindResults(py::module_& module) {
  ResultClass<Nearest>(module, "DistanceResult", "The distance of two objects.")
      .attribute("distance", &Nearest::distance, docs::kDistanceValue)
      .attribute("points", &Nearest::points, docs::kDistancePoints)
      .attribute("triangles", &Nearest::triangles,
                 "The triangles of these points, (2,) int32: -1 for a shape.");
  ResultClass<Contacts>(module, "Contacts", docs::kContacts)
      .attribute("pairs", &Contacts::pairs, docs::kContactPairs)
      .attribute("points", &Contacts::points, "(K, 3) float64, in the world.")
      .attribute("normals", &Contacts::normals,
                 "(K, 3) float64, unit vectors: with a shape from the first object to the second, "
                 "of two meshes normals of a triangle.")
      .attribute("depths", &Contacts::depths,
                 "(K,) float64, lengths: penetration depths, 0 or more.")
      .attribute("reached_limit", &Contacts::reached_limit,
                 "Whether the search ended at a limit of the request (max_contacts; of a Scene "
                 "contacts_per_pair of a pair, or first_only), so that there may be more. False: "
                 "these are all.")
      .length(&Contacts::depths);
}

}  // namespace

void bindQuery(py::module_& module) {
  bindResults(module);
  module.def("distance", &distanceOf, "o1"_a, "o2"_a, py::kw_only(), "tf1"_a = py::none(),
             "tf2"_a = py::none(), "nearest_points"_a = true, docs::kDistance);
  module.def("collide", &collideOf, "o1"_a, "o2"_a, py::kw_only(), "tf1"_a = py::none(),
             "tf2"_a = py::none(), "max_contacts"_a = py::none(), "enable_contact"_a = true,
             "solid"_a = false, docs::kCollide);
  module.def("self_collide", &selfCollideOf, "mesh"_a, "tf"_a = py::none(), py::kw_only(),
             "max_contacts"_a = py::none(), "enable_contact"_a = true, "ignored"_a = py::none(),
             docs::kSelfCollide);
}

}  // namespace adaptive_bvh::python
