#pragma once

#include <cstdint>
#include <vector>

#include "base/scratch.h"
#include "mesh/mesh_view.h"

namespace adaptive_bvh {

/// A triangle, and which of its vertices and edges it stands for.
struct FeatureOwner {
  unsigned triangle;  ///< its index
  unsigned bits;  ///< 0 to 2: the corners that it owns; 3 to 5: edges, from corner k to the next

  unsigned vertices() const { return bits & 7; }
  unsigned edges() const { return bits >> 3; }
  bool ownsVertex(unsigned k) const { return bits >> k & 1; }
  bool ownsEdge(unsigned k) const { return bits >> (3 + k) & 1; }
};

/// An edge in the direction in which triangles run through it more often, and how much more.
struct BoundaryEdge {
  unsigned from, to;
  int surplus;
};

/// Each vertex and each edge is owned by one triangle, the one with the smallest number. So pairs
/// of triangles whose boxes meet give every pair of features once: the owned vertices of one with
/// the face of the other, and owned edges with owned edges (representative triangles: Curtis,
/// Tamstorf, Manocha 2008). An edge between a vertex and itself is owned by none.
class FeatureOwners {
 public:
  /// `primitives`: the triangles' indices, by place in the order of a tree's leaves. Overwrites
  /// `boundary` with each edge that is not run through as often in one direction as in the other.
  void adopt(const MeshView<double>& mesh, std::size_t num_vertices,
             const Scratch<unsigned>& primitives, std::vector<BoundaryEdge>& boundary);

  /// By place in that order.
  const FeatureOwner& operator[](std::size_t place) const { return owners_[place]; }
  const FeatureOwner* data() const { return owners_.data(); }
  std::size_t size() const { return owners_.size(); }
  /// Whether the triangles enclose something: each edge is run through as often in one direction as
  /// in the other.
  bool isClosed() const { return is_closed_; }
  std::size_t bytes() const { return owners_.capacity() * sizeof(FeatureOwner); }

 private:
  std::vector<FeatureOwner> owners_;
  bool is_closed_ = false;
};

}  // namespace adaptive_bvh
