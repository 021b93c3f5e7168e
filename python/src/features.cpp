#include "features.h"

#include <algorithm>

#include "text.h"

namespace adaptive_bvh::python {
namespace {

constexpr const char* kFeaturePairs =
    R"(Pairs of features: where two surfaces come together a vertex of one comes to a face of the other,
or two edges do. len() counts all.

An edge has the number 3 t + k: it goes from corner k of triangle t to corner (k + 1) % 3. Of the
numbers that an edge of several triangles has the smallest counts.)";

py::array_t<std::int32_t> arrayOf(std::vector<FeaturePair>&& pairs) {
  const auto count = static_cast<py::ssize_t>(pairs.size());
  return adopt<std::int32_t>(std::move(pairs), {count, 2});
}

constexpr std::size_t kAny = std::size_t(1) << 31;  // meshes are checked where they are known

py::array_t<std::int32_t> checked(const py::object& pairs, const char* name) {
  if (pairs.is_none()) return arrayOf({});
  return arrayOf(pairsFrom<FeaturePair>(pairs, kAny, kAny, name));
}

}  // namespace

FeatureArrays::FeatureArrays(FeaturePairs&& pairs)
    : vertex_face(arrayOf(std::move(pairs.vertex_face))),
      face_vertex(arrayOf(std::move(pairs.face_vertex))),
      edge_edge(arrayOf(std::move(pairs.edge_edge))) {}

FeaturePairs featurePairsFrom(const FeatureArrays& arrays, const LockedMesh& first,
                              const LockedMesh& second) {
  const auto pairs = [](const py::object& list, std::size_t count1, std::size_t count2,
                        const char* name) {
    return pairsFrom<FeaturePair>(list, count1, count2, name);
  };
  const std::size_t faces1 = first.numFaces(), faces2 = second.numFaces();
  FeaturePairs result;
  result.vertex_face = pairs(arrays.vertex_face, first.numVertices(), faces2, "vertex_face");
  result.face_vertex = pairs(arrays.face_vertex, faces1, second.numVertices(), "face_vertex");
  result.edge_edge = pairs(arrays.edge_edge, 3 * faces1, 3 * faces2, "edge_edge");
  return result;
}

std::vector<FeaturePair> ignoredFrom(const py::object& pairs, const char* name, bool is_self) {
  if (pairs.is_none()) return {};
  auto list = pairsFrom<FeaturePair>(pairs, kAny, kAny, name);
  for (FeaturePair& pair : list)
    if (is_self && pair.first > pair.second) std::swap(pair.first, pair.second);
  std::sort(list.begin(), list.end());
  return list;
}

namespace {

LabelRule labelRule(const std::string& name) {
  if (name == "within") return LabelRule::Within;
  if (name == "between") return LabelRule::Between;
  throw py::value_error("label_rule is '" + name + "'; 'within' or 'between' is needed");
}

}  // namespace

Labels::Labels(const py::object& labels, const std::string& rule, const LockedMesh& mesh)
    : has_labels_(!labels.is_none()), rule_(labelRule(rule)) {
  if (!has_labels_) return;
  labels_ = indicesFrom(labels, std::size_t(1) << 32, "labels", "labels from 0 on");
  if (labels_.size() != mesh.numFaces())
    throw py::value_error("labels has " + std::to_string(labels_.size()) +
                          " numbers; one for each of " + std::to_string(mesh.numFaces()) +
                          " faces is needed");
}

IgnoredPairs Labels::triangles(const std::vector<FeaturePair>& list) const {
  IgnoredPairs ignored = has_labels_ ? ignoredByLabels(labels_, rule_) : IgnoredPairs();
  ignored.list = &list;
  return ignored;
}

IgnoredFeatures Labels::features(const std::vector<fcl::Triangle>& triangles) const {
  return has_labels_ ? ignoredFeaturesByLabels(triangles, labels_, rule_) : IgnoredFeatures();
}

void bindFeatures(py::module_& module) {
  py::class_<FeatureArrays>(module, "FeaturePairs", kFeaturePairs)
      .def(py::init([](const py::object& vertex_face, const py::object& face_vertex,
                       const py::object& edge_edge) {
             FeatureArrays arrays;
             arrays.vertex_face = checked(vertex_face, "vertex_face");
             arrays.face_vertex = checked(face_vertex, "face_vertex");
             arrays.edge_edge = checked(edge_edge, "edge_edge");
             return arrays;
           }),
           py::arg("vertex_face") = py::none(), py::arg("face_vertex") = py::none(),
           py::arg("edge_edge") = py::none(), "Each an array (K, 2) of integers, or None.")
      .def_readonly("vertex_face", &FeatureArrays::vertex_face,
                    "(K, 2) int32: a vertex of the first mesh and a triangle of the second.")
      .def_readonly("face_vertex", &FeatureArrays::face_vertex,
                    "(K, 2) int32: a triangle of the first mesh and a vertex of the second. Empty "
                    "for one mesh with itself.")
      .def_readonly("edge_edge", &FeatureArrays::edge_edge,
                    "(K, 2) int32: an edge of the first mesh and one of the second; of one mesh "
                    "with itself the smaller number first.")
      .def("__len__", &FeatureArrays::size)
      .def("__repr__", TextOf({"vertex_face", "face_vertex", "edge_edge"}));
}

}  // namespace adaptive_bvh::python
