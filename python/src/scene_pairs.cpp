#include <limits>
#include <optional>

#include <pybind11/stl.h>

#include "arrays.h"
#include "either.h"
#include "features.h"
#include "locked_scene.h"
#include "penetration.h"
#include "proximity.h"
#include "query.h"
#include "scene_results.h"
#include "text.h"

// Queries of all pairs of bodies.
namespace adaptive_bvh::python {
namespace docs {
constexpr const char* kCollisions =
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
    R"(Vertices of meshes that are at most `margin`, a length, from another body, or inside of it:
SceneVertexContacts. The other body is a shape or a closed mesh; meshes that are not closed have no
inside and are left out.)";

constexpr const char* kPairOffsets =
    "(P + 1,) int64: pair i of bodies has what stands from offsets[i] to offsets[i + 1].";
}  // namespace docs

namespace {

using LongArray = py::array_t<std::int64_t>;

template <typename Result>
void setBodies(const Result& result, LongArray& bodies, LongArray& offsets) {
  std::vector<std::int64_t> ids, begins;
  for (const BodyPair& pair : result.pairs) {
    ids.push_back(pair.first);
    ids.push_back(pair.second);
  }
  const auto pairs = static_cast<py::ssize_t>(result.pairs.size());
  bodies = adopt<std::int64_t>(std::move(ids), {pairs, 2});
  using Offset = std::decay_t<decltype(result.offsets[0])>;
  constexpr auto kKinds = static_cast<py::ssize_t>(sizeof(Offset) / sizeof(std::size_t));
  for (const Offset& offset : result.offsets)
    for (py::ssize_t k = 0; k < kKinds; ++k)
      begins.push_back(static_cast<std::int64_t>(reinterpret_cast<const std::size_t*>(&offset)[k]));
  const auto shape = kKinds == 1 ? std::vector<py::ssize_t>{pairs + 1}
                                 : std::vector<py::ssize_t>{pairs + 1, kKinds};
  offsets = adopt<std::int64_t>(std::move(begins), shape);
}

/// Runs query(scene, result) and makes arrays of the result.
template <template <typename> class Result, typename Query, typename Arrays>
auto queryPairsOf(const LockedScene& scene, const Query& query, const Arrays& arraysOf) {
  Either<Result> result;
  scene.query([&](const auto& s) { query(s, result.template as<SceneScalar<decltype(s)>>()); });
  return std::move(result).take(scene.isDouble(), [&](auto&& r) {
    OfBodyPairs<decltype(arraysOf(std::move(r)))> arrays;
    setBodies(r, arrays.bodies, arrays.offsets);
    arrays.found = arraysOf(std::move(r));
    return arrays;
  });
}

OfBodyPairs<Contacts> collisionsOf(const LockedScene& scene,
                                   const std::optional<std::size_t>& contacts_per_pair,
                                   bool enable_contact, bool first_only) {
  SceneCollisionRequest request;
  if (contacts_per_pair) request.contacts_per_pair = *contacts_per_pair;
  request.enable_contact = enable_contact;
  request.first_only = first_only;
  return queryPairsOf<SceneCollisions>(
      scene, [&](const auto& s, auto& result) { s.collisions(request, result); },
      [](auto&& result) {
        ContactLists lists;
        for (const auto& contact : result.contacts) lists.add(contact, false);
        return std::move(lists).arrays();
      });
}

OfBodyPairs<NearPairs> scenePairsWithin(const LockedScene& scene, double distance,
                                        bool enable_distances, bool enable_nearest_points) {
  return queryPairsOf<SceneTrianglePairs>(
      scene,
      [&](const auto& s, auto& result) {
        using S = SceneScalar<decltype(s)>;
        s.pairsWithin({static_cast<S>(distance), enable_distances, enable_nearest_points, {}},
                      result);
      },
      [](auto&& result) { return nearPairs(std::move(result.found)); });
}

OfBodyPairs<FeatureArrays> sceneFeaturePairs(const LockedScene& scene, double distance) {
  SceneFeaturePairs result;
  scene.query([&](const auto& s) {
    s.featurePairsWithin(static_cast<SceneScalar<decltype(s)>>(distance), result);
  });
  OfBodyPairs<FeatureArrays> arrays;
  setBodies(result, arrays.bodies, arrays.offsets);
  arrays.found = FeatureArrays(std::move(result.found));
  return arrays;
}

OfBodyPairs<ContactArrays> sceneVertexContacts(const LockedScene& scene, double margin) {
  return queryPairsOf<SceneVertexContacts>(
      scene,
      [&](const auto& s, auto& result) {
        s.vertexContacts(static_cast<SceneScalar<decltype(s)>>(margin), result);
      },
      [](auto&& result) { return contactArrays(std::move(result.found)); });
}

template <typename Found>
void bindOfBodyPairs(py::module_& module, const char* name, const char* doc, const char* bodies_doc,
                     const char* offsets_doc, const char* found_name, const char* found_doc) {
  using Result = OfBodyPairs<Found>;
  py::class_<Result>(module, name, doc)
      .def_readonly("bodies", &Result::bodies, bodies_doc)
      .def_readonly("offsets", &Result::offsets, offsets_doc)
      // A copy, which shares the arrays: objects of Python own what they hold (bound.h).
      .def_property_readonly(
          found_name, [](const Result& self) -> Found { return self.found; }, found_doc)
      .def("__len__", [](const Result& self) { return self.bodies.shape(0); })
      .def("__repr__", TextOf({"bodies", "offsets", found_name}));
}

}  // namespace

void bindScenePairResults(py::module_& module) {
  constexpr const char *kBodies = "(P, 2) int64: numbers of bodies.",
                       *kDirected =
                           "(P, 2) int64: the mesh that has the vertices, and the other body: "
                           "each pair comes up to twice.";
  bindOfBodyPairs<Contacts>(
      module, "SceneCollisions", "Pairs of bodies that touch. len() counts the pairs.", kBodies,
      docs::kPairOffsets, "contacts",
      "Contacts of all pairs, one after the other. Normals are as those of collide, but point from "
      "the first body to the second.");
  bindOfBodyPairs<NearPairs>(module, "SceneTrianglePairs",
                             "Pairs of bodies with pairs of triangles that are near. len() counts "
                             "the pairs of bodies.",
                             kBodies, docs::kPairOffsets, "found",
                             "TrianglePairs of all pairs, one after the other.");
  bindOfBodyPairs<FeatureArrays>(
      module, "SceneFeaturePairs",
      "Pairs of bodies with pairs of features that are near. len() counts the pairs of bodies.",
      kBodies,
      "(P + 1, 3) int64: pair i has found.vertex_face from offsets[i, 0] to offsets[i + 1, 0], "
      "found.face_vertex by column 1 and found.edge_edge by column 2.",
      "found", "FeaturePairs of all pairs, one after the other.");
  bindOfBodyPairs<ContactArrays>(
      module, "SceneVertexContacts",
      "Pairs of bodies with contacts of vertices. len() counts the pairs of bodies.", kDirected,
      docs::kPairOffsets, "found", "VertexContacts of all pairs, one after the other.");
}

void bindScenePairs(SceneClass& scene) {
  scene
      .def("collisions", &collisionsOf, py::kw_only(), py::arg("contacts_per_pair") = py::none(),
           py::arg("enable_contact") = true, py::arg("first_only") = false, docs::kCollisions)
      .def("pairs_within", &scenePairsWithin, py::arg("distance"), py::kw_only(),
           py::arg("enable_distances") = false, py::arg("enable_nearest_points") = false,
           docs::kScenePairsWithin)
      .def("feature_pairs_within", &sceneFeaturePairs, py::arg("distance"),
           docs::kSceneFeaturePairsWithin)
      .def("vertex_contacts", &sceneVertexContacts, py::arg("margin") = 0.,
           docs::kSceneVertexContacts)
      .def(
          "is_nearer",
          [](const LockedScene& self, double distance) {
            return self.query([&](const auto& s) {
              return s.isNearer(static_cast<SceneScalar<decltype(s)>>(distance));
            });
          },
          py::arg("distance"), "Whether any two bodies are at most `distance`, a length, apart.");
}

}  // namespace adaptive_bvh::python
