#pragma once

#include <array>
#include <vector>

#include "tree/mesh_of_model.h"

namespace adaptive_bvh {

/// FCL's tree in few bytes, for walks that need no more of its nodes (which are 136 bytes each).
///
/// FCL numbers nodes in preorder of their parents, siblings side by side: the children of the k-th
/// inner node are 2k+1 and 2k+2. So the nodes below a node are a range, and walking the pairs of
/// siblings from the last to the first visits children before parents, the right subtree first:
/// a stack is all the memory that a bottom-up sweep needs (update/sweep.h).
struct Topology {
  /// Per node: its left child (the right one follows it); of a leaf ~p, p its place among leaves.
  std::vector<int> link;
  /// Primitives in the order of the leaves: a node's are [first_primitive, + num_primitives).
  /// FCL keeps the same list privately.
  std::vector<unsigned> order;
  /// Their vertices, in the same order. A point is a triangle with three equal corners.
  std::vector<std::array<unsigned, 3>> corners;
  int depth = 0;  ///< links from the root to the deepest leaf

  /// The left one of the last two siblings; -1 when there are none.
  int lastPair() const { return static_cast<int>(link.size()) - 2; }
  bool isLeaf(int node) const { return link[node] < 0; }
  int place(int leaf) const { return ~link[leaf]; }

  template <typename BV>
  void adopt(const fcl::BVHModel<BV>& model);

  std::size_t bytes() const;
};

}  // namespace adaptive_bvh
