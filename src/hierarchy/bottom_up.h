#pragma once

#include <array>
#include <vector>

#include "base/scratch.h"
#include "mesh/mesh_view.h"

namespace adaptive_bvh {

/// A binary tree over primitives 0, 1, ..., n - 1. These are its leaves; node n + i has the
/// children `children[i]`, which have smaller numbers. The last node is the root.
struct BinaryTree {
  unsigned leaves = 0;
  Scratch<std::array<unsigned, 2>> children;
};

/// Builds the tree level by level from the connectivity of the mesh (thesis appendix).
///
/// On each level every group of triangles is paired with a neighbour, preferably the one with which
/// it shares the greatest length of mesh edges: "a pairing whose total edge connection is large is
/// likely to be square-like". Then the pairs are the groups of the next level; the lengths that
/// pairs share are sums of those of their members. Of each connected component at most one group
/// stays isolated a level, and is the first to choose on the next.
///
/// Exchanging partners cannot always bring isolated groups together: of three triangles around a
/// fourth, two are left. Those left in one component are paired along a Morton curve.
///
/// Components that have become one group each, and points and triangles that share no edge, are
/// merged in the same manner with proximity in place of shared edges.
///
/// Every level halves the number of groups of a component, then that of the components, rounding
/// up: the depth is at most ceil(log2 t) + ceil(log2 c) for c components, the largest of t
/// triangles. As t + c <= n + 1, this is at most 2 log2(n + 1).
///
/// Tried without gain: weights divided by the size of the groups, or by the diagonal of the box
/// around both, and exchanges of partners between two pairs where that raises the sum of weights.
/// Counts of volume tests moved by up to 16 %, in both directions.
template <typename S>
BinaryTree buildBottomUp(const MeshView<S>& mesh, unsigned count);

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

  Scratch<Node> nodes;  ///< each before those below it, and those on the left before the right
  Scratch<unsigned> primitives;  ///< by place
};

/// The shape of an ordered tree: a bit for each node, in the order of the nodes, set for a leaf.
/// The shape and the order of the primitives are all of the tree.
std::vector<bool> shapeOf(const OrderedTree& tree);

/// Makes the tree of a shape, with `primitives` by place. Returns false unless the shape is that of
/// one binary tree with a leaf for each primitive, no deeper than buildBottomUp makes one, and each
/// of the primitives from 0 on comes once.
bool treeOf(const std::vector<bool>& shape, Scratch<unsigned> primitives, OrderedTree& tree);

}  // namespace adaptive_bvh
