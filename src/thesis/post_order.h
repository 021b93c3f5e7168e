#pragma once

#include "base/pack.h"

namespace adaptive_bvh {

// Post-order (bottom-up) traversal that passes values up the tree. A rule says what to do:
//
//   rule.nextPair()            the left node of the next pair of siblings, from the last pair to
//                              the first; then a number <= 0
//   rule.isLeaf(node)
//   rule.leaf(node, a)         makes `a` the value of a leaf
//   rule.isTraversed(node)     whether the children of an inner node were among the pairs
//   rule.known(node, a)        makes `a` the value of an inner node that is not traversed
//   rule.apply(left, a, b)     works on two siblings, left and left + 1, after everything below
//                              them; a and b are their values
//   rule.merge(a, b)           makes `a` the value of their parent
//   rule.applyRoot(a)          works on the root
//
// A pair of siblings is followed by the pairs below its left node, then by those below its right
// node (see Topology). So iterating from the last pair to the first visits children before parents,
// right subtrees first. Values of inner nodes wait on a stack of Topology::stackCapacity.

/// Sets `value` to the value of a node: that of a leaf, from the stack, or known to the rule.
template <typename Value, typename Rule>
ADAPTIVE_BVH_INLINE void valueOf(int node, Value& value, Value*& stack, Rule& rule) {
  if (rule.isLeaf(node))
    rule.leaf(node, value);
  else if (rule.isTraversed(node))
    value = *--stack;
  else
    rule.known(node, value);
}

/// Traverses the rule's pairs. Leaves the value of their common root on the stack.
template <typename Value, typename Rule>
ADAPTIVE_BVH_INLINE void traversePairs(Value*& stack, Rule& rule) {
  Value a, b;
  for (int left = rule.nextPair(); left > 0; left = rule.nextPair()) {
    valueOf(left, a, stack, rule);  // first, because its value was pushed last
    valueOf(left + 1, b, stack, rule);
    rule.apply(left, a, b);
    rule.merge(a, b);
    *stack++ = a;
  }
}

/// Traverses a tree, with its root.
template <typename Value, typename Rule>
ADAPTIVE_BVH_INLINE void traversePostOrder(Value* stack, Rule& rule) {
  traversePairs(stack, rule);
  Value a;
  valueOf(0, a, stack, rule);
  rule.applyRoot(a);
}

}  // namespace adaptive_bvh
