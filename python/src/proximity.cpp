#include "proximity.h"

#include <limits>

#include "adaptive_bvh/proximity.h"
#include "features.h"
#include "objects.h"
#include "query.h"

namespace adaptive_bvh::python {
namespace docs {
constexpr const char* kIsNearer =
    R"(Whether two meshes are at most `distance`, a length, apart. Much cheaper than their distance.

tf1, tf2: poses that place them in the world.)";

constexpr const char* kPairsWithin =
    R"(All pairs of a triangle of the first mesh and one of the second at most `distance` apart.

tf1, tf2: poses that place them in the world.
enable_distances, enable_nearest_points: also compute these.
ignored: pairs of triangles to leave out, (M, 2) integers in any order, or None.
Returns TrianglePairs. Pairs keep their order from step to step.)";

constexpr const char* kPairsWithinSelf =
    R"(As above, of one mesh with itself, in its own frame: each pair once, the smaller index first.

filter: which neighbours are left out, as of self_collide.)";

constexpr const char* kFeaturePairsWithin =
    R"(All pairs of a vertex and a face, and of two edges, at most `distance`, a length, apart.

tf1, tf2: poses that place the meshes in the world.
ignored: pairs of features to leave out, FeaturePairs in any order, or None. Returns FeaturePairs.)";

constexpr const char* kFeaturePairsWithinSelf =
    "As above, of one mesh with itself, without features that have a vertex in common.";

constexpr const char* kClearance =
    R"(For every vertex of `mesh` its distance to the surface of `other`: (num_vertices,) float64.

Exact where it is less than `limit`, a length, and `limit` elsewhere. A small limit is fast.
tf, other_tf: poses that place the meshes in the world.)";

constexpr const char* kSignedClearance =
    R"(As clearance, with a negative sign for a vertex inside of `other`, which must be closed.

-limit is deep inside. ValueError when an edge of `other` has no neighbour.)";
}  // namespace docs

namespace {

bool isNearerOf(const LockedMesh& first, const LockedMesh& second, double distance,
                const py::object& tf1, const py::object& tf2) {
  const Poses poses(tf1, tf2, "tf1", "tf2");
  return LockedMesh::queryPair(first, second, [&](const auto& a, const auto& b) {
    using S = ScalarOf<decltype(a)>;
    return isNearer(a, poseAs<S>(poses.tf1), b, poseAs<S>(poses.tf2), static_cast<S>(distance));
  });
}

/// Python's TrianglePairs.
struct NearPairs : Bound {
  py::array_t<std::int32_t> triangles;
  py::array_t<double> distances, nearest_points;
};

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

/// What Python asks for, of meshes of either precision.
struct PairsRequest {
  double distance;
  bool enable_distances, enable_nearest_points;
  std::vector<FeaturePair> ignored;

  template <typename S>
  ProximityRequest<S> as() const {
    return {static_cast<S>(distance), enable_distances, enable_nearest_points, {&ignored, {}}};
  }
};

/// As above, of features.
struct FeaturesRequest {
  FeaturesRequest(double d, const FeatureArrays* ignored) : distance(d) {
    if (!ignored) return;
    vertex_face = ignoredFrom(ignored->vertex_face, "vertex_face");
    face_vertex = ignoredFrom(ignored->face_vertex, "face_vertex");
    edge_edge = ignoredFrom(ignored->edge_edge, "edge_edge");
  }

  double distance;
  std::vector<FeaturePair> vertex_face, face_vertex, edge_edge;

  template <typename S>
  FeatureProximityRequest<S> as() const {
    return {static_cast<S>(distance), {&vertex_face, {}}, {&face_vertex, {}}, {&edge_edge, {}}};
  }
};

/// The result for meshes of either precision: one stays empty.
struct EitherPairs {
  TrianglePairs<double> of_double;
  TrianglePairs<float> of_float;

  template <typename S>
  TrianglePairs<S>& as() {
    if constexpr (sizeof(S) == sizeof(double))
      return of_double;
    else
      return of_float;
  }
  NearPairs arrays(bool is_double) && {
    return is_double ? nearPairs(std::move(of_double)) : nearPairs(std::move(of_float));
  }
};

NearPairs pairsWithinOf(const LockedMesh& first, const LockedMesh& second, double distance,
                        const py::object& tf1, const py::object& tf2, bool distances, bool points,
                        const py::object& ignored) {
  const Poses poses(tf1, tf2, "tf1", "tf2");
  const PairsRequest request{distance, distances, points, ignoredFrom(ignored, "ignored")};
  EitherPairs result;
  LockedMesh::queryPair(first, second, [&](const auto& a, const auto& b) {
    using S = ScalarOf<decltype(a)>;
    pairsWithin(a, poseAs<S>(poses.tf1), b, poseAs<S>(poses.tf2), request.as<S>(), result.as<S>());
  });
  return std::move(result).arrays(first.isDouble());
}

NearPairs pairsWithinSelf(const LockedMesh& mesh, double distance, bool distances, bool points,
                          const std::string& filter, const py::object& ignored) {
  const NeighbourFilter neighbours = neighbourFilter(filter);
  const PairsRequest request{distance, distances, points, ignoredFrom(ignored, "ignored")};
  EitherPairs result;
  mesh.query([&](const auto& m) {
    using S = ScalarOf<decltype(m)>;
    pairsWithin(m, request.as<S>(), result.as<S>(), neighbours);
  });
  return std::move(result).arrays(mesh.isDouble());
}

FeatureArrays featurePairsOf(const LockedMesh& first, const LockedMesh& second, double distance,
                             const py::object& tf1, const py::object& tf2,
                             const FeatureArrays* ignored) {
  const Poses poses(tf1, tf2, "tf1", "tf2");
  const FeaturesRequest request(distance, ignored);
  FeaturePairs pairs;
  LockedMesh::queryPair(first, second, [&](const auto& a, const auto& b) {
    using S = ScalarOf<decltype(a)>;
    featurePairsWithin(a, poseAs<S>(poses.tf1), b, poseAs<S>(poses.tf2), request.as<S>(), pairs);
  });
  return FeatureArrays(std::move(pairs));
}

FeatureArrays featurePairsSelf(const LockedMesh& mesh, double distance,
                               const FeatureArrays* ignored) {
  const FeaturesRequest request(distance, ignored);
  FeaturePairs pairs;
  mesh.query(
      [&](const auto& m) { featurePairsWithin(m, request.as<ScalarOf<decltype(m)>>(), pairs); });
  return FeatureArrays(std::move(pairs));
}

py::array_t<double> clearanceOf(const LockedMesh& mesh, const LockedMesh& other, double limit,
                                const py::object& tf, const py::object& other_tf, bool is_signed) {
  const Poses poses(tf, other_tf, "tf", "other_tf");
  std::vector<double> of_double;
  std::vector<float> of_float;
  LockedMesh::queryPair(mesh, other, [&](const auto& a, const auto& b) {
    using S = ScalarOf<decltype(a)>;
    const auto tf1 = poseAs<S>(poses.tf1), tf2 = poseAs<S>(poses.tf2);
    const auto run = [&](std::vector<S>& result) {
      if (is_signed)
        signedClearance(a, tf1, b, tf2, static_cast<S>(limit), result);
      else
        clearance(a, tf1, b, tf2, static_cast<S>(limit), result);
    };
    if constexpr (sizeof(S) == sizeof(double))
      run(of_double);
    else
      run(of_float);
  });
  const auto count = static_cast<py::ssize_t>(mesh.numVertices());
  return mesh.isDouble() ? adoptDoubles<double>(std::move(of_double), {count})
                         : adoptDoubles<float>(std::move(of_float), {count});
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
      .def("__len__", [](const NearPairs& self) { return self.triangles.shape(0); });
}

}  // namespace

void bindProximity(py::module_& module) {
  bindNearPairs(module);
  module.def("is_nearer", &isNearerOf, py::arg("first"), py::arg("second"), py::arg("distance"),
             py::arg("tf1") = py::none(), py::arg("tf2") = py::none(), docs::kIsNearer);
  module.def("pairs_within", &pairsWithinOf, py::arg("first"), py::arg("second"),
             py::arg("distance"), py::arg("tf1") = py::none(), py::arg("tf2") = py::none(),
             py::kw_only(), py::arg("enable_distances") = false,
             py::arg("enable_nearest_points") = false, py::arg("ignored") = py::none(),
             docs::kPairsWithin);
  module.def("pairs_within", &pairsWithinSelf, py::arg("mesh"), py::arg("distance"), py::kw_only(),
             py::arg("enable_distances") = false, py::arg("enable_nearest_points") = false,
             py::arg("filter") = "shared vertex", py::arg("ignored") = py::none(),
             docs::kPairsWithinSelf);
  module.def("feature_pairs_within", &featurePairsOf, py::arg("first"), py::arg("second"),
             py::arg("distance"), py::arg("tf1") = py::none(), py::arg("tf2") = py::none(),
             py::kw_only(), py::arg("ignored") = py::none(), docs::kFeaturePairsWithin);
  module.def("feature_pairs_within", &featurePairsSelf, py::arg("mesh"), py::arg("distance"),
             py::kw_only(), py::arg("ignored") = py::none(), docs::kFeaturePairsWithinSelf);
  bindClearance(module);
}

}  // namespace adaptive_bvh::python
