#include "proximity.h"

#include <limits>

#include "either.h"
#include "features.h"
#include "objects.h"
#include "query.h"
#include "shapes.h"
#include "text.h"

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

bool isNearerOf(const LockedMesh& first, const LockedMesh& second, double distance,
                const py::object& tf1, const py::object& tf2, bool solid) {
  const Poses poses(tf1, tf2, "tf1", "tf2");
  return LockedMesh::queryPair(first, second, [&](const auto& a, const auto& b) {
    using S = ScalarOf<decltype(a)>;
    return isNearer(a, poseAs<S>(poses.tf1), b, poseAs<S>(poses.tf2), static_cast<S>(distance),
                    solid);
  });
}

bool isNearerToShape(const LockedMesh& first, const Shape& second, double distance,
                     const py::object& tf1, const py::object& tf2, bool solid) {
  const Poses poses(tf1, tf2, "tf1", "tf2");
  return first.query([&](const auto& mesh) {
    using S = ScalarOf<decltype(mesh)>;
    return isNearer(mesh, poseAs<S>(poses.tf1), *second.geometry<S>(), poseAs<S>(poses.tf2),
                    static_cast<S>(distance), solid);
  });
}

}  // namespace

template <typename S>
NearPairs nearPairs(TrianglePairs<S>&& pairs) {
  const auto count = [](const auto& list) { return static_cast<py::ssize_t>(list.size()); };
  NearPairs arrays;
  const py::ssize_t triangles = count(pairs.triangles), distances = count(pairs.distances),
                    points = count(pairs.nearest_points);
  arrays.triangles = adopt<std::int32_t>(std::move(pairs.triangles), {triangles, 2});
  arrays.distances = adoptDoubles<S>(std::move(pairs.distances), {distances});
  arrays.nearest_points = adoptDoubles<S>(std::move(pairs.nearest_points), {points, 2, 3});
  return arrays;
}

template NearPairs nearPairs(TrianglePairs<double>&&);
template NearPairs nearPairs(TrianglePairs<float>&&);

namespace {

NearPairs arraysOf(Either<TrianglePairs>&& pairs, const LockedMesh& mesh) {
  return std::move(pairs).take(mesh.isDouble(), [](auto&& p) { return nearPairs(std::move(p)); });
}

/// What Python asks for, of meshes of either precision.
struct PairsRequest {
  double distance;
  bool enable_distances, enable_nearest_points;
  IgnoredPairs ignored;

  template <typename S>
  ProximityRequest<S> as() const {
    return {static_cast<S>(distance), enable_distances, enable_nearest_points, ignored};
  }
};

/// As above, of features.
struct FeaturesRequest {
  FeaturesRequest(double d, const FeatureArrays* ignored, bool is_self) : distance(d) {
    if (!ignored) return;
    vertex_face = ignoredFrom(ignored->vertex_face, "vertex_face");
    face_vertex = ignoredFrom(ignored->face_vertex, "face_vertex");
    edge_edge = ignoredFrom(ignored->edge_edge, "edge_edge", is_self);
  }

  double distance;
  std::vector<FeaturePair> vertex_face, face_vertex, edge_edge;

  template <typename S>
  FeatureProximityRequest<S> as() const {
    return {static_cast<S>(distance), {&vertex_face, {}}, {&face_vertex, {}}, {&edge_edge, {}}};
  }
};

NearPairs pairsWithinOf(const LockedMesh& first, const LockedMesh& second, double distance,
                        const py::object& tf1, const py::object& tf2, bool distances, bool points,
                        const py::object& ignored) {
  const Poses poses(tf1, tf2, "tf1", "tf2");
  const std::vector<FeaturePair> list = ignoredFrom(ignored, "ignored");
  const PairsRequest request{distance, distances, points, {&list, {}}};
  Either<TrianglePairs> result;
  LockedMesh::queryPair(first, second, [&](const auto& a, const auto& b) {
    using S = ScalarOf<decltype(a)>;
    pairsWithin(a, poseAs<S>(poses.tf1), b, poseAs<S>(poses.tf2), request.as<S>(), result.as<S>());
  });
  return arraysOf(std::move(result), first);
}

NearPairs pairsWithinSelf(const LockedMesh& mesh, double distance, bool distances, bool points,
                          const std::string& filter, const py::object& ignored,
                          const py::object& labels, const std::string& label_rule) {
  const NeighbourFilter neighbours = neighbourFilter(filter);
  const std::vector<FeaturePair> list = ignoredFrom(ignored, "ignored", true);
  const Labels of_faces(labels, label_rule, mesh);
  const PairsRequest request{distance, distances, points, of_faces.triangles(list)};
  Either<TrianglePairs> result;
  mesh.query([&](const auto& m) {
    using S = ScalarOf<decltype(m)>;
    pairsWithin(m, request.as<S>(), result.as<S>(), neighbours);
  });
  return arraysOf(std::move(result), mesh);
}

FeatureArrays featurePairsOf(const LockedMesh& first, const LockedMesh& second, double distance,
                             const py::object& tf1, const py::object& tf2,
                             const FeatureArrays* ignored) {
  const Poses poses(tf1, tf2, "tf1", "tf2");
  const FeaturesRequest request(distance, ignored, false);
  FeaturePairs pairs;
  LockedMesh::queryPair(first, second, [&](const auto& a, const auto& b) {
    using S = ScalarOf<decltype(a)>;
    featurePairsWithin(a, poseAs<S>(poses.tf1), b, poseAs<S>(poses.tf2), request.as<S>(), pairs);
  });
  return FeatureArrays(std::move(pairs));
}

FeatureArrays featurePairsSelf(const LockedMesh& mesh, double distance,
                               const FeatureArrays* ignored, const py::object& labels,
                               const std::string& label_rule) {
  const FeaturesRequest request(distance, ignored, true);
  const Labels of_faces(labels, label_rule, mesh);
  FeaturePairs pairs;
  mesh.query([&](const auto& m) {
    auto asked = request.as<ScalarOf<decltype(m)>>();
    const IgnoredFeatures ignored_features = of_faces.features(m.triangles());
    asked.vertex_face.test = ignored_features.vertex_face.test;
    asked.edge_edge.test = ignored_features.edge_edge.test;
    featurePairsWithin(m, asked, pairs);
  });
  return FeatureArrays(std::move(pairs));
}

template <typename S>
using Numbers = std::vector<S>;

py::array_t<double> clearanceOf(const LockedMesh& mesh, const LockedMesh& other, double limit,
                                const py::object& tf, const py::object& other_tf, bool is_signed) {
  const Poses poses(tf, other_tf, "tf", "other_tf");
  Either<Numbers> result;
  LockedMesh::queryPair(mesh, other, [&](const auto& a, const auto& b) {
    using S = ScalarOf<decltype(a)>;
    const auto tf1 = poseAs<S>(poses.tf1), tf2 = poseAs<S>(poses.tf2);
    if (is_signed)
      signedClearance(a, tf1, b, tf2, static_cast<S>(limit), result.as<S>());
    else
      clearance(a, tf1, b, tf2, static_cast<S>(limit), result.as<S>());
  });
  return std::move(result).take(mesh.isDouble(), [](auto&& numbers) {
    using S = typename std::decay_t<decltype(numbers)>::value_type;
    const auto count = static_cast<py::ssize_t>(numbers.size());
    return adoptDoubles<S>(std::move(numbers), {count});
  });
}

void bindClearance(py::module_& module) {
  const double infinity = std::numeric_limits<double>::infinity();
  const auto define = [&](const char* name, bool is_signed, const char* doc) {
    module.def(
        name,
        [is_signed](const LockedMesh& mesh, const LockedMesh& other, double limit,
                    const py::object& tf, const py::object& other_tf) {
          return clearanceOf(mesh, other, limit, tf, other_tf, is_signed);
        },
        py::arg("mesh"), py::arg("other"), py::arg("limit") = infinity, py::arg("tf") = py::none(),
        py::arg("other_tf") = py::none(), doc);
  };
  define("clearance", false, docs::kClearance);
  define("signed_clearance", true, docs::kSignedClearance);
}

void bindNearPairs(py::module_& module) {
  py::class_<NearPairs>(module, "TrianglePairs",
                        "Pairs of triangles in arrays side by side. len() counts them.")
      .def_readonly("triangles", &NearPairs::triangles, "(K, 2) int32.")
      .def_readonly("distances", &NearPairs::distances,
                    "(K,) float64, lengths, 0 where they touch; (0,) unless they were enabled.")
      .def_readonly("nearest_points", &NearPairs::nearest_points,
                    "(K, 2, 3) float64, in the world: of the first triangle and of the second; "
                    "(0, 2, 3) unless they were enabled.")
      .def("__len__", [](const NearPairs& self) { return self.triangles.shape(0); })
      .def("__repr__", TextOf({"triangles", "distances", "nearest_points"}));
}

}  // namespace

void bindProximity(py::module_& module) {
  bindNearPairs(module);
  const auto define = [&](auto function) {
    module.def("is_nearer", function, py::arg("first"), py::arg("second"), py::arg("distance"),
               py::arg("tf1") = py::none(), py::arg("tf2") = py::none(), py::kw_only(),
               py::arg("solid") = false, docs::kIsNearer);
  };
  define(&isNearerOf);
  define(&isNearerToShape);
  module.def("pairs_within", &pairsWithinOf, py::arg("first"), py::arg("second"),
             py::arg("distance"), py::arg("tf1") = py::none(), py::arg("tf2") = py::none(),
             py::kw_only(), py::arg("enable_distances") = false,
             py::arg("enable_nearest_points") = false, py::arg("ignored") = py::none(),
             docs::kPairsWithin);
  module.def("pairs_within", &pairsWithinSelf, py::arg("mesh"), py::arg("distance"), py::kw_only(),
             py::arg("enable_distances") = false, py::arg("enable_nearest_points") = false,
             py::arg("filter") = "shared vertex", py::arg("ignored") = py::none(),
             py::arg("labels") = py::none(), py::arg("label_rule") = "between",
             docs::kPairsWithinSelf);
  module.def("feature_pairs_within", &featurePairsOf, py::arg("first"), py::arg("second"),
             py::arg("distance"), py::arg("tf1") = py::none(), py::arg("tf2") = py::none(),
             py::kw_only(), py::arg("ignored") = py::none(), docs::kFeaturePairsWithin);
  module.def("feature_pairs_within", &featurePairsSelf, py::arg("mesh"), py::arg("distance"),
             py::kw_only(), py::arg("ignored") = py::none(), py::arg("labels") = py::none(),
             py::arg("label_rule") = "between", docs::kFeaturePairsWithinSelf);
  bindClearance(module);
}

}  // namespace adaptive_bvh::python
