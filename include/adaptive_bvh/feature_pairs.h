#pragma once

#include <array>
#include <cstddef>
#include <functional>
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

/// Pairs to leave out: by a list, by a function, or by both. A pair has the numbers and
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

/// Which pairs of triangles a query of one mesh with itself leaves out: neighbours always touch.
/// Vertices are compared by index, so a mesh that was built triangle by triangle (addTriangle) has
/// no neighbours: join its vertices first (weldVertices). A vertex that a triangle repeats counts
/// once.
enum class NeighbourFilter {
  SharedVertex,  ///< leaves out pairs with a vertex in common
  SharedEdge,    ///< leaves out pairs with two vertices in common
  None,          ///< leaves out no pair
  /// Leaves out pairs with vertices in common whose triangles have no other common point. So
  /// neighbours count if they are folded over each other, or cross beyond the shared corner or
  /// edge. That is decided without any error. Triangles with the same three vertices count. A
  /// triangle without area does not count with its neighbours. For selfCollide only.
  BeyondShared,
};

class SurfaceNeighbourhood;

/// What a query leaves out. A query of triangles reads `triangles`, a query of features the other
/// lists; within one mesh `face_vertex` is not read, and features with a common vertex are always
/// left out.
struct Ignored {
  /// Neighbouring triangles of one mesh.
  NeighbourFilter neighbours = NeighbourFilter::SharedVertex;
  /// Further pairs of triangles of one mesh, by their distance along the surface or by labels
  /// (surface_neighbourhood.h); null for none. A vertex or an edge counts as its triangle with the
  /// smallest index. It must live as long as the query, which throws std::invalid_argument if it is
  /// of another mesh.
  const SurfaceNeighbourhood* surface = nullptr;
  IgnoredPairs triangles = {};    ///< pairs of triangles
  IgnoredPairs vertex_face = {};  ///< a vertex of the first mesh and a triangle of the second
  IgnoredPairs face_vertex = {};  ///< a triangle of the first mesh and a vertex of the second
  IgnoredPairs edge_edge = {};    ///< two edges
};

/// Distances, points and normals of pairs of features of one kind, in parallel arrays.
struct FeatureDetails {
  std::vector<double> distances;  ///< of the two features of each pair
  /// A nearest point on the first feature and on the second, in the world.
  std::vector<std::array<fcl::Vector3d, 2>> nearest_points;
  /// Coordinates of the nearest points. For a vertex and a face: the weights of the face's corners,
  /// whose sum is 1. For two edges: the position along the first and along the second, from 0 at
  /// the first of edgeVertices to 1 at the other; the third number is 0.
  std::vector<fcl::Vector3d> coordinates;
  /// Of length 1, from the first feature to the second, in the world. Features that are nearer than
  /// 1e-8 of their coordinates have no such direction. For a vertex and a face the normal is then
  /// the outward direction of the face's surface at the nearest point (ClosestFeature::normal), or
  /// its opposite if the face belongs to the second mesh. For two edges it is the cross product of
  /// their directions, with the sign that makes it point along the difference of the outward
  /// directions of the first edge and of the second (ClosestFeature::normal). For parallel edges it
  /// is that difference, perpendicular to the longer edge. Zero if that is zero, too.
  std::vector<fcl::Vector3d> normals;

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
struct FeaturePairDetails {
  FeatureDetails vertex_face;  ///< a vertex of the first mesh and a face of the second
  FeatureDetails face_vertex;  ///< a face of the first mesh and a vertex of the second
  FeatureDetails edge_edge;    ///< an edge of each mesh
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
