#include <limits>

#include "adaptive_bvh/proximity.h"
#include "bind.h"
#include "ignored.h"
#include "objects.h"
#include "query.h"
#include "results.h"

namespace adaptive_bvh::python {
namespace docs {
constexpr const char* kIsNearer =
    R"(Whether two meshes, or a mesh and a shape, are at most `distance`, a length, apart. Much cheaper
than their distance. ValueError when it is negative or NaN.

tf1, tf2: poses that place them in the world.
solid: meshes are filled: also true where a component of one body is inside of the other, however far
    from its surface. ValueError when a mesh is open; the message names an edge.)";

constexpr const char* kPairsWithin =
    R"(All pairs of a triangle of the first mesh and one of the second at most `distance`, a length, apart.
ValueError when it is negative or NaN.

tf1, tf2: poses that place them in the world.
enable_distances, enable_nearest_points: also compute these.
ignored: pairs of triangles to leave out, (M, 2) integers in any order, or None.
Returns TrianglePairs. Pairs keep their order from step to step.)";

constexpr const char* kPairsWithinSelf =
    R"(As pairs_within, of one mesh with itself, in its own frame: each pair once, the smaller index
first.

ignored: as of self_collide, but not the neighbours 'beyond shared'.)";

constexpr const char* kFeaturePairsWithin =
    R"(All pairs of a vertex and a face, and of two edges, at most `distance`, a length, apart.
ValueError when it is negative or NaN.

tf1, tf2: poses that place the meshes in the world.
ignored: pairs of features to leave out, FeaturePairs in any order, or None. Returns FeaturePairs.)";

constexpr const char* kFeaturePairsWithinSelf =
    R"(As feature_pairs_within, of one mesh with itself, without features that have a vertex in common.

ignored: FeaturePairs, a SurfaceNeighbourhood, Ignored for both, or None.)";

constexpr const char* kVertexDistances =
    R"(For every vertex of `first` its distance to the surface of `second`: (num_vertices,) float64.

Exact where it is less than `limit`, a length, and `limit` elsewhere. A small limit is fast.
ValueError when it is negative or NaN.
tf1, tf2: poses that place the meshes in the world.)";

constexpr const char* kSignedVertexDistances =
    R"(As vertex_distances, with a negative sign for a vertex inside of `second`, which must be closed.

-limit is deep inside. ValueError when an edge of `second` has no neighbour.)";
}  // namespace docs

namespace {

template <typename Other>
bool isNearerOf(const LockedMesh& first, const Other& second, double distance,
                const py::object& tf1, const py::object& tf2, bool solid) {
  return queryPlaced(first, second, Poses(tf1, tf2),
                     [&](const auto&... placed) { return isNearer(placed..., distance, solid); });
}

TrianglePairs pairsWithinOf(const LockedMesh& first, const LockedMesh& second, double distance,
                            const py::object& tf1, const py::object& tf2, bool distances,
                            bool points, const py::object& ignored) {
  const IgnoredArgument out(ignored, IgnoredArgument::Triangles, false);
  const ProximityRequest request{distance, distances, points, out.get()};
  return findPlaced<TrianglePairs>(
      first, second, Poses(tf1, tf2),
      [&](auto& result, const auto&... placed) { pairsWithin(placed..., request, result); });
}

TrianglePairs pairsWithinSelf(const LockedMesh& mesh, double distance, bool distances, bool points,
                              const py::object& ignored) {
  const IgnoredArgument out(ignored, IgnoredArgument::Triangles, true);
  const ProximityRequest request{distance, distances, points, out.get()};
  return find<TrianglePairs>(
      mesh, [&](auto& result, const Mesh& m) { selfPairsWithin(m, request, result); });
}

FeaturePairs featurePairsOf(const LockedMesh& first, const LockedMesh& second, double distance,
                            const py::object& tf1, const py::object& tf2,
                            const py::object& ignored) {
  const IgnoredArgument out(ignored, IgnoredArgument::Features, false);
  const FeatureProximityRequest request{distance, out.get()};
  return findPlaced<FeaturePairs>(
      first, second, Poses(tf1, tf2),
      [&](auto& pairs, const auto&... placed) { featurePairsWithin(placed..., request, pairs); });
}

FeaturePairs featurePairsSelf(const LockedMesh& mesh, double distance, const py::object& ignored) {
  const IgnoredArgument out(ignored, IgnoredArgument::Features, true);
  const FeatureProximityRequest request{distance, out.get()};
  return find<FeaturePairs>(
      mesh, [&](auto& pairs, const Mesh& m) { selfFeaturePairsWithin(m, request, pairs); });
}

void bindVertexDistances(py::module_& module) {
  const auto define = [&](const char* name, auto* query, const char* doc) {
    module.def(
        name,
        [query](const LockedMesh& first, const LockedMesh& second, double limit,
                const py::object& tf1, const py::object& tf2) {
          return adopt(findPlaced<std::vector<double>>(
              first, second, Poses(tf1, tf2),
              [&](auto& result, const auto&... placed) { query(placed..., limit, result); }));
        },
        "first"_a, "second"_a, "limit"_a = std::numeric_limits<double>::infinity(), py::kw_only(),
        "tf1"_a = py::none(), "tf2"_a = py::none(), doc);
  };
  define("vertex_distances", &vertexDistances, docs::kVertexDistances);
  define("signed_vertex_distances", &signedVertexDistances, docs::kSignedVertexDistances);
}

void bindNearPairs(py::module_& module) {
  using P = TrianglePairs;
  ResultClass<P>(module, "TrianglePairs",
                 "Pairs of triangles in arrays side by side. len() counts them.")
      .attribute("triangles", &P::triangles, "(K, 2) int32.")
      .attribute("distances", &P::distances,
                 "(K,) float64, lengths, 0 where they touch; (0,) unless they were enabled.")
      .attribute("nearest_points", &P::nearest_points,
                 "(K, 2, 3) float64, in the world: of the first triangle and of the second; (0, 2, "
                 "3) unless they were enabled.")
      .length(&P::triangles);
}

}  // namespace

void bindProximity(py::module_& module) {
  bindNearPairs(module);
  const auto define = [&](auto function) {
    module.def("is_nearer", function, "first"_a, "second"_a, "distance"_a, py::kw_only(),
               "tf1"_a = py::none(), "tf2"_a = py::none(), "solid"_a = false, docs::kIsNearer);
  };
  define(&isNearerOf<LockedMesh>);
  define(&isNearerOf<Shape>);
  module.def("pairs_within", &pairsWithinOf, "first"_a, "second"_a, "distance"_a, py::kw_only(),
             "tf1"_a = py::none(), "tf2"_a = py::none(), "enable_distances"_a = false,
             "enable_nearest_points"_a = false, "ignored"_a = py::none(), docs::kPairsWithin);
  module.def("self_pairs_within", &pairsWithinSelf, "mesh"_a, "distance"_a, py::kw_only(),
             "enable_distances"_a = false, "enable_nearest_points"_a = false,
             "ignored"_a = py::none(), docs::kPairsWithinSelf);
  module.def("feature_pairs_within", &featurePairsOf, "first"_a, "second"_a, "distance"_a,
             py::kw_only(), "tf1"_a = py::none(), "tf2"_a = py::none(), "ignored"_a = py::none(),
             docs::kFeaturePairsWithin);
  module.def("self_feature_pairs_within", &featurePairsSelf, "mesh"_a, "distance"_a, py::kw_only(),
             "ignored"_a = py::none(), docs::kFeaturePairsWithinSelf);
  bindVertexDistances(module);
}

}  // namespace adaptive_bvh::python
