#include <array>
#include <cstdint>
#include <limits>
#include <string>

#include <pybind11/stl.h>

#include "arrays.h"
#include "locked_scene.h"
#include "motions.h"
#include "results.h"

namespace adaptive_bvh::python {
namespace docs {
constexpr const char* kNearestBodies =
    R"(The k bodies nearest to one: a list of SceneDistance, by increasing distance, then number; fewer
where there are fewer.)";

constexpr const char* kSceneFirstHit =
    R"(The first hit of each of many rays: SceneRayHits with N entries. A ray hits the surface of a
shape where it enters, or if that is before `begin` where it leaves.

origins, directions: (N, 3), or (3,) for one ray, in the world; directions of any length but 0.
begin, end: hits count where begin <= t <= end.)";

constexpr const char* kSceneEarliestImpact =
    R"(The first two bodies that come together, or a mesh with itself with self_collision, and when:
SceneImpact. On the way from the last begin_step to the present: from those poses to these, vertices
from previous_vertices (or at rest where there are none) to the present ones, each point on a
straight line. With a shape the time is never late, and the impact has no kind; its pair has the
mesh's triangle and -1 for the shape.

distance: a length; so near they have come together.)";

constexpr const char* kSceneLargestSafeStep =
    R"(The time, 0 to 1, up to which nothing comes as near as `distance`, a length, in the step of
earliest_impact.)";

constexpr const char* kSceneLeastDistance =
    R"(The body that comes nearest to one in the step of earliest_impact: a SceneClearance. All others
stay at least upper - tolerance away.

tolerance: a length, the largest difference of both bounds.
path: 'straight' or 'screw', as of Motion, for all bodies.)";

constexpr const char* kSceneLeastDistances =
    R"(The k bodies that come nearest to one in the step: a list of SceneClearance, by increasing upper
bound, then number; fewer where there are fewer.)";

constexpr const char* kSceneIntervalsBelow =
    R"(All pairs of bodies that come nearer than `distance` in the step, and when: a list of tuples
(first body, second body, intervals), intervals as of intervals_below.)";

}  // namespace docs

namespace {

SceneClearance leastInScene(LockedScene& scene, BodyId body, double tolerance,
                            const std::string& path_name) {
  const FramePath path = framePath(path_name);
  return scene.changeWithMeshes([&](Scene& s) { return s.leastDistance(body, tolerance, path); });
}

std::vector<SceneClearance> leastDistancesOf(const LockedScene& scene, BodyId body, std::size_t k,
                                             double tolerance, const std::string& path_name) {
  const FramePath path = framePath(path_name);
  return find<std::vector<SceneClearance>>(scene, [&](auto& found, const Scene& s) {
    s.leastDistances(body, k, tolerance, path, found);
  });
}

py::list intervalsInScene(const LockedScene& scene, double distance, double tolerance,
                          const std::string& path_name) {
  const FramePath path = framePath(path_name);
  const auto found = find<SceneIntervals>(scene, [&](auto& result, const Scene& s) {
    s.intervalsBelow(distance, tolerance, path, result);
  });
  py::list pairs;
  for (std::size_t i = 0; i < found.pairs.size(); ++i) {
    std::vector<std::array<double, 2>> rows;
    for (std::size_t k = found.begins[i]; k < found.begins[i + 1]; ++k)
      rows.push_back({found.found[k].begin, found.found[k].end});
    pairs.append(
        py::make_tuple(found.pairs[i].first, found.pairs[i].second, adopt(std::move(rows))));
  }
  return pairs;
}

py::tuple bodiesOfClearance(const SceneClearance& found) {
  if (!found.exists()) return py::make_tuple(-1, -1);
  return py::make_tuple(found.bodies.first, found.bodies.second);
}

std::vector<SceneDistance> nearestBodies(const LockedScene& scene, BodyId body, std::size_t k) {
  return find<std::vector<SceneDistance>>(
      scene, [&](auto& found, const Scene& s) { s.nearest(body, k, found); });
}

ScenePoint nearestPointOf(const LockedScene& scene, const py::object& point) {
  const fcl::Vector3d x = pointFrom(point, "point");
  return scene.query([&](const Scene& s) { return s.nearestPoint(x); });
}

/// Python's SceneRayHits.
struct HitsOfBodies : Bound {
  std::vector<std::int64_t> bodies;
  std::vector<int> elements;
  std::vector<double> t, u, v;
};

HitsOfBodies firstHitsOf(const LockedScene& scene, const py::object& origins,
                         const py::object& directions, double begin, double end) {
  const RayArguments rays(origins, directions);
  const auto found = find<std::vector<SceneRayHit>>(scene, [&](auto& hits, const Scene& s) {
    s.firstHits(rays.origins.begin(), rays.directions.begin(), rays.origins.size(), {begin, end},
                hits);
  });
  HitsOfBodies hits;
  for (const auto& hit : found) hits.bodies.push_back(hit.exists() ? std::int64_t(hit.body) : -1);
  hits.elements = column(found, &SceneRayHit::element);
  hits.t = column(found, &SceneRayHit::t);
  hits.u = column(found, &SceneRayHit::u);
  hits.v = column(found, &SceneRayHit::v);
  return hits;
}

py::tuple bodiesOf(const SceneDistance& found) {
  if (!found.exists()) return py::make_tuple(-1, -1);
  return py::make_tuple(found.bodies.first, found.bodies.second);
}

std::int64_t bodyOf(const ScenePoint& found) {
  return found.exists() ? std::int64_t(found.body) : -1;
}

void bindNearestResults(py::module_& module) {
  using D = SceneDistance;
  ResultClass<D>(module, "SceneDistance", "Two bodies, and how far apart they are.")
      .attribute("bodies", &bodiesOf,
                 "Two numbers of bodies; of Scene.nearest the body that was asked for comes first. "
                 "-1 where there is no pair.")
      .attribute("distance", &D::distance,
                 "A length; 0 or, of a shape, less where they touch; infinite where there is no "
                 "pair.")
      .attribute("points", &D::points,
                 "(2, 3) float64: on the first body and on the second, in the world; NaN where "
                 "there is no pair.")
      .attribute("elements", &D::elements,
                 "(2,) int32: the triangles of these points; -1 of a shape.");
  using P = ScenePoint;
  ResultClass<P>(module, "ScenePoint", "The nearest point of all bodies of a Scene.")
      .attribute("body", &bodyOf, "Its number; -1 where there is no body.")
      .attribute("distance", &P::distance, "A length; infinite where there is no body.")
      .attribute("point", &P::point, "(3,) float64, in the world; NaN where there is no body.")
      .attribute("element", &P::element, "The triangle that has it; -1 of a shape.");
}

void bindClearanceResult(py::module_& module) {
  using C = SceneClearance;
  ResultClass<C>(module, "SceneClearance", "Two bodies, and how near they come in a step.")
      .attribute("bodies", &bodiesOfClearance,
                 "Two numbers of bodies, first that of the call; -1 where there is no pair.")
      .attribute("clearance", &C::clearance, "A MotionClearance, in the order of the bodies.");
}

void bindOtherResults(py::module_& module) {
  using H = HitsOfBodies;
  ResultClass<H>(module, "SceneRayHits",
                 "Where each of N rays meets the bodies of a Scene first. len() is N.")
      .attribute("bodies", &H::bodies, "(N,) int64; -1 where a ray meets nothing.")
      .attribute("elements", &H::elements,
                 "(N,) int32: the triangles; -1 where a ray meets a shape or nothing.")
      .attribute("t", &H::t,
                 "(N,) float64: the point is at origin + t * direction; infinite where a ray meets "
                 "nothing.")
      .attribute("u", &H::u,
                 "(N,) float64: the point is (1 - u - v) a + u b + v c of the triangle's corners; "
                 "0 of a shape.")
      .attribute("v", &H::v, "(N,) float64, as u.")
      .length(&H::t);
  ResultClass<SceneImpact> impact(module, "SceneImpact",
                                  "The first two bodies that come together.");
  impact
      .attribute(
          "bodies",
          [](const SceneImpact& i) { return py::make_tuple(i.bodies.first, i.bodies.second); },
          "Two numbers of bodies, the same twice where a body meets itself; without meaning where "
          "nothing comes together.")
      .attribute("impact", &SceneImpact::impact,
                 "An Impact: features of the first body and of the second, and the time.");
  (*impact).def_property_readonly("exists", &SceneImpact::exists,
                                  "Whether anything comes together.");
}

}  // namespace

void bindSceneResults(py::module_& module) {
  bindScenePairResults(module);
  bindNearestResults(module);
  bindClearanceResult(module);
  bindOtherResults(module);
}

namespace {

void bindNearestQueries(SceneClass& scene) {
  scene
      .def(
          "nearest",
          [](LockedScene& self, BodyId body) {
            return self.changeWithMeshes([&](Scene& s) { return s.nearest(body); });
          },
          "body"_a,
          "The body nearest to one, a SceneDistance. The scene remembers it: the next call starts "
          "from it.")
      .def("nearest", &nearestBodies, "body"_a, "k"_a, docs::kNearestBodies)
      .def(
          "distance",
          [](LockedScene& self) {
            return self.changeWithMeshes([](Scene& s) { return s.distance(); });
          },
          "The two bodies that are nearest, a SceneDistance. The scene remembers them: the next "
          "call starts from them.")
      .def("nearest_point", &nearestPointOf, "point"_a,
           "The point of the bodies' surfaces that is nearest to `point`, (3,), in the world: a "
           "ScenePoint.");
}

void bindRayAndStepQueries(SceneClass& scene) {
  scene
      .def("first_hit", &firstHitsOf, "origins"_a, "directions"_a, py::kw_only(), "begin"_a = 0.0,
           "end"_a = std::numeric_limits<double>::infinity(), docs::kSceneFirstHit)
      .def("earliest_impact", reading(&Scene::earliestImpact), "distance"_a = 0.0,
           docs::kSceneEarliestImpact)
      .def("largest_safe_step", reading(&Scene::largestSafeStep), "distance"_a = 0.0,
           docs::kSceneLargestSafeStep)
      .def("least_distance", &leastInScene, "body"_a, "tolerance"_a, "path"_a = "straight",
           docs::kSceneLeastDistance)
      .def("least_distances", &leastDistancesOf, "body"_a, "k"_a, "tolerance"_a,
           "path"_a = "straight", docs::kSceneLeastDistances)
      .def("intervals_below", &intervalsInScene, "distance"_a, "tolerance"_a, "path"_a = "straight",
           docs::kSceneIntervalsBelow);
}

}  // namespace

void bindSceneQueries(SceneClass& scene) {
  bindScenePairs(scene);
  bindNearestQueries(scene);
  bindRayAndStepQueries(scene);
}

}  // namespace adaptive_bvh::python
