#include "adaptive_bvh/proximity.h"
#include "bind.h"
#include "features.h"
#include "pose.h"
#include "results.h"

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

FeaturePairDetails<double> detailsOf(const LockedMesh& first, const LockedMesh& second,
                                     const FeaturePairs& pairs, const py::object& tf1,
                                     const py::object& tf2) {
  const Poses poses(tf1, tf2, "tf1", "tf2");
  const FeaturePairs all = checkedPairs(pairs, first, second);
  FeaturePairDetails<double> result;
  queryPair(first, second, [&](const Mesh& a, const Mesh& b) {
    featurePairDetails(a, poses.tf1, b, poses.tf2, all, result);
  });
  return result;
}

FeaturePairDetails<double> detailsSelf(const LockedMesh& mesh, const FeaturePairs& pairs) {
  const FeaturePairs all = checkedPairs(pairs, mesh, mesh);
  FeaturePairDetails<double> result;
  mesh.query([&](const Mesh& m) { featurePairDetails(m, all, result); });
  return result;
}

}  // namespace

void bindFeatureDetails(py::module_& module) {
  using D = FeatureDetails<double>;
  ResultClass<D>(module, "FeatureDetails",
                 "Of pairs of one kind, in arrays side by side. len() counts them.")
      .attribute("distances", &D::distances, "(K,) float64, lengths.")
      .attribute("nearest_points", &D::nearest_points,
                 "(K, 2, 3) float64, in the world: of the first feature and of the second.")
      .attribute("coordinates", &D::coordinates, docs::kCoordinates)
      .attribute("normals", &D::normals, docs::kNormals)
      .length(&D::distances);
  using P = FeaturePairDetails<double>;
  ResultClass<P>(module, "FeaturePairDetails", "Of FeaturePairs, kind by kind in their order.")
      .attribute("vertex_face", &P::vertex_face, "FeatureDetails.")
      .attribute("face_vertex", &P::face_vertex, "FeatureDetails.")
      .attribute("edge_edge", &P::edge_edge, "FeatureDetails.");
  module.def("feature_pair_details", &detailsOf, py::arg("first"), py::arg("second"),
             py::arg("pairs"), py::arg("tf1") = py::none(), py::arg("tf2") = py::none(),
             docs::kDetails);
  module.def("feature_pair_details", &detailsSelf, py::arg("mesh"), py::arg("pairs"),
             docs::kDetailsSelf);
}

}  // namespace adaptive_bvh::python
