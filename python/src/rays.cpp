#include <limits>
#include <numeric>

#include "adaptive_bvh/point_query.h"
#include "arrays.h"
#include "bind.h"
#include "locked_mesh.h"
#include "results.h"

namespace adaptive_bvh::python {
namespace docs {
constexpr const char* kFirstHit =
    R"(Of each of many rays the first triangle that it meets.

origins, directions: (N, 3), or (3,) for one that all rays share, in the mesh's own frame; directions
    of any length but 0. Many rays in one call are faster than one by one.
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

/// Python's RayHits.
struct ManyHits : Bound {
  std::vector<int> rays, triangles;
  std::vector<double> t, u, v;
};

ManyHits manyHits(std::vector<int>&& rays, const std::vector<RayHit>& hits) {
  using H = RayHit;
  return {{},
          std::move(rays),
          column(hits, &H::triangle),
          column(hits, &H::t),
          column(hits, &H::u),
          column(hits, &H::v)};
}

ManyHits firstHitOf(const LockedMesh& mesh, const py::object& origins, const py::object& directions,
                    double begin, double end) {
  const RayArguments rays(origins, directions);
  std::vector<int> numbers(rays.origins.size());
  std::iota(numbers.begin(), numbers.end(), 0);
  const auto hits = find<std::vector<RayHit>>(mesh, [&](auto& found, const Mesh& m) {
    firstHits(m, rays.origins.begin(), rays.directions.begin(), numbers.size(), {begin, end},
              found);
  });
  return manyHits(std::move(numbers), hits);
}

py::array_t<bool> anyHitOf(const LockedMesh& mesh, const py::object& origins,
                           const py::object& directions, double begin, double end) {
  const RayArguments rays(origins, directions);
  return adopt(find<std::vector<std::uint8_t>>(mesh, [&](auto& hits, const Mesh& m) {
    anyHits(m, rays.origins.begin(), rays.directions.begin(), rays.origins.size(), {begin, end},
            hits);
  }));
}

ManyHits rayHitsOf(const LockedMesh& mesh, const py::object& origins, const py::object& directions,
                   double begin, double end) {
  const RayArguments rays(origins, directions);
  std::vector<int> numbers;
  std::vector<RayHit> of_ray, hits;
  mesh.query([&](const Mesh& m) {
    for (std::size_t i = 0; i < rays.origins.size(); ++i) {
      rayHits(m, rays.origins.begin()[i], rays.directions.begin()[i], {begin, end}, of_ray);
      numbers.insert(numbers.end(), of_ray.size(), static_cast<int>(i));
      hits.insert(hits.end(), of_ray.begin(), of_ray.end());
    }
  });
  return manyHits(std::move(numbers), hits);
}

void bindHitResults(py::module_& module) {
  using H = ManyHits;
  ResultClass<H>(module, "RayHits",
                 "Where rays meet triangles, in arrays side by side. len() counts the hits.")
      .attribute("rays", &H::rays, "(K,) int32: which of the rays.")
      .attribute("triangles", &H::triangles,
                 "(K,) int32: which triangle; -1 where a ray of first_hit meets nothing.")
      .attribute("t", &H::t,
                 "(K,) float64: the point is at origin + t * direction; infinite where a ray of "
                 "first_hit meets nothing.")
      .attribute("u", &H::u,
                 "(K,) float64: the point is (1 - u - v) a + u b + v c of the triangle's corners.")
      .attribute("v", &H::v, "(K,) float64, as u.")
      .length(&H::t);
}

}  // namespace

void bindRays(py::module_& module) {
  bindHitResults(module);
  const auto define = [&](const char* name, auto function, const char* doc) {
    module.def(name, function, "mesh"_a, "origins"_a, "directions"_a, py::kw_only(),
               "begin"_a = 0.0, "end"_a = std::numeric_limits<double>::infinity(), doc);
  };
  define("first_hit", &firstHitOf, docs::kFirstHit);
  define("any_hit", &anyHitOf, docs::kAnyHit);
  define("ray_hits", &rayHitsOf, docs::kRayHits);
}

}  // namespace adaptive_bvh::python
