#pragma once

#include <algorithm>
#include <random>
#include <set>
#include <vector>

#include <fcl/geometry/bvh/BVH_model.h>

namespace adaptive_bvh_test {

/// The tree as the sets of triangles below its nodes: what matters, whichever child is the left
/// one.
template <typename BV>
std::set<std::set<int>> groupsOf(const fcl::BVHModel<BV>& model) {
  std::set<std::set<int>> groups;
  std::vector<std::set<int>> below(std::size_t(model.getNumBVs()));
  for (int i = model.getNumBVs() - 1; i >= 0; --i) {
    const auto& node = model.getBV(i);
    auto& group = below[std::size_t(i)];
    if (node.isLeaf()) {
      group.insert(node.primitiveId());
    } else {
      for (int child : {node.leftChild(), node.rightChild()})
        group.insert(below[std::size_t(child)].begin(), below[std::size_t(child)].end());
    }
    groups.insert(group);
  }
  return groups;
}

/// The links of a tree as FCL numbers its nodes: siblings side by side, in preorder of their
/// parents.
struct NumberedTree {
  std::vector<int> left;    ///< by node: the left child, which the right one follows; -1 for a leaf
  std::vector<int> parent;  ///< by node; -1 for the root
  int depth = 0;            ///< links from the root to the deepest leaf

  int nodes() const { return static_cast<int>(left.size()); }
  bool isLeaf(int node) const { return left[std::size_t(node)] < 0; }

  /// Splits the node, a leaf, by `leaves` of which a random share goes to the left.
  void grow(int node, int leaves, int level, std::mt19937& random) {
    depth = std::max(depth, level);
    if (leaves == 1) return;
    const int children = nodes();
    left[std::size_t(node)] = children;
    left.insert(left.end(), 2, -1);
    parent.insert(parent.end(), 2, node);
    const int on_left = std::uniform_int_distribution<int>(1, leaves - 1)(random);
    grow(children, on_left, level + 1, random);
    grow(children + 1, leaves - on_left, level + 1, random);
  }
};

inline NumberedTree randomTree(int leaves, std::mt19937& random) {
  NumberedTree tree;
  tree.left = {-1};
  tree.parent = {-1};
  tree.grow(0, leaves, 0, random);
  return tree;
}

}  // namespace adaptive_bvh_test
