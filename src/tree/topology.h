#pragma once

#include <fcl/geometry/bvh/BVH_model.h>

#include "mesh/vertex_slots.h"

namespace adaptive_bvh {

/// What FCL's tree looks like, beyond its nodes.
///
/// FCL numbers nodes in preorder of their parents, siblings side by side: the children of the k-th
/// inner node are 2k+1 and 2k+2. So the nodes below a node are a range, and walking the pairs of
/// siblings from the last to the first visits children before parents, the right subtree first:
/// a stack is all the memory that a post-order traversal needs (update/post_order.h).
struct Topology {
  /// The vertices of every primitive, in the order of the leaves: those below a node are
  /// [first_primitive, + num_primitives).
  VertexSlots slots;
  int depth = 0;  ///< links from the root to the deepest leaf

  template <typename BV>
  void adopt(const fcl::BVHModel<BV>& model);

  /// The capacity that the stack of a post-order traversal needs.
  std::size_t stackCapacity() const { return static_cast<std::size_t>(depth) + 2; }

  std::size_t bytes() const { return slots.bytes(); }
};

}  // namespace adaptive_bvh
