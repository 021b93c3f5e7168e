#include <array>
#include <optional>
#include <utility>

#include <pybind11/stl.h>

#include "locked_scene.h"
#include "query.h"
#include "results.h"

// Queries of all pairs of bodies.
namespace adaptive_bvh::python {
namespace docs {
constexpr const char* kSceneCollide =
    R"(Pairs of bodies that touch, and their contacts: SceneCollisions.

contacts_per_pair: at most so many of each pair; None for all, 0 for pairs only.
enable_contact: False leaves out points, normals and depths, which are then NaN. Faster.
first_only: stops at the smallest pair that touches.)";

constexpr const char* kScenePairsWithin =
    R"(Pairs of triangles of two meshes at most `distance`, a length, apart: SceneTrianglePairs.

enable_distances, enable_nearest_points: also compute these.)";

constexpr const char* kSceneFeaturePairsWithin =
    R"(Pairs of a vertex and a face, and of two edges, of two meshes, at most `distance`, a length,
apart: SceneFeaturePairs.)";

constexpr const char* kSceneVertexContacts =
    R"(Vertices of meshes that are at most `distance`, a length, from another body, or inside of it:
SceneVertexContacts. The other body is a shape or a closed mesh; meshes that are not closed have no
inside and are left out.)";

constexpr const char* kPairBegins =
    "(P + 1,) int64: pair i of bodies has what stands from begins[i] to begins[i + 1].";
}  // namespace docs

namespace {

/// What the library found, and its pairs of bodies with their begins.
template <typename Found, typename Result>
auto ofBodyPairs(Result& result, Found&& found) {
  using Begin = typename decltype(result.begins)::value_type;
  OfBodyPairs<std::decay_t<Found>, Begin> of_pairs;
  for (const BodyPair& pair : result.pairs) of_pairs.bodies.push_back({pair.first, pair.second});
  of_pairs.begins = std::move(result.begins);
  of_pairs.found = std::forward<Found>(found);
  return of_pairs;
}
template <typename Result, typename F>
auto ofBodyPairs(const LockedScene& scene, const F& query) {
  Result result = find<Result>(scene, query);
  return ofBodyPairs(result, std::move(result.found));
}

OfBodyPairs<Contacts> sceneCollide(const LockedScene& scene,
                                   const std::optional<std::size_t>& contacts_per_pair,
                                   bool enable_contact, bool first_only) {
  SceneCollisionRequest request;
  if (contacts_per_pair) request.contacts_per_pair = *contacts_per_pair;
  request.enable_contact = enable_contact;
  request.first_only = first_only;
  auto result =
      find<SceneCollisions>(scene, [&](auto& found, const Scene& s) { s.collide(request, found); });
  Contacts contacts;
  for (const fcl::Contactd& contact : result.contacts) contacts.add(contact, false);
  contacts.reached_limit = first_only && !result.pairs.empty();
  for (std::size_t i = 0; i < result.pairs.size(); ++i)
    contacts.reached_limit |= result.begins[i + 1] - result.begins[i] >= request.contacts_per_pair;
  return ofBodyPairs(result, std::move(contacts));
}

auto scenePairsWithin(const LockedScene& scene, double distance, bool enable_distances,
                      bool enable_nearest_points) {
  return ofBodyPairs<SceneTrianglePairs>(scene, [&](auto& result, const Scene& s) {
    s.pairsWithin({distance, enable_distances, enable_nearest_points, {}}, result);
  });
}

auto sceneFeaturePairs(const LockedScene& scene, double distance) {
  return ofBodyPairs<SceneFeaturePairs>(
      scene, [&](auto& result, const Scene& s) { s.featurePairsWithin(distance, result); });
}

auto sceneVertexContacts(const LockedScene& scene, double distance) {
  return ofBodyPairs<SceneVertexContacts>(
      scene, [&](auto& result, const Scene& s) { s.vertexContacts(distance, result); });
}

template <typename Found, typename Begin = std::size_t>
void bindOfBodyPairs(py::module_& module, const char* name, const char* doc, const char* bodies_doc,
                     const char* begins_doc, const char* found_name, const char* found_doc) {
  using Result = OfBodyPairs<Found, Begin>;
  ResultClass<Result>(module, name, doc)
      .attribute("bodies", &Result::bodies, bodies_doc)
      .attribute("begins", &Result::begins, begins_doc)
      .attribute(found_name, &Result::found, found_doc)
      .length(&Result::bodies);
}

}  // namespace

void bindScenePairResults(py::module_& module) {
  constexpr const char *kBodies = "(P, 2) int64: numbers of bodies.",
                       *kDirected =
                           "(P, 2) int64: the mesh that has the vertices, and the other body: "
                           "each pair comes up to twice.";
  bindOfBodyPairs<Contacts>(
      module, "SceneCollisions", "Pairs of bodies that touch. len() counts the pairs.", kBodies,
      docs::kPairBegins, "contacts",
      "Contacts of all pairs, one after the other. Normals are as those of collide, but point from "
      "the first body to the second.");
  bindOfBodyPairs<TrianglePairs>(
      module, "SceneTrianglePairs",
      "Pairs of bodies with pairs of triangles that are near. len() counts "
      "the pairs of bodies.",
      kBodies, docs::kPairBegins, "found", "TrianglePairs of all pairs, one after the other.");
  bindOfBodyPairs<FeaturePairs, std::array<std::size_t, 3>>(
      module, "SceneFeaturePairs",
      "Pairs of bodies with pairs of features that are near. len() counts the pairs of bodies.",
      kBodies,
      "(P + 1, 3) int64: pair i has found.vertex_face from begins[i, 0] to begins[i + 1, 0], "
      "found.face_vertex by column 1 and found.edge_edge by column 2.",
      "found", "FeaturePairs of all pairs, one after the other.");
  bindOfBodyPairs<VertexContacts>(
      module, "SceneVertexContacts",
      "Pairs of bodies with contacts of vertices. len() counts the pairs of bodies.", kDirected,
      docs::kPairBegins, "found", "VertexContacts of all pairs, one after the other.");
}

void bindScenePairs(SceneClass& scene) {
  scene
      .def("collide", &sceneCollide, py::kw_only(), "contacts_per_pair"_a = py::none(),
           "enable_contact"_a = true, "first_only"_a = false, docs::kSceneCollide)
      .def("pairs_within", &scenePairsWithin, "distance"_a, py::kw_only(),
           "enable_distances"_a = false, "enable_nearest_points"_a = false, docs::kScenePairsWithin)
      .def("feature_pairs_within", &sceneFeaturePairs, "distance"_a, docs::kSceneFeaturePairsWithin)
      .def("vertex_contacts", &sceneVertexContacts, "distance"_a = 0., docs::kSceneVertexContacts)
      .def("is_nearer", reading(&Scene::isNearer), "distance"_a,
           "Whether any two bodies are at most `distance`, a length, apart.");
}

}  // namespace adaptive_bvh::python
