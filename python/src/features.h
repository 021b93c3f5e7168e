#pragma once

#include <string>
#include <utility>

#include "adaptive_bvh/feature_pairs.h"
#include "arrays.h"
#include "bound.h"
#include "locked_mesh.h"

namespace adaptive_bvh::python {

/// Python's FeaturePairs: arrays of (K, 2) numbers.
struct FeatureArrays : Bound {
  FeatureArrays() = default;
  /// Takes the lists over.
  explicit FeatureArrays(FeaturePairs&& pairs);

  py::ssize_t size() const {
    return vertex_face.shape(0) + face_vertex.shape(0) + edge_edge.shape(0);
  }

  py::array_t<std::int32_t> vertex_face, face_vertex, edge_edge;
};

/// In C++. Throws py::index_error when a pair names what a mesh does not have.
FeaturePairs featurePairsFrom(const FeatureArrays& arrays, const LockedMesh& first,
                              const LockedMesh& second);

/// Pairs to leave out, sorted: K x 2 integers; none of None. `is_self`: of two triangles or edges
/// of one mesh, the smaller number comes first. Throws as pairsFrom.
std::vector<FeaturePair> ignoredFrom(const py::object& pairs, const char* name,
                                     bool is_self = false);

/// Labels of a mesh's triangles, and which pairs they leave out (ignoredByLabels).
class Labels {
 public:
  /// `labels`: (M,) integers, or None: then no pair is left out. Throws as indicesFrom, and
  /// py::value_error on another length or rule.
  Labels(const py::object& labels, const std::string& rule, const LockedMesh& mesh);

  /// Of pairs of triangles; `list` is left out, too. Refers to both.
  IgnoredPairs triangles(const std::vector<FeaturePair>& list) const;
  /// Of pairs of features. Refers to this object.
  IgnoredFeatures features(const std::vector<fcl::Triangle>& triangles) const;

 private:
  bool has_labels_;
  std::vector<unsigned> labels_;
  LabelRule rule_;
};

void bindFeatures(py::module_& module);

}  // namespace adaptive_bvh::python
