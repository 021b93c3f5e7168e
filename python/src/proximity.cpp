#include <limits>

#include "adaptive_bvh/proximity.h"
#include "bind.h"
#include "features.h"
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
    R"(As above, of one mesh with itself, in its own frame: each pair once, the smaller index first.

filter: which neighbours are left out, as of self_collide, but not 'beyond shared'.
ignored, labels, label_rule: as of self_collide.)";

constexpr const char* kFeaturePairsWithin =
    R"(All pairs of a vertex and a face, and of two edges, at most `distance`, a length, apart.
ValueError when it is negative or NaN.

tf1, tf2: poses that place the meshes in the world.
ignored: pairs of features to leave out, FeaturePairs in any order, or None. Returns FeaturePairs.)";

constexpr const char* kFeaturePairsWithinSelf =
    R"(As above, of one mesh with itself, without features that have a vertex in common.

labels: (num_faces,) integers, a label for each triangle, or None. Then only pairs count whose labels
    differ (label_rule 'between') or are equal ('within'). A vertex and an edge have the label of
    their triangle with the smallest index.)";

constexpr const char* kClearance =
    R"(For every vertex of `mesh` its distance to the surface of `other`: (num_vertices,) float64.

Exact where it is less than `limit`, a length, and `limit` elsewhere. A small limit is fast.
ValueError when it is negative or NaN.
tf, other_tf: poses that place the meshes in the world.)";

constexpr const char* kSignedClearance =
    R"(As clearance, with a negative sign for a vertex inside of `other`, which must be closed.

-limit is deep inside. ValueError when an edge of `other` has no neighbour.)";
}  // namespace docs

namespace {

template <typename Other>
bool isNearerOf(const LockedMesh& first, const Other& second, double distance,
                const py::object& tf1, const py::object& tf2, bool solid) {
  return queryPlaced(first, second, Poses(tf1, tf2),
                     [&](const auto&... placed) { return isNearer(placed..., distance, solid); });
}

/// The library's request, and the lists that it refers to.
struct FeaturesRequest {
  FeaturesRequest(double distance, const FeaturePairs* ignored, bool is_self) {
    request.distance = distance;
    if (ignored) pairs = *ignored;
    sortIgnored(pairs.vertex_face);
    sortIgnored(pairs.face_vertex);
    sortIgnored(pairs.edge_edge, is_self);
    request.vertex_face.list = &pairs.vertex_face;
    request.face_vertex.list = &pairs.face_vertex;
    request.edge_edge.list = &pairs.edge_edge;
  }
  FeaturesRequest(const FeaturesRequest&) = delete;
  FeaturesRequest& operator=(const FeaturesRequest&) = delete;

  FeaturePairs pairs;
  FeatureProximityRequest<double> request;
};

TrianglePairs<double> pairsWithinOf(const LockedMesh& first, const LockedMesh& second,
                                    double distance, const py::object& tf1, const py::object& tf2,
                                    bool distances, bool points, const py::object& ignored) {
  const std::vector<FeaturePair> list = ignoredFrom(ignored, "ignored");
  const ProximityRequest<double> request{distance, distances, points, {&list, {}}};
  return findPlaced<TrianglePairs<double>>(
      first, second, Poses(tf1, tf2),
      [&](auto& result, const auto&... placed) { pairsWithin(placed..., request, result); });
}

TrianglePairs<double> pairsWithinSelf(const LockedMesh& mesh, double distance, bool distances,
                                      bool points, const std::string& filter,
                                      const py::object& ignored, const py::object& labels,
                                      const std::string& label_rule) {
  const NeighbourFilter neighbours = neighbourFilter(filter);
  const std::vector<FeaturePair> list = ignoredFrom(ignored, "ignored", true);
  const Labels of_faces(labels, label_rule, mesh);
  const ProximityRequest<double> request{distance, distances, points, of_faces.triangles(list)};
  return find<TrianglePairs<double>>(
      mesh, [&](auto& result, const Mesh& m) { pairsWithin(m, request, result, neighbours); });
}

FeaturePairs featurePairsOf(const LockedMesh& first, const LockedMesh& second, double distance,
                            const py::object& tf1, const py::object& tf2,
                            const FeaturePairs* ignored) {
  const FeaturesRequest asked(distance, ignored, false);
  return findPlaced<FeaturePairs>(first, second, Poses(tf1, tf2),
                                  [&](auto& pairs, const auto&... placed) {
                                    featurePairsWithin(placed..., asked.request, pairs);
                                  });
}

FeaturePairs featurePairsSelf(const LockedMesh& mesh, double distance, const FeaturePairs* ignored,
                              const py::object& labels, const std::string& label_rule) {
  FeaturesRequest asked(distance, ignored, true);
  const Labels of_faces(labels, label_rule, mesh);
  return find<FeaturePairs>(mesh, [&](auto& pairs, const Mesh& m) {
    const IgnoredFeatures ignored_features = of_faces.features(m.triangles());
    asked.request.vertex_face.test = ignored_features.vertex_face.test;
    asked.request.edge_edge.test = ignored_features.edge_edge.test;
    featurePairsWithin(m, asked.request, pairs);
  });
}

void bindClearance(py::module_& module) {
  const auto define = [&](const char* name, auto* query, const char* doc) {
    module.def(
        name,
        [query](const LockedMesh& mesh, const LockedMesh& other, double limit, const py::object& tf,
                const py::object& other_tf) {
          return adopt(findPlaced<std::vector<double>>(
              mesh, other, Poses(tf, other_tf, "tf", "other_tf"),
              [&](auto& result, const auto&... placed) { query(placed..., limit, result); }));
        },
        "mesh"_a, "other"_a, "limit"_a = std::numeric_limits<double>::infinity(),
        "tf"_a = py::none(), "other_tf"_a = py::none(), doc);
  };
  define("clearance", &clearance<double>, docs::kClearance);
  define("signed_clearance", &signedClearance<double>, docs::kSignedClearance);
}

void bindNearPairs(py::module_& module) {
  using P = TrianglePairs<double>;
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
    module.def("is_nearer", function, "first"_a, "second"_a, "distance"_a, "tf1"_a = py::none(),
               "tf2"_a = py::none(), py::kw_only(), "solid"_a = false, docs::kIsNearer);
  };
  define(&isNearerOf<LockedMesh>);
  define(&isNearerOf<Shape>);
  module.def("pairs_within", &pairsWithinOf, "first"_a, "second"_a, "distance"_a,
             "tf1"_a = py::none(), "tf2"_a = py::none(), py::kw_only(),
             "enable_distances"_a = false, "enable_nearest_points"_a = false,
             "ignored"_a = py::none(), docs::kPairsWithin);
  module.def("pairs_within", &pairsWithinSelf, "mesh"_a, "distance"_a, py::kw_only(),
             "enable_distances"_a = false, "enable_nearest_points"_a = false,
             "filter"_a = "shared vertex", "ignored"_a = py::none(), "labels"_a = py::none(),
             "label_rule"_a = "between", docs::kPairsWithinSelf);
  module.def("feature_pairs_within", &featurePairsOf, "first"_a, "second"_a, "distance"_a,
             "tf1"_a = py::none(), "tf2"_a = py::none(), py::kw_only(), "ignored"_a = py::none(),
             docs::kFeaturePairsWithin);
  module.def("feature_pairs_within", &featurePairsSelf, "mesh"_a, "distance"_a, py::kw_only(),
             "ignored"_a = py::none(), "labels"_a = py::none(), "label_rule"_a = "between",
             docs::kFeaturePairsWithinSelf);
  bindClearance(module);
}

}  // namespace adaptive_bvh::python
