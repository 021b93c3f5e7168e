#pragma once

#include <array>
#include <cstddef>
#include <vector>

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

/// The ends of an edge, by its number. `triangles` are a model's: model.tri_indices.
inline std::array<unsigned, 2> edgeVertices(const fcl::Triangle* triangles, unsigned edge) {
  const fcl::Triangle& t = triangles[edge / 3];
  const unsigned corner = edge % 3;
  return {static_cast<unsigned>(t[static_cast<int>(corner)]),
          static_cast<unsigned>(t[static_cast<int>((corner + 1) % 3)])};
}

}  // namespace adaptive_bvh
