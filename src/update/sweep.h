#pragma once

#include "volume/lanes.h"

namespace adaptive_bvh {

/// One walk from the leaves to the root, handing values up the tree:
///
///   rule.isLeaf(node)
///   rule.leaf(node, a)         makes `a` the value of a leaf
///   rule.apply(left, a, b)     what is to be done at two siblings, left and left + 1, after
///                              everything below them; a and b are their values
///   rule.merge(a, b)           makes `a` the value of their parent
///   rule.applyRoot(a)          what is to be done at the root
///
/// Walking the pairs of siblings from the last to the first visits children before parents, and the
/// subtree of a left sibling ends right after its pair (see Topology): so values wait on a stack,
/// which needs as many places as the tree is deep, and two.
template <typename Value, typename Rule>
ADAPTIVE_BVH_INLINE void sweep(int nodes, Value* stack, Rule& rule) {
  Value a, b;
  for (int left = nodes - 2; left > 0; left -= 2) {
    rule.isLeaf(left) ? rule.leaf(left, a) : void(a = *--stack);  // its subtree came last
    rule.isLeaf(left + 1) ? rule.leaf(left + 1, b) : void(b = *--stack);
    rule.apply(left, a, b);
    rule.merge(a, b);
    *stack++ = a;
  }
  rule.isLeaf(0) ? rule.leaf(0, a) : void(a = *--stack);
  rule.applyRoot(a);
}

}  // namespace adaptive_bvh
