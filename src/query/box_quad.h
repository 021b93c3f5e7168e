#pragma once

#include "geometry/boxes4.h"
#include "tree/box_tree.h"

namespace adaptive_bvh {

/// A node of a BoxTree, and how many leaves are below it.
struct CountedNode {
  int node, leaves;
};

/// Up to four nodes below a node of a BoxTree, one to three levels down. So a binary tree is read
/// as one of four children a node; below a *small* node, of four leaves at most, stand all its
/// leaves. Where fewer than four nodes stand, their boxes repeat the first.
class BoxQuad {
 public:
  static constexpr int kSmall = 4;

  /// The node alone.
  ADAPTIVE_BVH_INLINE void setNode(const BoxNodes<const BoxNode>& tree, const CountedNode& node) {
    below[0] = node;
    count = first_right = 1;
    readBoxes(tree);
  }
  /// What is below an inner node.
  ADAPTIVE_BVH_INLINE void setBelow(const BoxNodes<const BoxNode>& tree, const CountedNode& node) {
    below[0] = node;
    count = first_right = 1;
    const int least = node.leaves <= kSmall ? 1 : kSmall;
    open(tree, 0);
    first_right = 1;
    while (count < 4) {
      int most = 0;
      for (int i = 1; i < count; ++i)
        if (below[i].leaves > below[most].leaves) most = i;
      if (below[most].leaves <= least) break;
      first_right += most < first_right;
      open(tree, most);
    }
    readBoxes(tree);
  }

  /// A bit for each.
  unsigned lanes() const { return (1u << count) - 1; }
  /// Those below the left child.
  unsigned leftLanes() const { return (1u << first_right) - 1; }

  /// Of the largest box: the sum of its sides.
  float largest() const {
    Float4 sizes = float4::all(0);
    for (int k = 0; k < 3; ++k) sizes += boxes.high[k] - boxes.low[k];
    return packs::largest(sizes);
  }

  CountedNode below[4];
  int count = 0;
  int first_right = 0;  ///< the first that is below the right child
  Boxes4 boxes;

 private:
  /// In place of a node come its two children. Nodes below one are numbered in one piece, pair by
  /// pair, the left child's before the right one's: so the numbers tell how many they are.
  ADAPTIVE_BVH_INLINE void open(const BoxNodes<const BoxNode>& tree, int lane) {
    const CountedNode node = below[lane];
    const int left = tree.left(node.node);
    int leaves = 1;
    if (!tree.isLeaf(left))
      leaves =
          tree.isLeaf(left + 1) ? node.leaves - 1 : (tree.left(left + 1) - tree.left(left)) / 2 + 1;
    for (int i = count++; i > lane + 1; --i) below[i] = below[i - 1];
    below[lane] = {left, leaves};
    below[lane + 1] = {left + 1, node.leaves - leaves};
  }
  ADAPTIVE_BVH_INLINE void readBoxes(const BoxNodes<const BoxNode>& tree) {
    const auto boxOf = [&](int lane) { return tree.box(below[lane < count ? lane : 0].node); };
    boxes = boxes4(boxOf(0), boxOf(1), boxOf(2), boxOf(3));
  }
};

}  // namespace adaptive_bvh
