#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <memory>
#include <vector>

#include <fcl/common/types.h>
#include <fcl/math/triangle.h>

#include "adaptive_bvh/build_flags.h"

namespace adaptive_bvh {

/// What two features are, the first mesh's before the second's.
enum class FeatureKind { VertexFace, FaceVertex, EdgeEdge };

/// Numbers of two features: of vertices, triangles or edges.
struct FeaturePair {
  unsigned first;   ///< a feature of the first mesh
  unsigned second;  ///< a feature of the second

  /// Are both numbers the same?
  friend bool operator==(const FeaturePair& a, const FeaturePair& b) {
    return a.first == b.first && a.second == b.second;
  }
  /// Does a number differ?
  friend bool operator!=(const FeaturePair& a, const FeaturePair& b) { return !(a == b); }
  /// By the first number, then by the second.
  friend bool operator<(const FeaturePair& a, const FeaturePair& b) {
    return a.first != b.first ? a.first < b.first : a.second < b.second;
  }
};

/// Pairs of features of two meshes, or of one with itself: where two surfaces come together, a
/// vertex of one comes to a face of the other, or two edges do.
///
/// Vertices and triangles have their numbers in FCL's arrays. An edge has the number 3 t + k: it
/// goes from corner k of triangle t to corner (k + 1) % 3. An edge of several triangles has the
/// smallest of these numbers; edges are the same when they have the same two vertices.
///
/// The vectors keep their memory when they are cleared: reuse them.
struct FeaturePairs {
  std::vector<FeaturePair> vertex_face;  ///< a vertex of the first and a triangle of the second
  /// A triangle of the first and a vertex of the second. Empty for one mesh with itself:
  /// `vertex_face` has all.
  std::vector<FeaturePair> face_vertex;
  /// An edge of the first and one of the second; of one mesh with itself the smaller number first.
  std::vector<FeaturePair> edge_edge;

  /// How many pairs of all kinds.
  std::size_t size() const { return vertex_face.size() + face_vertex.size() + edge_edge.size(); }
  /// Keeps the memory.
  void clear() {
    vertex_face.clear();
    face_vertex.clear();
    edge_edge.clear();
  }
};

/// Pairs that a query leaves out: those of a list, and those that a function names. Numbers are
/// those of the result, in its order: what the first mesh has comes first; within one mesh the
/// smaller number, and a vertex before a face.
struct IgnoredPairs {
  /// Sorted by FeaturePair's operator<; or none. It must live as long as the query. A query throws
  /// std::invalid_argument when it is not sorted.
  const std::vector<FeaturePair>* list = nullptr;
  /// Returns whether to leave a pair out; or none. It is called for pairs that may be in the
  /// result, from several threads at once where the query has several. It must return the same for
  /// the same pair, and must not throw.
  std::function<bool(unsigned first, unsigned second)> test;
};

/// Which pairs of triangles of one mesh count, by labels.
enum class LabelRule {
  Within,   ///< both triangles have the same label
  Between,  ///< they have different labels
};

/// Leaves out pairs of triangles by a label for each triangle: of simulators that keep several
/// components in one array. For `selfCollide` and `pairsWithin`. `labels` is in the order of the
/// triangles, and must live as long as the query.
inline IgnoredPairs ignoredByLabels(const std::vector<unsigned>& labels, LabelRule rule) {
  IgnoredPairs ignored;
  ignored.test = [&labels, rule](unsigned first, unsigned second) {
    return (labels[first] == labels[second]) != (rule == LabelRule::Within);
  };
  return ignored;
}

/// As ignoredByLabels, of features, for `featurePairsWithin` of one mesh (FeatureProximityRequest).
struct IgnoredFeatures {
  IgnoredPairs vertex_face;  ///< a vertex and a triangle
  IgnoredPairs edge_edge;    ///< two edges
};

/// Leaves out pairs of features by a label for each triangle. A vertex and an edge have the label
/// of their triangle with the smallest index. `labels` must live as long as the query; the
/// triangles are only read here.
inline IgnoredFeatures ignoredFeaturesByLabels(const std::vector<fcl::Triangle>& triangles,
                                               const std::vector<unsigned>& labels,
                                               LabelRule rule) {
  auto of_vertices = std::make_shared<std::vector<unsigned>>();
  for (std::size_t t = triangles.size(); t-- > 0;)
    for (int k = 0; k < 3; ++k) {
      const std::size_t vertex = triangles[t][k];
      if (vertex >= of_vertices->size()) of_vertices->resize(vertex + 1);
      (*of_vertices)[vertex] = labels[t];
    }
  IgnoredFeatures ignored;
  ignored.vertex_face.test = [of_vertices, &labels, rule](unsigned vertex, unsigned face) {
    return ((*of_vertices)[vertex] == labels[face]) != (rule == LabelRule::Within);
  };
  ignored.edge_edge.test = [&labels, rule](unsigned first, unsigned second) {
    return (labels[first / 3] == labels[second / 3]) != (rule == LabelRule::Within);
  };
  return ignored;
}

/// Of pairs of features of one kind, in arrays side by side.
template <typename S>
struct FeatureDetails {
  std::vector<S> distances;  ///< of the two features of each pair
  /// A nearest point on the first feature and on the second, in the world.
  std::vector<std::array<fcl::Vector3<S>, 2>> nearest_points;
  /// Where the nearest points lie. Of a vertex and a face: the weights of the face's corners, whose
  /// sum is 1. Of two edges: how far along the first and the second, from 0 at the first of
  /// edgeVertices to 1 at the other; the third number is 0.
  std::vector<fcl::Vector3<S>> coordinates;
  /// Of length 1, from the first feature to the second, in the world. Features that are nearer than
  /// 1e-8 of their coordinates have no such direction. Then it is, of a vertex and a face, the
  /// outward direction of the face's surface at the nearest point (ClosestFeature::normal), or its
  /// opposite where the face is the second's. Of two edges it is the cross product of their
  /// directions, with the sign that has it point along the difference of the outward directions of
  /// the first edge and of the second (ClosestFeature::normal); where edges are parallel, it is
  /// that difference, across the longer edge. Zero where even that is zero.
  std::vector<fcl::Vector3<S>> normals;

  /// How many pairs.
  std::size_t size() const { return distances.size(); }
  /// For other pairs. Keeps the memory.
  void resize(std::size_t size) {
    distances.resize(size);
    nearest_points.resize(size);
    coordinates.resize(size);
    normals.resize(size);
  }
};

/// Of FeaturePairs, kind by kind in their order.
template <typename S>
struct FeaturePairDetails {
  FeatureDetails<S> vertex_face;  ///< a vertex of the first mesh and a face of the second
  FeatureDetails<S> face_vertex;  ///< a face of the first mesh and a vertex of the second
  FeatureDetails<S> edge_edge;    ///< an edge of each mesh
};

/// The ends of an edge, by its number. `triangles` are a model's: model.tri_indices.
inline std::array<unsigned, 2> edgeVertices(const fcl::Triangle* triangles, unsigned edge) {
  const fcl::Triangle& t = triangles[edge / 3];
  const unsigned corner = edge % 3;
  return {static_cast<unsigned>(t[static_cast<int>(corner)]),
          static_cast<unsigned>(t[static_cast<int>((corner + 1) % 3)])};
}

}  // namespace adaptive_bvh
