#pragma once

#include <array>
#include <vector>

#include "tree/mesh_of_model.h"

namespace adaptive_bvh {

/// What FCL's tree looks like, beyond its nodes.
///
/// FCL numbers nodes in preorder of their parents, siblings side by side: the children of the k-th
/// inner node are 2k+1 and 2k+2. So the nodes below a node are a range, and walking the pairs of
/// siblings from the last to the first visits children before parents, the right subtree first:
/// a stack is all the memory that a bottom-up sweep needs (update/sweep.h).
struct Topology {
  /// The vertices of every primitive, in the order of the leaves: those below a node are
  /// [first_primitive, + num_primitives). A point is a triangle with three equal corners.
  std::vector<Corners> corners;
  int depth = 0;  ///< links from the root to the deepest leaf

  template <typename BV>
  void adopt(const fcl::BVHModel<BV>& model);

  /// Places that the stack of a sweep needs.
  std::size_t stackPlaces() const { return static_cast<std::size_t>(depth) + 2; }

  std::size_t bytes() const { return corners.capacity() * sizeof(Corners); }
};

}  // namespace adaptive_bvh
