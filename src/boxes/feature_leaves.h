#pragma once

#include <cstdint>
#include <vector>

#include "boxes/wide_tree.h"
#include "mesh/feature_owners.h"

namespace adaptive_bvh {

/// A vertex, and an edge, that a triangle owns (FeatureOwners), and their slots in its leaf.
struct OwnedVertex {
  unsigned vertex, slot;
};
struct OwnedEdge {
  unsigned number;  ///< 3 t + k for the edge of triangle t from corner k to the next
  unsigned vertices[2], slots[2];
};

/// The vertices and edges owned by the triangles of each leaf of a four-wide tree, in groups of
/// four. A leaf's groups are contiguous. The last group of a leaf is filled up by repeating its
/// last element.
class FeatureLeaves {
 public:
  struct Leaf {
    unsigned vertices, edges;  ///< index of the leaf's first group
    std::uint8_t num_vertices, num_edges;

    unsigned vertexGroups() const { return (num_vertices + 3u) / 4; }
    unsigned edgeGroups() const { return (num_edges + 3u) / 4; }
  };

  void assign(const WideTree& tree, const FeatureOwners& owners);

  /// Indexed by WideNode::leaf.
  const std::vector<Leaf>& leaves() const { return leaves_; }
  /// Elements of all groups, four for each.
  const std::vector<OwnedVertex>& vertices() const { return vertices_; }
  const std::vector<OwnedEdge>& edges() const { return edges_; }

  std::size_t bytes() const {
    return leaves_.capacity() * sizeof(Leaf) + vertices_.capacity() * sizeof(OwnedVertex) +
           edges_.capacity() * sizeof(OwnedEdge);
  }

 private:
  std::vector<Leaf> leaves_;
  std::vector<OwnedVertex> vertices_;
  std::vector<OwnedEdge> edges_;
};

}  // namespace adaptive_bvh
