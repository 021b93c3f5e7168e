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

  /// Whether both numbers are equal.
  friend bool operator==(const FeaturePair& a, const FeaturePair& b) {
    return a.first == b.first && a.second == b.second;
  }
  /// Whether a number differs.
  friend bool operator!=(const FeaturePair& a, const FeaturePair& b) { return !(a == b); }
  /// By the first number, then by the second.
  friend bool operator<(const FeaturePair& a, const FeaturePair& b) {
    return a.first != b.first ? a.first < b.first : a.second < b.second;
  }
};

/// Pairs of features of two meshes, or of one with itself: a vertex and a face, or two edges.
///
/// Vertices and triangles have their numbers in FCL's arrays. An edge has the number 3 t + k: it
/// goes from corner k of triangle t to corner (k + 1) % 3. An edge of several triangles has the
/// smallest of these numbers. Edges are equal if they have the same two vertices.
///
/// The vectors keep their memory when they are cleared, so a reused result need not allocate.
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

/// Pairs that a query leaves out: by a list, by a function, or by both. A pair has the numbers and
/// the order of the result: the feature of the first mesh comes first; within one mesh the smaller
/// number, and a vertex before a face.
struct IgnoredPairs {
  /// Sorted by FeaturePair's operator<; null for none. It must live as long as the query. A query
  /// throws std::invalid_argument if it is not sorted, and a query of one mesh also if a pair of
  /// two triangles or two edges has the larger number first.
  const std::vector<FeaturePair>* list = nullptr;
  /// Returns whether to leave a pair out; empty for none. It is called for pairs that may be in the
  /// result, from several threads at once if the query uses several. It must return the same value
  /// for the same pair. It may run any other query, also of the same meshes. If it throws, the
  /// query ends with that exception, and its result is valid but unspecified.
  std::function<bool(unsigned first, unsigned second)> test;
};

/// Which pairs of triangles of one mesh count, by labels.
enum class LabelRule {
  Within,   ///< both triangles have the same label
  Between,  ///< they have different labels
};

/// Leaves out pairs of triangles by a label for each triangle, for simulators that keep several
/// components in one array. For `selfCollide` and `pairsWithin`. `labels` is in the order of the
/// triangles, and must live as long as the query.
inline IgnoredPairs ignoredByLabels(const std::vector<unsigned>& labels, LabelRule rule) {
  IgnoredPairs ignored;
  ignored.test = [&labels, rule](unsigned first, unsigned second) {
    return (labels[first] == labels[second]) != (rule == LabelRule::Within);
  };
  return ignored;
}

/// Pairs of features to leave out, for `featurePairsWithin` of one mesh (FeatureProximityRequest).
struct IgnoredFeatures {
  IgnoredPairs vertex_face;  ///< a vertex and a triangle
  IgnoredPairs edge_edge;    ///< two edges
};

/// Leaves out pairs of features by a label for each triangle. A vertex and an edge have the label
/// of their triangle with the smallest index. `labels` must live as long as the query; `triangles`
/// only during this call.
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

/// Distances, points and normals of pairs of features of one kind, in parallel arrays.
template <typename S>
struct FeatureDetails {
  std::vector<S> distances;  ///< of the two features of each pair
  /// A nearest point on the first feature and on the second, in the world.
  std::vector<std::array<fcl::Vector3<S>, 2>> nearest_points;
  /// Coordinates of the nearest points. For a vertex and a face: the weights of the face's corners,
  /// whose sum is 1. For two edges: the position along the first and along the second, from 0 at
  /// the first of edgeVertices to 1 at the other; the third number is 0.
  std::vector<fcl::Vector3<S>> coordinates;
  /// Of length 1, from the first feature to the second, in the world. Features that are nearer than
  /// 1e-8 of their coordinates have no such direction. For a vertex and a face the normal is then
  /// the outward direction of the face's surface at the nearest point (ClosestFeature::normal), or
  /// its opposite if the face belongs to the second mesh. For two edges it is the cross product of
  /// their directions, with the sign that makes it point along the difference of the outward
  /// directions of the first edge and of the second (ClosestFeature::normal). For parallel edges it
  /// is that difference, perpendicular to the longer edge. Zero if that is zero, too.
  std::vector<fcl::Vector3<S>> normals;

  /// How many pairs.
  std::size_t size() const { return distances.size(); }
  /// Resizes all arrays. Keeps the memory.
  void resize(std::size_t size) {
    distances.resize(size);
    nearest_points.resize(size);
    coordinates.resize(size);
    normals.resize(size);
  }
};

/// Details of FeaturePairs, for each kind in their order.
template <typename S>
struct FeaturePairDetails {
  FeatureDetails<S> vertex_face;  ///< a vertex of the first mesh and a face of the second
  FeatureDetails<S> face_vertex;  ///< a face of the first mesh and a vertex of the second
  FeatureDetails<S> edge_edge;    ///< an edge of each mesh
};

/// The two vertices of an edge, by its number. `triangles` are those of a mesh or of a model
/// (model.tri_indices).
inline std::array<unsigned, 2> edgeVertices(const fcl::Triangle* triangles, unsigned edge) {
  const fcl::Triangle& t = triangles[edge / 3];
  const unsigned corner = edge % 3;
  return {static_cast<unsigned>(t[static_cast<int>(corner)]),
          static_cast<unsigned>(t[static_cast<int>((corner + 1) % 3)])};
}

}  // namespace adaptive_bvh
