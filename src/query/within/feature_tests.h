#pragma once

#include "adaptive_bvh/feature_pairs.h"
#include "base/vectors.h"
#include "boxes/wide_tree.h"
#include "mesh/feature_owners.h"
#include "triangles/exact_nearness.h"
#include "triangles/feature_distance.h"

namespace adaptive_bvh {

/// Tests the features of two triangles: those that the triangles own (FeatureOwners), so each pair
/// of features is tested once. The pairs of two triangles have numbers from 0 to kPairs - 1: the
/// corners of the first and the face of the second, the corners of the second and the face of the
/// first, then the edges. "Near" means within the distance.
class FeatureTests {
 public:
  static constexpr unsigned kPairs = 15;

  /// One of two triangles.
  struct Triangle {
    const Int4& vertices;       ///< the indices of its vertices
    const FeatureOwner& owner;  ///< its own index, and the features that it owns
    TrianglePoints points;      ///< its corners in the first mesh's frame
  };
  /// A pair of features of any kind, with the numbers of feature_pairs.h.
  struct Pair {
    FeatureKind kind;
    FeaturePair features;
  };

  /// `radii`: the sum of both meshes' radii. `is_self`: one mesh with itself; features with a
  /// vertex in common are left out.
  FeatureTests(double distance, double radii, bool is_self)
      : nearness_(distance, radii), is_self_(is_self) {}

  /// Compares distances of triangles with the distance.
  const ExactNearness& nearness() const { return nearness_; }

  /// Calls visit(number, distance, is_near) for each pair of features.
  template <typename Visit>
  void forEach(const Triangle& a, const Triangle& b, const Visit& visit) const {
    testVertices(a, b, 0, visit);
    testVertices(b, a, 3, visit);
    for (unsigned i = 0; i < 3; ++i)
      for (unsigned j = 0; j < 3; ++j)
        if (a.owner.ownsEdge(i) && b.owner.ownsEdge(j)) testEdges(a, i, b, j, visit);
  }

  /// Returns a pair by its number.
  Pair pair(unsigned number, const FeatureOwner& a, const Int4& a_vertices, const FeatureOwner& b,
            const Int4& b_vertices) const {
    if (number < 3)
      return {FeatureKind::VertexFace, {unsigned(a_vertices[int(number)]), b.triangle}};
    if (number < 6) {
      const auto vertex = static_cast<unsigned>(b_vertices[int(number - 3)]);
      if (is_self_) return {FeatureKind::VertexFace, {vertex, a.triangle}};
      return {FeatureKind::FaceVertex, {a.triangle, vertex}};
    }
    const unsigned first = 3 * a.triangle + (number - 6) / 3,
                   second = 3 * b.triangle + (number - 6) % 3;
    const bool swaps = is_self_ && first > second;
    return {FeatureKind::EdgeEdge, {swaps ? second : first, swaps ? first : second}};
  }

 private:
  bool areSame(int vertex1, int vertex2) const { return is_self_ && vertex1 == vertex2; }

  /// Tests the vertices that `owner` owns with the face.
  template <typename Visit>
  void testVertices(const Triangle& owner, const Triangle& face, unsigned first_number,
                    const Visit& visit) const {
    for (unsigned k = 0; k < 3; ++k) {
      const int v = owner.vertices[int(k)];
      if (!owner.owner.ownsVertex(k) || areSame(v, face.vertices[0]) ||
          areSame(v, face.vertices[1]) || areSame(v, face.vertices[2]))
        continue;
      const fcl::Vector3d& x = owner.points[k];
      const double distance = vertexFaceDistance(x, face.points).distance;
      visit(first_number + k, distance, nearness_.areNear(distance, x, face.points));
    }
  }
  /// Tests edge i of triangle a and edge j of b.
  template <typename Visit>
  void testEdges(const Triangle& a, unsigned i, const Triangle& b, unsigned j,
                 const Visit& visit) const {
    const unsigned i1 = (i + 1) % 3, j1 = (j + 1) % 3;
    for (const unsigned end : {i, i1})
      if (areSame(a.vertices[int(end)], b.vertices[int(j)]) ||
          areSame(a.vertices[int(end)], b.vertices[int(j1)]))
        return;
    const ExactNearness::Segment p = {a.points[i], a.points[i1]}, q = {b.points[j], b.points[j1]};
    const double distance = edgeEdgeDistance(p, q).distance;
    visit(6 + 3 * i + j, distance, nearness_.areNear(distance, p, q));
  }

  const ExactNearness nearness_;
  const bool is_self_;
};

}  // namespace adaptive_bvh
