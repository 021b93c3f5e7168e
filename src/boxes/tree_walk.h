#pragma once

#include <limits>

#include "base/float4.h"
#include "base/scratch.h"
#include "boxes/wide_tree.h"

namespace adaptive_bvh {

/// The stack of a depth-first walk over a four-wide tree: nodes still to visit, each with a key
/// that measures how near it is.
class OpenNodes {
 public:
  struct Node {
    int number;
    float key;
  };

  /// `depth` is that of the tree. Visiting a node removes it and adds at most four.
  explicit OpenNodes(int depth) : nodes_(static_cast<std::size_t>(3 * depth + 4)) {}

  /// Starts with the root.
  void start(float key = 0) {
    top_ = nodes_.data();
    *top_++ = {0, key};
  }
  bool isEmpty() const { return top_ == nodes_.data(); }
  Node pop() { return *--top_; }

  /// Pushes the children of a node that are set in `lanes`; the child with the least key is on top.
  ADAPTIVE_BVH_INLINE void push(const WideNode& parent, unsigned lanes, const Float4& keys) {
    alignas(16) float key[4];
    float4::store(keys, key);
    Node* const first = top_;
    for (; lanes; lanes &= lanes - 1) {
      const int lane = __builtin_ctz(lanes);
      const Node node = {parent.below[lane], key[lane]};
      Node* to = top_++;  // insertion sort
      for (; to > first && to[-1].key < node.key; --to) *to = to[-1];
      *to = node;
    }
  }

 private:
  Scratch<Node> nodes_;
  Node* top_ = nullptr;
};

/// Depth-first traversals of one four-wide tree. Owns the stack.
class TreeWalk {
 public:
  explicit TreeWalk(const WideTree& tree) : tree_(tree), open_(tree.depth()) {}

  /// Traverses nearest boxes first. keysOf(node) returns a distance key for each of a node's boxes;
  /// boxes whose key exceeds limit(), which may decrease during the walk, are skipped. For a leaf,
  /// leaf(node, lanes, keys) receives the remaining boxes, one bit each; it returns true to stop
  /// the traversal. Returns whether the traversal was stopped.
  template <typename Keys, typename Limit, typename Leaf>
  ADAPTIVE_BVH_INLINE bool nearestFirst(const Keys& keysOf, const Limit& limit, const Leaf& leaf) {
    open_.start(std::numeric_limits<float>::lowest());
    while (!open_.isEmpty()) {
      const OpenNodes::Node next = open_.pop();
      const float most = limit();
      if (next.key > most) continue;
      const WideNode& node = tree_.nodes()[next.number];
      const Float4 keys = keysOf(node);
      const unsigned lanes = lanesOf(node) & float4::bits(keys <= float4::all(most));
      if (!node.isLeaf())
        open_.push(node, lanes, keys);
      else if (lanes && leaf(node, lanes, keys))
        return true;
    }
    return false;
  }

  /// Traverses the boxes that are set in the bits of admits(boxes), in the order of the leaves.
  /// leaf(i) is called for each triangle whose box is admitted, with its index in the order of the
  /// leaves; it returns true to stop the traversal. Returns whether the traversal was stopped.
  template <typename Admits, typename Leaf>
  ADAPTIVE_BVH_INLINE bool visit(const Admits& admits, const Leaf& leaf) {
    const auto visitLeaf = [&](const WideNode& node, unsigned lanes) {
      for (; lanes; lanes &= lanes - 1)
        if (leaf(static_cast<unsigned>(node.first + __builtin_ctz(lanes)))) return true;
      return false;
    };
    return visitLeaves(admits, visitLeaf);
  }
  /// Like `visit`, but calls leaf(node, lanes) once for each leaf with admitted boxes.
  template <typename Admits, typename Leaf>
  ADAPTIVE_BVH_INLINE bool visitLeaves(const Admits& admits, const Leaf& leaf) {
    const Float4 in_order{0, 1, 2, 3};
    open_.start(0);
    while (!open_.isEmpty()) {
      const WideNode& node = tree_.nodes()[open_.pop().number];
      const unsigned lanes = lanesOf(node) & admits(node.boxes);
      if (!node.isLeaf())
        open_.push(node, lanes, in_order);
      else if (lanes && leaf(node, lanes))
        return true;
    }
    return false;
  }

 private:
  /// A bit for each box of a node.
  static unsigned lanesOf(const WideNode& node) { return (1u << node.count) - 1; }

  const WideTree& tree_;
  OpenNodes open_;
};

}  // namespace adaptive_bvh
