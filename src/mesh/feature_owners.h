#pragma once

#include <cstdint>
#include <vector>

#include "base/scratch.h"
#include "mesh/mesh_view.h"

namespace adaptive_bvh {

/// A triangle and the set of its vertices and edges that it owns.
struct FeatureOwner {
  unsigned triangle;  ///< index in the mesh
  unsigned bits;      ///< 0 to 2: owned corners; 3 to 5: owned edges, from corner k to the next

  /// The owned vertices and edges, one bit each.
  unsigned vertices() const { return bits & 7; }
  unsigned edges() const { return bits >> 3; }
  bool ownsVertex(unsigned k) const { return bits >> k & 1; }
  bool ownsEdge(unsigned k) const { return bits >> (3 + k) & 1; }
};

/// An edge in the direction in which more triangles traverse it, and the difference of both counts.
struct BoundaryEdge {
  unsigned from, to;
  int surplus;
};

/// Assigns each vertex and each edge to one triangle, the one with the smallest index. Pairs of
/// triangles whose boxes overlap then produce each pair of features once: owned vertices of one
/// with the face of the other, and owned edges with owned edges (representative triangles: Curtis,
/// Tamstorf, Manocha 2008). An edge from a vertex to itself has no owner.
class FeatureOwners {
 public:
  /// `primitives` are the triangles' indices in the order of a tree's leaves. Overwrites `boundary`
  /// with each edge that is not traversed equally often in both directions.
  void assign(const MeshView<double>& mesh, std::size_t num_vertices,
              const Scratch<unsigned>& primitives, std::vector<BoundaryEdge>& boundary);

  /// The triangle at an index in the order of the leaves.
  const FeatureOwner& operator[](std::size_t leaf_index) const { return owners_[leaf_index]; }
  const FeatureOwner* data() const { return owners_.data(); }
  std::size_t size() const { return owners_.size(); }
  /// Whether the mesh is closed: each edge is traversed equally often in both directions.
  bool isClosed() const { return is_closed_; }
  std::size_t bytes() const { return owners_.capacity() * sizeof(FeatureOwner); }

 private:
  std::vector<FeatureOwner> owners_;  ///< in the order of the leaves
  bool is_closed_ = false;
};

}  // namespace adaptive_bvh
