#include "feature_details.h"

#include "adaptive_bvh/proximity.h"
#include "either.h"
#include "features.h"
#include "objects.h"
#include "text.h"

namespace adaptive_bvh::python {
namespace docs {
constexpr const char* kDetails =
    R"(Distance, nearest points, where these lie, and normal of each of some pairs of features.

pairs: FeaturePairs, as feature_pairs_within finds them or others.
tf1, tf2: poses that place the meshes in the world. Returns FeaturePairDetails.)";

constexpr const char* kDetailsSelf = "As above, of one mesh with itself, in its own frame.";

constexpr const char* kCoordinates =
    R"((K, 3) float64: where the nearest points lie. Of a vertex and a face: the weights of the face's
corners, whose sum is 1. Of two edges: how far along the first and the second, from 0 to 1, and 0.)";

constexpr const char* kNormals =
    R"((K, 3) float64, of length 1, from the first feature to the second, in the world. Of features that
touch by where their surfaces face; zero where that decides nothing.)";
}  // namespace docs

namespace {

/// Python's FeatureDetails.
struct DetailArrays : Bound {
  py::array_t<double> distances, nearest_points, coordinates, normals;
};
/// Python's FeaturePairDetails.
struct PairDetails : Bound {
  DetailArrays vertex_face, face_vertex, edge_edge;
};

template <typename S>
DetailArrays arraysOf(FeatureDetails<S>&& details) {
  const auto count = static_cast<py::ssize_t>(details.size());
  DetailArrays arrays;
  arrays.distances = adoptDoubles<S>(std::move(details.distances), {count});
  arrays.nearest_points = adoptDoubles<S>(std::move(details.nearest_points), {count, 2, 3});
  arrays.coordinates = adoptDoubles<S>(std::move(details.coordinates), {count, 3});
  arrays.normals = adoptDoubles<S>(std::move(details.normals), {count, 3});
  return arrays;
}
template <typename S>
PairDetails arraysOf(FeaturePairDetails<S>&& details) {
  PairDetails arrays;
  arrays.vertex_face = arraysOf(std::move(details.vertex_face));
  arrays.face_vertex = arraysOf(std::move(details.face_vertex));
  arrays.edge_edge = arraysOf(std::move(details.edge_edge));
  return arrays;
}

PairDetails arraysOf(Either<FeaturePairDetails>&& details, const LockedMesh& mesh) {
  return std::move(details).take(mesh.isDouble(), [](auto&& d) { return arraysOf(std::move(d)); });
}

PairDetails detailsOf(const LockedMesh& first, const LockedMesh& second, const FeatureArrays& pairs,
                      const py::object& tf1, const py::object& tf2) {
  const Poses poses(tf1, tf2, "tf1", "tf2");
  const FeaturePairs all = featurePairsFrom(pairs, first, second);
  Either<FeaturePairDetails> result;
  LockedMesh::queryPair(first, second, [&](const auto& a, const auto& b) {
    using S = ScalarOf<decltype(a)>;
    featurePairDetails(a, poseAs<S>(poses.tf1), b, poseAs<S>(poses.tf2), all, result.as<S>());
  });
  return arraysOf(std::move(result), first);
}

PairDetails detailsSelf(const LockedMesh& mesh, const FeatureArrays& pairs) {
  const FeaturePairs all = featurePairsFrom(pairs, mesh, mesh);
  Either<FeaturePairDetails> result;
  mesh.query(
      [&](const auto& m) { featurePairDetails(m, all, result.as<ScalarOf<decltype(m)>>()); });
  return arraysOf(std::move(result), mesh);
}

}  // namespace

void bindFeatureDetails(py::module_& module) {
  py::class_<DetailArrays>(module, "FeatureDetails",
                           "Of pairs of one kind, in arrays side by side. len() counts them.")
      .def_readonly("distances", &DetailArrays::distances, "(K,) float64, lengths.")
      .def_readonly("nearest_points", &DetailArrays::nearest_points,
                    "(K, 2, 3) float64, in the world: of the first feature and of the second.")
      .def_readonly("coordinates", &DetailArrays::coordinates, docs::kCoordinates)
      .def_readonly("normals", &DetailArrays::normals, docs::kNormals)
      .def("__len__", [](const DetailArrays& self) { return self.distances.shape(0); })
      .def("__repr__", TextOf({"distances", "nearest_points", "coordinates", "normals"}));
  py::class_<PairDetails> pair_details(module, "FeaturePairDetails",
                                       "Of FeaturePairs, kind by kind in their order.");
  const auto define = [&](const char* name, DetailArrays PairDetails::*kind) {
    // A copy, which shares the arrays: objects of Python own what they hold (bound.h).
    pair_details.def_property_readonly(
        name, [kind](const PairDetails& self) -> DetailArrays { return self.*kind; },
        "FeatureDetails.");
  };
  define("vertex_face", &PairDetails::vertex_face);
  define("face_vertex", &PairDetails::face_vertex);
  define("edge_edge", &PairDetails::edge_edge);
  pair_details.def("__repr__", TextOf({"vertex_face", "face_vertex", "edge_edge"}));
  module.def("feature_pair_details", &detailsOf, py::arg("first"), py::arg("second"),
             py::arg("pairs"), py::arg("tf1") = py::none(), py::arg("tf2") = py::none(),
             docs::kDetails);
  module.def("feature_pair_details", &detailsSelf, py::arg("mesh"), py::arg("pairs"),
             docs::kDetailsSelf);
}

}  // namespace adaptive_bvh::python
