#include <array>
#include <limits>
#include <optional>
#include <string>

#include <pybind11/stl.h>

#include "arrays.h"
#include "continuous.h"
#include "either.h"
#include "features.h"
#include "locked_scene.h"
#include "penetration.h"
#include "points.h"
#include "proximity.h"
#include "query.h"
#include "text.h"

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

constexpr const char* kNearestBodies =
    R"(The k bodies nearest to one: a list of SceneDistance, by increasing distance, then number; fewer
where there are fewer.)";

constexpr const char* kSceneFirstHit =
    R"(The first hit of each of many rays with the meshes: SceneRayHits with N entries. Shapes are not
met.

origins, directions: (N, 3), or (3,) for one ray, in the world; directions of any length but 0.
begin, end: hits count where begin <= t <= end.)";

constexpr const char* kSceneEarliestImpact =
    R"(The first two features of two meshes that come together, or of one with self_collision, and when:
SceneImpact. On the way from the last begin_step to the present: from those poses to these, vertices
from previous_vertices (or at rest where there are none) to the present ones, on straight lines.
Shapes have no part.

separation: a length; so near they have come together.)";

constexpr const char* kSceneLargestSafeStep =
    R"(The time, 0 to 1, up to which nothing comes as near as `separation`, a length, in the step of
earliest_impact.)";

constexpr const char* kPairOffsets =
    "(P + 1,) int64: pair i of bodies has what stands from offsets[i] to offsets[i + 1].";
}  // namespace docs

namespace {

using LongArray = py::array_t<std::int64_t>;

/// Pairs of bodies, and what was found for them. Python's SceneCollisions and others.
template <typename Found>
struct OfBodyPairs : Bound {
  LongArray bodies, offsets;
  Found found;
};

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

/// Python's SceneDistance.
struct BodyGap : Bound {
  std::int64_t first, second;
  double distance;
  std::array<double, 6> points;
  std::array<std::int32_t, 2> triangles;
};

template <typename S>
BodyGap gapOf(const SceneDistance<S>& found) {
  BodyGap gap;
  gap.first = found.exists() ? std::int64_t(found.bodies.first) : -1;
  gap.second = found.exists() ? std::int64_t(found.bodies.second) : -1;
  gap.distance = double(found.distance);
  for (std::size_t side = 0; side < 2; ++side)
    for (int k = 0; k < 3; ++k)
      gap.points[3 * side + std::size_t(k)] = double(found.points[side][k]);
  gap.triangles = found.elements;
  return gap;
}

std::vector<BodyGap> nearestBodies(const LockedScene& scene, BodyId body, std::size_t k) {
  return scene.query([&](const auto& s) {
    std::vector<SceneDistance<SceneScalar<decltype(s)>>> found;
    s.nearest(body, k, found);
    std::vector<BodyGap> gaps;
    for (const auto& one : found) gaps.push_back(gapOf(one));
    return gaps;
  });
}

/// Python's ScenePoint.
struct PointOnBody : Bound {
  std::int64_t body = -1;
  double distance = std::numeric_limits<double>::infinity();
  std::array<double, 3> point{};
  std::int32_t triangle = -1;
};

PointOnBody nearestPointOf(const LockedScene& scene, const py::object& point) {
  const Eigen::Vector3d x = pointFrom<double>(point, "point");
  return scene.query([&](const auto& s) {
    const auto found = s.nearestPoint(x.template cast<SceneScalar<decltype(s)>>());
    PointOnBody nearest;
    if (found.triangle >= 0) nearest.body = found.body;
    nearest.distance = double(found.distance);
    for (int k = 0; k < 3; ++k) nearest.point[std::size_t(k)] = double(found.point[k]);
    nearest.triangle = found.triangle;
    return nearest;
  });
}

/// Python's SceneRayHits.
struct HitsOfBodies : Bound {
  LongArray bodies;
  py::array_t<std::int32_t> triangles;
  py::array_t<double> t, u, v;
};

template <typename S>
HitsOfBodies castRays(const LockedScene& scene, const py::object& origins,
                      const py::object& directions, double begin, double end) {
  const Rays<S> rays(origins, directions);
  const std::size_t count = rays.size();
  const auto *from = pointsOf<S>(rays.origins), *along = pointsOf<S>(rays.directions);
  std::vector<SceneRayHit<S>> hits;
  scene.query([&](const auto& s) {
    if constexpr (std::is_same_v<SceneScalar<decltype(s)>, S>)
      s.firstHits(from, along, count, {static_cast<S>(begin), static_cast<S>(end)}, hits);
  });
  const auto n = static_cast<py::ssize_t>(count);
  const auto numbers = [&](auto number) {
    std::vector<decltype(number(hits[0]))> list;
    list.reserve(count);
    for (const SceneRayHit<S>& hit : hits) list.push_back(number(hit));
    return list;
  };
  HitsOfBodies arrays;
  arrays.bodies =
      adopt<std::int64_t>(numbers([](const auto& hit) {
                            return hit.hit.triangle < 0 ? std::int64_t(-1) : std::int64_t(hit.body);
                          }),
                          {n});
  arrays.triangles =
      adopt<std::int32_t>(numbers([](const auto& hit) { return hit.hit.triangle; }), {n});
  arrays.t = adopt<double>(numbers([](const auto& hit) { return double(hit.hit.t); }), {n});
  arrays.u = adopt<double>(numbers([](const auto& hit) { return double(hit.hit.u); }), {n});
  arrays.v = adopt<double>(numbers([](const auto& hit) { return double(hit.hit.v); }), {n});
  return arrays;
}

/// Python's SceneImpact.
struct ImpactOfBodies : Bound {
  BodyPair bodies;
  FirstImpact impact;
};

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

void bindPairResults(py::module_& module) {
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

void bindNearestResults(py::module_& module) {
  py::class_<BodyGap>(module, "SceneDistance", "Two bodies, and how far apart they are.")
      .def_property_readonly(
          "bodies", [](const BodyGap& self) { return py::make_tuple(self.first, self.second); },
          "Two numbers of bodies; of Scene.nearest the body that was asked for comes first. -1 "
          "where there is no pair.")
      .def_readonly("distance", &BodyGap::distance,
                    "A length; 0 or, of a shape, less where they touch; infinite where there is no "
                    "pair.")
      .def_property_readonly(
          "points",
          [](const BodyGap& self) {
            return py::array_t<double>({2, 3}, self.points.data());
          },
          "(2, 3) float64: on the first body and on the second, in the world; NaN where there is "
          "no pair.")
      .def_property_readonly(
          "triangles",
          [](const BodyGap& self) { return py::array_t<std::int32_t>(2, self.triangles.data()); },
          "(2,) int32: those of these points; -1 of a shape.")
      .def("__repr__", TextOf({"bodies", "distance", "points", "triangles"}));
  py::class_<PointOnBody>(module, "ScenePoint", "The nearest point of all meshes of a Scene.")
      .def_readonly("body", &PointOnBody::body, "Its number; -1 where there is no mesh.")
      .def_readonly("distance", &PointOnBody::distance,
                    "A length; infinite where there is no mesh.")
      .def_property_readonly(
          "point",
          [](const PointOnBody& self) { return py::array_t<double>(3, self.point.data()); },
          "(3,) float64, in the world; NaN where there is no mesh.")
      .def_readonly("triangle", &PointOnBody::triangle, "That has it; -1 where there is no mesh.")
      .def("__repr__", TextOf({"body", "distance", "point", "triangle"}));
}

void bindOtherResults(py::module_& module) {
  py::class_<HitsOfBodies>(module, "SceneRayHits",
                           "Where each of N rays meets the meshes of a Scene first. len() is N.")
      .def_readonly("bodies", &HitsOfBodies::bodies, "(N,) int64; -1 where a ray meets nothing.")
      .def_readonly("triangles", &HitsOfBodies::triangles,
                    "(N,) int32; -1 where a ray meets nothing.")
      .def_readonly("t", &HitsOfBodies::t,
                    "(N,) float64: the point is at origin + t * direction; infinite where a ray "
                    "meets nothing.")
      .def_readonly(
          "u", &HitsOfBodies::u,
          "(N,) float64: the point is (1 - u - v) a + u b + v c of the triangle's corners.")
      .def_readonly("v", &HitsOfBodies::v, "(N,) float64, as u.")
      .def("__len__", [](const HitsOfBodies& self) { return self.t.shape(0); })
      .def("__repr__", TextOf({"bodies", "triangles", "t", "u", "v"}));
  py::class_<ImpactOfBodies>(module, "SceneImpact", "The first two bodies that come together.")
      .def_property_readonly(
          "bodies",
          [](const ImpactOfBodies& self) {
            return py::make_tuple(self.bodies.first, self.bodies.second);
          },
          "Two numbers of bodies, the same twice where a body meets itself; without meaning where "
          "nothing happens.")
      .def_property_readonly(
          "impact", [](const ImpactOfBodies& self) -> FirstImpact { return self.impact; },
          "An Impact: features of the first body and of the second, and the time.")
      .def_property_readonly(
          "happens", [](const ImpactOfBodies& self) { return self.impact.impact.happens(); },
          "Whether anything comes together.")
      .def("__repr__", TextOf({"bodies", "impact"}));
}

}  // namespace

void bindSceneResults(py::module_& module) {
  bindPairResults(module);
  bindNearestResults(module);
  bindOtherResults(module);
}

namespace {

void bindPairQueries(SceneClass& scene) {
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

void bindNearestQueries(SceneClass& scene) {
  scene
      .def(
          "nearest",
          [](LockedScene& self, BodyId body) {
            return self.changeWithMeshes([&](auto& s) { return gapOf(s.nearest(body)); });
          },
          py::arg("body"),
          "The body nearest to one, a SceneDistance. The scene remembers it: the next call starts "
          "from it.")
      .def("nearest", &nearestBodies, py::arg("body"), py::arg("k"), docs::kNearestBodies)
      .def(
          "distance",
          [](LockedScene& self) {
            return self.changeWithMeshes([&](auto& s) { return gapOf(s.distance()); });
          },
          "The two bodies that are nearest, a SceneDistance. The scene remembers them: the next "
          "call starts from them.")
      .def("nearest_point", &nearestPointOf, py::arg("point"),
           "The point of the meshes' surfaces that is nearest to `point`, (3,), in the world: a "
           "ScenePoint.");
}

void bindRayAndStepQueries(SceneClass& scene) {
  scene
      .def(
          "first_hit",
          [](const LockedScene& self, const py::object& origins, const py::object& directions,
             double begin, double end) {
            return self.isDouble() ? castRays<double>(self, origins, directions, begin, end)
                                   : castRays<float>(self, origins, directions, begin, end);
          },
          py::arg("origins"), py::arg("directions"), py::kw_only(), py::arg("begin") = 0.0,
          py::arg("end") = std::numeric_limits<double>::infinity(), docs::kSceneFirstHit)
      .def(
          "earliest_impact",
          [](const LockedScene& self, double separation) {
            const SceneImpact found =
                self.query([&](const auto& s) { return s.earliestImpact(separation); });
            return ImpactOfBodies{{}, found.bodies, {{}, found.impact}};
          },
          py::arg("separation") = 0.0, docs::kSceneEarliestImpact)
      .def(
          "largest_safe_step",
          [](const LockedScene& self, double separation) {
            return self.query([&](const auto& s) { return s.largestSafeStep(separation); });
          },
          py::arg("separation") = 0.0, docs::kSceneLargestSafeStep);
}

}  // namespace

void bindSceneQueries(SceneClass& scene) {
  bindPairQueries(scene);
  bindNearestQueries(scene);
  bindRayAndStepQueries(scene);
}

}  // namespace adaptive_bvh::python
