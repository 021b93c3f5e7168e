#pragma once

#include <limits>

#include "base/float4.h"
#include "base/scratch.h"
#include "boxes/wide_tree.h"

namespace adaptive_bvh {

/// The nodes of a four-wide tree that a walk is still to visit, depth first, each with a number
/// that says how near it is.
class OpenNodes {
 public:
  struct Node {
    int number;
    float key;
  };

  /// `depth`: of the tree. A node that is visited makes room for four below it.
  explicit OpenNodes(int depth) : nodes_(static_cast<std::size_t>(3 * depth + 4)) {}

  /// With the root.
  void start(float key = 0) {
    top_ = nodes_.data();
    *top_++ = {0, key};
  }
  bool isEmpty() const { return top_ == nodes_.data(); }
  Node pop() { return *--top_; }

  /// Some of the nodes below one, a bit each; the one with the least key will be next.
  ADAPTIVE_BVH_INLINE void push(const WideNode& parent, unsigned lanes, const Float4& keys) {
    alignas(16) float key[4];
    float4::store(keys, key);
    Node* const first = top_;
    for (; lanes; lanes &= lanes - 1) {
      const int lane = __builtin_ctz(lanes);
      const Node node = {parent.below[lane], key[lane]};
      Node* at = top_++;
      for (; at > first && at[-1].key < node.key; --at) *at = at[-1];
      *at = node;
    }
  }

 private:
  Scratch<Node> nodes_;
  Node* top_ = nullptr;
};

/// Walks of one four-wide tree, depth first. It holds the memory of the nodes still to visit.
class TreeWalk {
 public:
  explicit TreeWalk(const WideTree& tree) : tree_(tree), open_(tree.depth()) {}

  /// Visits the nearest box first. keys(node) says of its boxes how near each is; boxes beyond
  /// limit(), which may decrease, are left out. leaf(node, lanes, keys) is given the others of a
  /// leaf, a bit each, and returns whether the walk is over. Returns whether it was.
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

  /// Visits the boxes that admits(boxes) names, a bit each, in the order of the leaves.
  /// leaf(place) is given the place of each triangle whose box is admitted, and returns whether the
  /// walk is over. Returns whether it was.
  template <typename Admits, typename Leaf>
  ADAPTIVE_BVH_INLINE bool visit(const Admits& admits, const Leaf& leaf) {
    const auto visitLeaf = [&](const WideNode& node, unsigned lanes) {
      for (; lanes; lanes &= lanes - 1)
        if (leaf(static_cast<unsigned>(node.first + __builtin_ctz(lanes)))) return true;
      return false;
    };
    return visitLeaves(admits, visitLeaf);
  }
  /// As `visit`; leaf(node, lanes) is given a leaf with all boxes that are admitted.
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
  static unsigned lanesOf(const WideNode& node) { return (1u << node.count) - 1; }

  const WideTree& tree_;
  OpenNodes open_;
};

}  // namespace adaptive_bvh
