#pragma once

#include <vector>

#include "tree/topology.h"
#include "update/dirty_pairs.h"

namespace adaptive_bvh {

/// The leaves that each vertex belongs to, and the parents above them, for steps of a few vertices.
/// Made when first needed.
class VertexLeafMap {
 public:
  bool empty() const { return parent_.empty(); }
  void clear() { *this = VertexLeafMap(); }

  template <typename BV>
  void adopt(const fcl::BVHModel<BV>& model, const Topology& topology);

  /// Makes all pairs of siblings dirty on the paths from the leaves of `vertex` to the root.
  void markAncestors(unsigned vertex, DirtyPairs& dirty) const {
    for (int i = first_[vertex]; i < first_[vertex + 1]; ++i) {
      // From pair to pair: the parent of a pair is a node, and that node is in a pair, or the root.
      for (int node = leaf_[static_cast<std::size_t>(i)]; node > 0;) {
        const int left = node - (node % 2 == 0);
        if (dirty.set(left)) break;
        node = parent_[static_cast<std::size_t>(left - 1) / 2];
      }
    }
  }

  /// Calls visit(slot) for every slot of a vertex; more than once for some. None for a vertex
  /// without a triangle.
  template <typename Visit>
  void forEachSlot(unsigned vertex, const Topology& topology, Visit&& visit) const {
    for (int i = first_[vertex]; i < first_[vertex + 1]; ++i) {
      const int leaf = topology.leafIndex(leaf_[static_cast<std::size_t>(i)]);
      for (unsigned slot : topology.slots.slotsOf(static_cast<std::size_t>(leaf)))
        if (topology.slots.vertices()[slot] == vertex) visit(slot);
    }
  }

  std::size_t bytes() const {
    return (parent_.capacity() + first_.capacity() + leaf_.capacity()) * sizeof(int);
  }

 private:
  std::vector<int> parent_;  // by pair: the node above it
  std::vector<int> first_;   // by vertex, and one more: where its leaves begin
  std::vector<int> leaf_;
};

}  // namespace adaptive_bvh
