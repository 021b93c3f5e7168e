#include "adaptive_bvh/distance_derivatives.h"

#include "bind.h"
#include "features.h"
#include "objects.h"
#include "query.h"
#include "results.h"

namespace adaptive_bvh::python {
namespace docs {
constexpr const char* kOfPairs =
    R"(Derivatives of the distances of pairs of features by the vertices of both meshes.

details: what feature_pair_details returns for these meshes, pairs and poses.
Returns FeaturePairDerivatives. A solver adds up, for each of their parts:
    np.add.at(forces, part.first.vertices, -slopes[:, None, None] * part.first.gradients)
Where several pairs of points are nearest, the gradients are those of the pair that `details` names.
Where the features touch, they are those of the gap along details.normals.)";

constexpr const char* kOfPairsSelf =
    R"(As distance_derivatives of pairs, of one mesh with itself: `first` and `second` are both by
vertices of this mesh. details: what self_feature_pair_details returns.)";

constexpr const char* kOfContacts =
    R"(Derivatives of the signed distances of vertex_contacts by the vertices of both meshes.

second: a DeformableMesh, or a shape: then `second` of the result is empty.
contacts: what vertex_contacts returns for these bodies and poses. Returns DistanceDerivatives.)";

constexpr const char* kOfMeshes =
    R"(Derivatives of the distance of two meshes, by the corners of their nearest triangles.

nearest: what distance or CoherentDistance returns for these meshes and poses; only its triangles
    are read. Returns DistanceDerivatives with one row; zero where the meshes touch.)";
}  // namespace docs

namespace {

using Gradients = VertexGradients;
using Derivatives = DistanceDerivatives;

/// An array with a row for each distance that shares the memory of `entries`, which are in `owner`.
template <typename T>
py::array_t<typename Row<T>::Number> rowsOf(const Gradients& owner, const std::vector<T>& entries) {
  using Number = typename Row<T>::Number;
  std::vector<py::ssize_t> shape = Row<T>::shape();
  shape.insert(shape.begin(), static_cast<py::ssize_t>(owner.per_distance));
  shape.insert(shape.begin(), static_cast<py::ssize_t>(owner.rows()));
  return py::array_t<Number>(std::move(shape), reinterpret_cast<const Number*>(entries.data()),
                             py::cast(owner));
}

FeaturePairDerivatives ofPairs(const LockedMesh& first, const LockedMesh& second,
                               const FeaturePairs& pairs, const FeaturePairDetails& details,
                               const py::object& tf1, const py::object& tf2) {
  const FeaturePairs all = checkedPairs(pairs, first, second);
  return findPlaced<FeaturePairDerivatives>(first, second, Poses(tf1, tf2),
                                            [&](auto& result, const auto&... placed) {
                                              distanceDerivatives(placed..., all, details, result);
                                            });
}

FeaturePairDerivatives ofPairsSelf(const LockedMesh& mesh, const FeaturePairs& pairs,
                                   const FeaturePairDetails& details) {
  const FeaturePairs all = checkedPairs(pairs, mesh, mesh);
  return find<FeaturePairDerivatives>(
      mesh, [&](auto& result, const Mesh& m) { selfDistanceDerivatives(m, all, details, result); });
}

template <typename Other>
Derivatives ofContacts(const LockedMesh& first, const Other& second, const VertexContacts& contacts,
                       const py::object& tf1, const py::object& tf2) {
  return findPlaced<Derivatives>(first, second, Poses(tf1, tf2),
                                 [&](auto& result, const auto&... placed) {
                                   distanceDerivatives(placed..., contacts, result);
                                 });
}

Derivatives ofMeshes(const LockedMesh& first, const LockedMesh& second, const Nearest& nearest,
                     const py::object& tf1, const py::object& tf2) {
  fcl::DistanceResultd triangles;
  triangles.b1 = nearest.triangles[0];
  triangles.b2 = nearest.triangles[1];
  return findPlaced<Derivatives>(first, second, Poses(tf1, tf2),
                                 [&](auto& result, const auto&... placed) {
                                   distanceDerivatives(placed..., triangles, result);
                                 });
}

void bindDerivativeResults(py::module_& module) {
  ResultClass<Gradients> gradients(
      module, "VertexGradients",
      "Gradients of distances by the vertices of one mesh: a row for each distance, with k "
      "columns: "
      "1 of a vertex, 2 of an edge, 3 of a face, 0 of a shape. len() counts rows.");
  gradients
      .attribute(
          "vertices", [](const Gradients& self) { return rowsOf(self, self.vertices); },
          "(K, k) int32: indices in the mesh.")
      .attribute(
          "gradients", [](const Gradients& self) { return rowsOf(self, self.gradients); },
          "(K, k, 3) float64: derivatives by these vertices, in the mesh's frame.");
  (*gradients).def("__len__", &Gradients::rows);
  ResultClass<Derivatives>(module, "DistanceDerivatives", "Derivatives of distances of one kind.")
      .attribute("first", &Derivatives::first, "VertexGradients, by vertices of the first mesh.")
      .attribute("second", &Derivatives::second, "VertexGradients, of the second.");
  using P = FeaturePairDerivatives;
  ResultClass<P>(module, "FeaturePairDerivatives",
                 "Of the distances of FeaturePairs, kind by kind in their order.")
      .attribute("vertex_face", &P::vertex_face, "DistanceDerivatives.")
      .attribute("face_vertex", &P::face_vertex, "DistanceDerivatives.")
      .attribute("edge_edge", &P::edge_edge, "DistanceDerivatives.");
}

}  // namespace

void bindDerivatives(py::module_& module) {
  bindDerivativeResults(module);
  const auto define = [&](auto function, const char* doc, const auto&... names) {
    module.def("distance_derivatives", function, "first"_a, "second"_a, names..., py::kw_only(),
               "tf1"_a = py::none(), "tf2"_a = py::none(), doc);
  };
  define(&ofPairs, docs::kOfPairs, "pairs"_a, "details"_a);
  define(&ofContacts<LockedMesh>, docs::kOfContacts, "contacts"_a);
  define(&ofContacts<Shape>, docs::kOfContacts, "contacts"_a);
  define(&ofMeshes, docs::kOfMeshes, "nearest"_a);
  module.def("self_distance_derivatives", &ofPairsSelf, "mesh"_a, "pairs"_a, "details"_a,
             docs::kOfPairsSelf);
}

}  // namespace adaptive_bvh::python
