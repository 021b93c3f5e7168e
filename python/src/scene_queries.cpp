#include <array>
#include <limits>

#include <pybind11/stl.h>

#include "arrays.h"
#include "continuous.h"
#include "locked_scene.h"
#include "rays.h"
#include "scene_results.h"
#include "text.h"

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

separation: a length; so near they have come together.)";

constexpr const char* kSceneLargestSafeStep =
    R"(The time, 0 to 1, up to which nothing comes as near as `separation`, a length, in the step of
earliest_impact.)";

}  // namespace docs

namespace {

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
    if (found.exists()) nearest.body = found.body;
    nearest.distance = double(found.distance);
    for (int k = 0; k < 3; ++k) nearest.point[std::size_t(k)] = double(found.point[k]);
    nearest.triangle = found.triangle;
    return nearest;
  });
}

/// Python's SceneRayHits.
struct HitsOfBodies : Bound {
  py::array_t<std::int64_t> bodies;
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
                            return hit.exists() ? std::int64_t(hit.body) : std::int64_t(-1);
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
  py::class_<PointOnBody>(module, "ScenePoint", "The nearest point of all bodies of a Scene.")
      .def_readonly("body", &PointOnBody::body, "Its number; -1 where there is no body.")
      .def_readonly("distance", &PointOnBody::distance,
                    "A length; infinite where there is no body.")
      .def_property_readonly(
          "point",
          [](const PointOnBody& self) { return py::array_t<double>(3, self.point.data()); },
          "(3,) float64, in the world; NaN where there is no body.")
      .def_readonly("triangle", &PointOnBody::triangle, "That has it; -1 of a shape.")
      .def("__repr__", TextOf({"body", "distance", "point", "triangle"}));
}

void bindOtherResults(py::module_& module) {
  py::class_<HitsOfBodies>(module, "SceneRayHits",
                           "Where each of N rays meets the bodies of a Scene first. len() is N.")
      .def_readonly("bodies", &HitsOfBodies::bodies, "(N,) int64; -1 where a ray meets nothing.")
      .def_readonly("triangles", &HitsOfBodies::triangles,
                    "(N,) int32; -1 where a ray meets a shape or nothing.")
      .def_readonly("t", &HitsOfBodies::t,
                    "(N,) float64: the point is at origin + t * direction; infinite where a ray "
                    "meets nothing.")
      .def_readonly(
          "u", &HitsOfBodies::u,
          "(N,) float64: the point is (1 - u - v) a + u b + v c of the triangle's corners; 0 of a "
          "shape.")
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
  bindScenePairResults(module);
  bindNearestResults(module);
  bindOtherResults(module);
}

namespace {

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
           "The point of the bodies' surfaces that is nearest to `point`, (3,), in the world: a "
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
  bindScenePairs(scene);
  bindNearestQueries(scene);
  bindRayAndStepQueries(scene);
}

}  // namespace adaptive_bvh::python
