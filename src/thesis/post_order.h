#pragma once

#include "base/pack.h"

namespace adaptive_bvh {

// Post-order (bottom-up) traversal of FCL's tree that computes a value for each node from the
// values of its children. A rule object says which nodes are traversed and what is done:
//
//   rule.nextPair()            returns the left node of the next pair of siblings, from the last
//                              pair to the first; after the first pair, a number <= 0
//   rule.isLeaf(node)
//   rule.leaf(node, a)         sets `a` to the value of a leaf
//   rule.isTraversed(node)     whether the children of an inner node were among the pairs
//   rule.skipped(node, a)      sets `a` to the value of an inner node that is not traversed
//   rule.apply(left, a, b)     works on the siblings left and left + 1, whose values are a and b;
//                              called after all nodes below them
//   rule.merge(a, b)           sets `a` to the value of their parent
//   rule.applyRoot(a)          works on the root, whose value is a
//
// A pair of siblings is followed by the pairs below its left node, then by those below its right
// node (see Topology). So iterating from the last pair to the first visits children before parents,
// right subtrees first. A stack of Topology::stackCapacity holds the value of each traversed inner
// node until its pair is worked on. `stack` points to its end.

/// Sets `value` to the value of a node. Pops it from the stack if the node was traversed.
template <typename Value, typename Rule>
ADAPTIVE_BVH_INLINE void valueOf(int node, Value& value, Value*& stack, Rule& rule) {
  if (rule.isLeaf(node))
    rule.leaf(node, value);
  else if (rule.isTraversed(node))
    value = *--stack;
  else
    rule.skipped(node, value);
}

/// Traverses the rule's pairs. Pushes the value of the first pair's parent.
template <typename Value, typename Rule>
ADAPTIVE_BVH_INLINE void traversePairs(Value*& stack, Rule& rule) {
  Value a, b;
  for (int left = rule.nextPair(); left > 0; left = rule.nextPair()) {
    valueOf(left, a, stack, rule);  // before the right one, because its value was pushed later
    valueOf(left + 1, b, stack, rule);
    rule.apply(left, a, b);
    rule.merge(a, b);
    *stack++ = a;
  }
}

/// Traverses the rule's pairs, then the root of the tree. `stack` is empty.
template <typename Value, typename Rule>
ADAPTIVE_BVH_INLINE void traversePostOrder(Value* stack, Rule& rule) {
  traversePairs(stack, rule);
  Value a;
  valueOf(0, a, stack, rule);
  rule.applyRoot(a);
}

}  // namespace adaptive_bvh
