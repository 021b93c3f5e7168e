#include "features.h"

#include <algorithm>

#include "bind.h"
#include "results.h"

namespace adaptive_bvh::python {
namespace {

constexpr const char* kFeaturePairs =
    R"(Pairs of features: where two surfaces come together a vertex of one comes to a face of the other,
or two edges do. len() counts all.

An edge has the number 3 t + k: it goes from corner k of triangle t to corner (k + 1) % 3. Of the
numbers that an edge of several triangles has the smallest counts.)";

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

void sortIgnored(std::vector<FeaturePair>& pairs, bool is_self) {
  for (FeaturePair& pair : pairs)
    if (is_self && pair.first > pair.second) std::swap(pair.first, pair.second);
  std::sort(pairs.begin(), pairs.end());
}

std::vector<FeaturePair> ignoredFrom(const py::object& pairs, const char* name, bool is_self) {
  std::vector<FeaturePair> list = pairsOrNone(pairs, name);
  sortIgnored(list, is_self);
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
  ResultClass<FeaturePairs> pairs(module, "FeaturePairs", kFeaturePairs);
  (*pairs)
      .def(py::init([](const py::object& vertex_face, const py::object& face_vertex,
                       const py::object& edge_edge) {
             return FeaturePairs{pairsOrNone(vertex_face, "vertex_face"),
                                 pairsOrNone(face_vertex, "face_vertex"),
                                 pairsOrNone(edge_edge, "edge_edge")};
           }),
           py::arg("vertex_face") = py::none(), py::arg("face_vertex") = py::none(),
           py::arg("edge_edge") = py::none(), "Each an array (K, 2) of integers, or None.")
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

}  // namespace adaptive_bvh::python
