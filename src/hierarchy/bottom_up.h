#pragma once

#include <array>
#include <vector>

#include "base/scratch.h"
#include "mesh/mesh_view.h"

namespace adaptive_bvh {

/// A binary tree over n primitives. Nodes 0 to n - 1 are the leaves, one for each primitive; node n
/// + i has the children `children[i]`, which have smaller numbers. The last node is the root.
struct BinaryTree {
  unsigned leaves = 0;
  Scratch<std::array<unsigned, 2>> children;
};

/// Builds a tree of `count` primitives, level by level, by their connectivity (thesis appendix).
///
/// On each level every group of triangles is paired with a neighbour, preferably the one with which
/// it shares the greatest length of mesh edges: "a pairing whose total edge connection is large is
/// likely to be square-like". The pairs are the groups of the next level, and shared lengths are
/// summed over their members. On each level, at most one group of each connected component stays
/// unpaired; it chooses first on the next level.
///
/// Exchanging partners cannot always pair all groups: three triangles around a fourth leave two
/// unpaired. Unpaired groups of one component are paired along a Morton curve.
///
/// Components that have become one group each, and points and triangles that share no edge, are
/// merged in the same way, by proximity instead of shared edges.
///
/// Every level halves the number of groups in a component, rounded up; after that, every level
/// halves the number of components. So the depth is at most ceil(log2 t) + ceil(log2 c) for c
/// components, the largest with t triangles. As t + c <= n + 1, this is at most 2 log2(n + 1).
///
/// Rejected alternatives: weights divided by the size of the groups or by the diagonal of their
/// common box, and exchanging partners between two pairs if that increases the sum of weights. They
/// changed the number of volume tests by up to 16 %, in both directions.
BinaryTree buildBottomUp(const MeshView<double>& mesh, unsigned count);

/// A binary tree of primitives whose leaves are ordered from left to right, so that the leaves
/// below a node are a contiguous range. Exists only during a build.
struct OrderedTree {
  struct Node {
    int left, right;        ///< child nodes; -1 for a leaf
    unsigned first, count;  ///< range of leaves below the node, as indices in `primitives`

    bool isLeaf() const { return left < 0; }
  };

  OrderedTree() = default;
  explicit OrderedTree(const BinaryTree& tree);

  Scratch<Node> nodes;  ///< in depth-first order: parents first, left subtrees before right ones
  Scratch<unsigned> primitives;  ///< the primitive of each leaf, from left to right
};

/// The shape of an ordered tree: one bit for each node in order, set for a leaf. The shape and the
/// order of the primitives determine the tree.
std::vector<bool> shapeOf(const OrderedTree& tree);

/// Reconstructs a tree from its shape and its primitives in the order of the leaves. Returns false
/// unless the shape is one binary tree with a leaf for each primitive, no deeper than
/// buildBottomUp's trees, and the primitives are a permutation of 0, 1, 2 and so on.
bool treeOf(const std::vector<bool>& shape, Scratch<unsigned> primitives, OrderedTree& tree);

}  // namespace adaptive_bvh
