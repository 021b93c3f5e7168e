#pragma once

#include "geometry/boxes4.h"
#include "tree/box_tree.h"

namespace adaptive_bvh {

/// Up to four nodes below a node of a BoxTree, two levels down; a leaf on the way stands for
/// itself. So a binary tree is read as one of four children a node. Boxes that there are none for
/// repeat the first.
class BoxQuad {
 public:
  /// The node alone.
  ADAPTIVE_BVH_INLINE void setNode(const BoxNodes<const BoxNode>& tree, int node) {
    nodes[0] = node;
    count = 1;
    first_right = 1;
    const Box box = tree.box(node);
    boxes = boxes4(box, box, box, box);
  }
  /// What is below an inner node.
  ADAPTIVE_BVH_INLINE void setBelow(const BoxNodes<const BoxNode>& tree, int node) {
    count = 0;
    const int left = tree.left(node);
    add(tree, left);
    first_right = count;
    add(tree, left + 1);
    const auto boxOf = [&](int lane) { return tree.box(nodes[lane < count ? lane : 0]); };
    boxes = boxes4(boxOf(0), boxOf(1), boxOf(2), boxOf(3));
  }

  /// A bit for each.
  unsigned lanes() const { return (1u << count) - 1; }
  /// Those below the left child.
  unsigned leftLanes() const { return (1u << first_right) - 1; }

  int nodes[4];
  int count = 0;
  int first_right = 0;  ///< the first that is below the right child
  Boxes4 boxes;

 private:
  ADAPTIVE_BVH_INLINE void add(const BoxNodes<const BoxNode>& tree, int child) {
    if (tree.isLeaf(child)) {
      nodes[count++] = child;
      return;
    }
    nodes[count++] = tree.left(child);
    nodes[count] = nodes[count - 1] + 1;
    ++count;
  }
};

}  // namespace adaptive_bvh
