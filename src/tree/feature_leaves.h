#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <vector>

#include "tree/feature_owners.h"
#include "tree/vertex_slots.h"
#include "tree/wide_tree.h"

namespace adaptive_bvh {

/// A vertex that a triangle owns, and an edge.
struct OwnedVertex {
  unsigned vertex, slot;
};
struct OwnedEdge {
  unsigned number;  ///< 3 t + k
  unsigned vertices[2], slots[2];
};

/// The vertices and edges that the triangles of the leaves of a four-wide tree own, in groups of
/// four: a leaf has those from its first group on. The last group of a leaf repeats its last.
class FeatureLeaves {
 public:
  struct Leaf {
    unsigned vertices, edges;  ///< first groups
    std::uint8_t num_vertices, num_edges;

    unsigned vertexGroups() const { return (num_vertices + 3u) / 4; }
    unsigned edgeGroups() const { return (num_edges + 3u) / 4; }
  };

  template <typename S>
  void adopt(const WideTree<S>& tree, const FeatureOwners& owners, const VertexSlots& slots);

  /// By the number of a leaf, in the order of the tree's nodes.
  const std::vector<Leaf>& leaves() const { return leaves_; }
  /// Four of each group.
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

/// Owners of one model's features and its leaves, found by the first query that needs them after a
/// build. Queries on many threads may ask at once; one of them does the work, the others wait. A
/// copy begins without them.
class FeaturesOnDemand {
 public:
  FeaturesOnDemand() = default;
  FeaturesOnDemand(const FeaturesOnDemand&) {}
  FeaturesOnDemand& operator=(const FeaturesOnDemand&) = delete;

  /// `tree`: the model's AdaptiveTree.
  template <typename BV, typename Tree>
  const FeatureLeaves& leaves(const fcl::BVHModel<BV>& model, const Tree& tree) {
    if (topology_.load(std::memory_order_acquire) == tree.topology_number) return leaves_;
    const std::lock_guard<std::mutex> lock(adopting_);
    if (topology_.load(std::memory_order_relaxed) == tree.topology_number) return leaves_;
    leaves_.adopt(tree.wide.topology(model, tree), tree.owners.current(model, tree.topology_number),
                  tree.topology.slots);
    topology_.store(tree.topology_number, std::memory_order_release);
    return leaves_;
  }

  std::size_t bytes() const { return leaves_.bytes(); }

 private:
  std::atomic<std::uint64_t> topology_{0};
  std::mutex adopting_;
  FeatureLeaves leaves_;
};

}  // namespace adaptive_bvh
