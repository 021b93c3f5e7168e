#include "features.h"

#include "arrays.h"
#include "bind.h"
#include "results.h"

namespace adaptive_bvh::python {
namespace docs {
constexpr const char* kFeaturePairs =
    R"(Pairs of features: where two surfaces come together a vertex of one comes to a face of the other,
or two edges do. len() counts all.

An edge has the number 3 t + k: it goes from corner k of triangle t to corner (k + 1) % 3. Of the
numbers that an edge of several triangles has the smallest counts.)";

constexpr const char* kDetails =
    R"(Distance, nearest points, where these lie, and normal of each of some pairs of features.

pairs: FeaturePairs, as feature_pairs_within finds them or others.
tf1, tf2: poses that place the meshes in the world. Returns FeaturePairDetails.)";

constexpr const char* kDetailsSelf =
    "As feature_pair_details, of one mesh with itself, in its own frame.";

constexpr const char* kCoordinates =
    R"((K, 3) float64: where the nearest points lie. Of a vertex and a face: the weights of the face's
corners, whose sum is 1. Of two edges: how far along the first and the second, from 0 to 1, and 0.)";

constexpr const char* kNormals =
    R"((K, 3) float64, of length 1, from the first feature to the second, in the world. Of features that
touch by where their surfaces face; zero where that decides nothing.)";
}  // namespace docs

namespace {

std::vector<FeaturePair> pairsOrNone(const py::object& pairs, const char* name) {
  return pairs.is_none() ? std::vector<FeaturePair>() : pairsFrom(pairs, name);
}

/// Python sees int32.
std::int64_t seenByPython(unsigned number) { return static_cast<std::int32_t>(number); }

/// The features of the first mesh are less than `first`, those of the second less than `second`.
void requirePairs(const std::vector<FeaturePair>& pairs, std::size_t first, std::size_t second,
                  const char* name) {
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    requireIndex(seenByPython(pairs[i].first), first, name, i, "first features");
    requireIndex(seenByPython(pairs[i].second), second, name, i, "second features");
  }
}

}  // namespace

FeaturePairs checkedPairs(const FeaturePairs& pairs, const LockedMesh& first,
                          const LockedMesh& second) {
  const std::size_t faces1 = first.numFaces(), faces2 = second.numFaces();
  FeaturePairs copy = pairs;
  requirePairs(copy.vertex_face, first.numVertices(), faces2, "vertex_face");
  requirePairs(copy.face_vertex, faces1, second.numVertices(), "face_vertex");
  requirePairs(copy.edge_edge, 3 * faces1, 3 * faces2, "edge_edge");
  return copy;
}

namespace {

FeaturePairDetails detailsOf(const LockedMesh& first, const LockedMesh& second,
                             const FeaturePairs& pairs, const py::object& tf1,
                             const py::object& tf2) {
  const FeaturePairs all = checkedPairs(pairs, first, second);
  return findPlaced<FeaturePairDetails>(
      first, second, Poses(tf1, tf2),
      [&](auto& result, const auto&... placed) { featurePairDetails(placed..., all, result); });
}

FeaturePairDetails detailsSelf(const LockedMesh& mesh, const FeaturePairs& pairs) {
  const FeaturePairs all = checkedPairs(pairs, mesh, mesh);
  return find<FeaturePairDetails>(
      mesh, [&](auto& result, const Mesh& m) { selfFeaturePairDetails(m, all, result); });
}

}  // namespace

void bindFeatures(py::module_& module) {
  ResultClass<FeaturePairs> pairs(module, "FeaturePairs", docs::kFeaturePairs);
  (*pairs)
      .def(py::init([](const py::object& vertex_face, const py::object& face_vertex,
                       const py::object& edge_edge) {
             return FeaturePairs{pairsOrNone(vertex_face, "vertex_face"),
                                 pairsOrNone(face_vertex, "face_vertex"),
                                 pairsOrNone(edge_edge, "edge_edge")};
           }),
           "vertex_face"_a = py::none(), "face_vertex"_a = py::none(), "edge_edge"_a = py::none(),
           "Each an array (K, 2) of integers, or None.")
      .def("__len__", &FeaturePairs::size);
  pairs
      .attribute("vertex_face", &FeaturePairs::vertex_face,
                 "(K, 2) int32: a vertex of the first mesh and a triangle of the second.")
      .attribute("face_vertex", &FeaturePairs::face_vertex,
                 "(K, 2) int32: a triangle of the first mesh and a vertex of the second. Empty for "
                 "one mesh with itself.")
      .attribute("edge_edge", &FeaturePairs::edge_edge,
                 "(K, 2) int32: an edge of the first mesh and one of the second; of one mesh with "
                 "itself the smaller number first.");
}

void bindFeatureDetails(py::module_& module) {
  using D = FeatureDetails;
  ResultClass<D>(module, "FeatureDetails",
                 "Of pairs of one kind, in arrays side by side. len() counts them.")
      .attribute("distances", &D::distances, "(K,) float64, lengths.")
      .attribute("nearest_points", &D::nearest_points,
                 "(K, 2, 3) float64, in the world: of the first feature and of the second.")
      .attribute("coordinates", &D::coordinates, docs::kCoordinates)
      .attribute("normals", &D::normals, docs::kNormals)
      .length(&D::distances);
  using P = FeaturePairDetails;
  ResultClass<P>(module, "FeaturePairDetails", "Of FeaturePairs, kind by kind in their order.")
      .attribute("vertex_face", &P::vertex_face, "FeatureDetails.")
      .attribute("face_vertex", &P::face_vertex, "FeatureDetails.")
      .attribute("edge_edge", &P::edge_edge, "FeatureDetails.");
  module.def("feature_pair_details", &detailsOf, "first"_a, "second"_a, "pairs"_a, py::kw_only(),
             "tf1"_a = py::none(), "tf2"_a = py::none(), docs::kDetails);
  module.def("self_feature_pair_details", &detailsSelf, "mesh"_a, "pairs"_a, docs::kDetailsSelf);
}

}  // namespace adaptive_bvh::python
