#pragma once

#include <utility>

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

  void start() {
    top_ = nodes_.data();
    *top_++ = {0, 0.f};
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

}  // namespace adaptive_bvh
