#include "rays.h"

#include <limits>

#include "adaptive_bvh/point_query.h"
#include "locked_mesh.h"
#include "text.h"

namespace adaptive_bvh::python {
namespace docs {
constexpr const char* kFirstHit =
    R"(Of each of many rays the first triangle that it meets.

origins, directions: (N, 3), or (3,) for one ray, in the mesh's own frame; directions of any length
    but 0. Many rays in one call are faster than one by one.
begin, end: hits count where begin <= t <= end. ValueError when begin is negative or end is less.
Returns RayHits with N entries: t is infinite and the triangle -1 where a ray meets nothing.)";

constexpr const char* kAnyHit =
    R"(Of each of many rays whether it meets a triangle (occlusion): (N,) bool. Faster than first_hit.

origins, directions, begin, end: as of first_hit. The segment from a point to another is the ray
along their difference from 0 to 1.)";

constexpr const char* kRayHits =
    R"(All triangles that rays meet: of each ray by increasing t.

origins, directions, begin, end: as of first_hit. Sides and corners belong to each triangle that has
    them: no ray slips between two.
Returns RayHits; `rays` says which ray.)";
}  // namespace docs

namespace {

/// One ray becomes a list of one.
py::object listed(const py::object& rows, const char* name) {
  py::array array = numbersFrom(rows, name);
  return array.ndim() == 1 ? py::object(array.reshape({py::ssize_t(1), py::ssize_t(-1)}))
                           : py::object(array);
}

}  // namespace

template <typename S>
Rays<S>::Rays(const py::object& from, const py::object& along)
    : origins(rowsFrom<S>(listed(from, "origins"), "origins")),
      directions(rowsFrom<S>(listed(along, "directions"), "directions")) {
  if (origins.shape(0) != directions.shape(0))
    throw py::value_error("there are " + std::to_string(origins.shape(0)) + " origins and " +
                          std::to_string(directions.shape(0)) + " directions");
}
template struct Rays<double>;
template struct Rays<float>;

namespace {

struct ManyHits : Bound {
  py::array_t<std::int32_t> rays, triangles;
  py::array_t<double> t, u, v;
};

/// Hits side by side, before they become arrays.
struct HitLists {
  std::vector<int> rays, triangles;
  std::vector<double> t, u, v;

  template <typename S>
  void add(int ray, const RayHit<S>& hit) {
    rays.push_back(ray);
    triangles.push_back(hit.triangle);
    t.push_back(double(hit.t));
    u.push_back(double(hit.u));
    v.push_back(double(hit.v));
  }

  ManyHits arrays() && {
    const auto count = static_cast<py::ssize_t>(rays.size());
    ManyHits hits;
    hits.rays = adopt<std::int32_t>(std::move(rays), {count});
    hits.triangles = adopt<std::int32_t>(std::move(triangles), {count});
    hits.t = adopt<double>(std::move(t), {count});
    hits.u = adopt<double>(std::move(u), {count});
    hits.v = adopt<double>(std::move(v), {count});
    return hits;
  }
};

/// From `begin` to `end`, as S.
template <typename S>
RayRange<S> rangeOf(double begin, double end) {
  return {static_cast<S>(begin), static_cast<S>(end)};
}

/// Runs query(mesh, origins, directions, count, range).
template <typename Query>
void queryRays(const LockedMesh& mesh, const py::object& origins, const py::object& directions,
               double begin, double end, const Query& query) {
  mesh.withScalar([&](auto scalar) {
    using S = decltype(scalar);
    const Rays<S> rays(origins, directions);
    const std::size_t count = rays.size();
    const auto *from = pointsOf<S>(rays.origins), *along = pointsOf<S>(rays.directions);
    mesh.queryAs<S>([&](const auto& m) { query(m, from, along, count, rangeOf<S>(begin, end)); });
  });
}

ManyHits firstHitOf(const LockedMesh& mesh, const py::object& origins, const py::object& directions,
                    double begin, double end) {
  HitLists lists;
  queryRays(mesh, origins, directions, begin, end,
            [&](const auto& m, auto* from, auto* along, std::size_t count, const auto& range) {
              std::vector<RayHit<ScalarOf<decltype(m)>>> result;
              firstHits(m, from, along, count, range, result);
              for (std::size_t i = 0; i < count; ++i) lists.add(int(i), result[i]);
            });
  return std::move(lists).arrays();
}

py::array_t<bool> anyHitOf(const LockedMesh& mesh, const py::object& origins,
                           const py::object& directions, double begin, double end) {
  std::vector<std::uint8_t> result;
  queryRays(mesh, origins, directions, begin, end,
            [&](const auto& m, auto* from, auto* along, std::size_t count, const auto& range) {
              anyHits(m, from, along, count, range, result);
            });
  const auto count = static_cast<py::ssize_t>(result.size());
  return adopt<bool>(std::move(result), {count});
}

ManyHits rayHitsOf(const LockedMesh& mesh, const py::object& origins, const py::object& directions,
                   double begin, double end) {
  HitLists lists;
  queryRays(mesh, origins, directions, begin, end,
            [&](const auto& m, auto* from, auto* along, std::size_t count, const auto& range) {
              std::vector<RayHit<ScalarOf<decltype(m)>>> result;
              for (std::size_t i = 0; i < count; ++i) {
                rayHits(m, from[i], along[i], range, result);
                for (const auto& hit : result) lists.add(int(i), hit);
              }
            });
  return std::move(lists).arrays();
}

void bindHitResults(py::module_& module) {
  py::class_<ManyHits>(module, "RayHits",
                       "Where rays meet triangles, in arrays side by side. len() counts the hits.")
      .def_readonly("rays", &ManyHits::rays, "(K,) int32: which of the rays.")
      .def_readonly("triangles", &ManyHits::triangles,
                    "(K,) int32: which triangle; -1 where a ray of first_hit meets nothing.")
      .def_readonly("t", &ManyHits::t,
                    "(K,) float64: the point is at origin + t * direction; infinite where a ray of "
                    "first_hit meets nothing.")
      .def_readonly(
          "u", &ManyHits::u,
          "(K,) float64: the point is (1 - u - v) a + u b + v c of the triangle's corners.")
      .def_readonly("v", &ManyHits::v, "(K,) float64, as u.")
      .def("__len__", [](const ManyHits& self) { return self.t.shape(0); })
      .def("__repr__", TextOf({"rays", "triangles", "t", "u", "v"}));
}

}  // namespace

void bindRays(py::module_& module) {
  bindHitResults(module);
  const auto define = [&](const char* name, auto function, const char* doc) {
    module.def(name, function, py::arg("mesh"), py::arg("origins"), py::arg("directions"),
               py::kw_only(), py::arg("begin") = 0.0,
               py::arg("end") = std::numeric_limits<double>::infinity(), doc);
  };
  define("first_hit", &firstHitOf, docs::kFirstHit);
  define("any_hit", &anyHitOf, docs::kAnyHit);
  define("ray_hits", &rayHitsOf, docs::kRayHits);
}

}  // namespace adaptive_bvh::python
