#pragma once

#include <string>
#include <vector>

#include "adaptive_bvh/feature_pairs.h"
#include "arrays.h"
#include "bound.h"
#include "locked_mesh.h"

namespace adaptive_bvh::python {

/// A copy, which Python cannot change. Throws py::index_error when a pair names what a mesh does
/// not have.
FeaturePairs checkedPairs(const FeaturePairs& pairs, const LockedMesh& first,
                          const LockedMesh& second);

/// Sorts pairs to leave out. `is_self`: of two triangles or edges of one mesh, the smaller number
/// comes first.
void sortIgnored(std::vector<FeaturePair>& pairs, bool is_self = false);

/// Pairs to leave out, sorted: K x 2 integers; none of None. Throws as pairsFrom.
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
  const std::vector<unsigned>& labels() const { return labels_; }
  LabelRule rule() const { return rule_; }

 private:
  bool has_labels_;
  std::vector<unsigned> labels_;
  LabelRule rule_;
};

}  // namespace adaptive_bvh::python
