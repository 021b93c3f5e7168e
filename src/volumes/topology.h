#pragma once

#include <cstdint>
#include <vector>

#include <fcl/geometry/bvh/BVH_model.h>

#include "hierarchy/vertex_slots.h"

namespace adaptive_bvh {

/// What FCL's tree looks like, beyond its nodes.
///
/// FCL numbers nodes in preorder of their parents, siblings side by side: the children of the k-th
/// inner node are 2k+1 and 2k+2. So the nodes below a node are a range, and walking the pairs of
/// siblings from the last to the first visits children before parents, the right subtree first:
/// a stack is all the memory that a post-order traversal needs (volumes/post_order.h).
struct Topology {
  /// The vertices of every primitive, in the order of the leaves: those below a node are
  /// [first_primitive, + num_primitives).
  VertexSlots slots;
  int depth = 0;  ///< links from the root to the deepest leaf
  /// By node: the left child, which the right one follows; of a leaf -1 less its index among the
  /// leaves. (FCL's nodes are 136 bytes each.)
  std::vector<std::int32_t> links;

  bool isLeaf(int node) const { return links[static_cast<std::size_t>(node)] < 0; }
  int left(int node) const { return links[static_cast<std::size_t>(node)]; }
  int leafIndex(int node) const { return -1 - links[static_cast<std::size_t>(node)]; }
  /// The number of an inner node among the inner nodes.
  std::size_t innerIndex(int node) const { return static_cast<std::size_t>(left(node) - 1) / 2; }

  template <typename BV>
  void adopt(const fcl::BVHModel<BV>& model);

  /// The capacity that the stack of a post-order traversal needs.
  std::size_t stackCapacity() const { return static_cast<std::size_t>(depth) + 2; }

  std::size_t bytes() const { return slots.bytes() + links.capacity() * sizeof(links[0]); }
};

}  // namespace adaptive_bvh
