#pragma once

#include <vector>

#include "tree/topology.h"

namespace adaptive_bvh {

/// One walk from the leaves to the root, handing values up the tree:
///
///   rule.leaf(node)          the value of a leaf
///   rule.apply(node, value)  what is to be done at every node, after its children
///   rule.merge(left, right)  makes `left` the value of both's parent
///
/// Walking the pairs of siblings from the last to the first visits children before parents, and the
/// subtree of a left sibling ends right after its pair (see Topology): so values wait on a stack.
template <typename Value, typename Rule>
void sweep(const Topology& topology, std::vector<Value>& stack, Rule& rule) {
  const auto take = [&](int node) -> Value {
    if (topology.isLeaf(node)) return rule.leaf(node);
    const Value value = stack.back();
    stack.pop_back();
    return value;
  };
  for (int left = topology.lastPair(); left > 0; left -= 2) {
    Value value = take(left);  // its subtree came last
    const Value right = take(left + 1);
    rule.apply(left, value);
    rule.apply(left + 1, right);
    rule.merge(value, right);
    stack.push_back(value);
  }
  rule.apply(0, take(0));
}

}  // namespace adaptive_bvh
