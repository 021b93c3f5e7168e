#pragma once

#include <array>

#include "geometry/scratch.h"
#include "hierarchy/bottom_up.h"

namespace adaptive_bvh {

/// A binary tree of primitives whose leaves have an order, from left to right: what is below a node
/// is a range of places in it. Lives during a build.
struct OrderedTree {
  struct Node {
    int left, right;        ///< nodes; -1 of a leaf
    unsigned first, count;  ///< places

    bool isLeaf() const { return left < 0; }
  };

  OrderedTree() = default;
  explicit OrderedTree(const BinaryTree& tree);

  Scratch<Node> nodes;           ///< the root first
  Scratch<unsigned> primitives;  ///< by place
};

}  // namespace adaptive_bvh
