#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>
#include <vector>

#include <fcl/geometry/bvh/BVH_model.h>

#include "geometry/body_frame.h"
#include "geometry/box.h"

namespace adaptive_bvh {

/// A node of a BoxTree: its box and its link. Siblings share a cache line.
class alignas(32) BoxNode {
 public:
  ADAPTIVE_BVH_INLINE Box box() const { return {float4::load(low_), float4::load(high_)}; }
  ADAPTIVE_BVH_INLINE void setBox(const Box& box) {
    float4::store3(box.low, low_);
    float4::store3(box.high, high_);
  }

  ADAPTIVE_BVH_INLINE bool isLeaf() const { return link() < kFirst; }
  ADAPTIVE_BVH_INLINE int left() const { return link() - kFirst; }
  ADAPTIVE_BVH_INLINE int leafIndex() const { return kFirst - 1 - link(); }
  /// Of a node's volume, when its axes were last chosen: for its refits.
  float chosenArea() const { return high_[3]; }
  void setChosenArea(float area) { high_[3] = std::max(area, std::numeric_limits<float>::min()); }
  void setLeft(int node) { setLink(kFirst + node); }
  void setLeafIndex(int index) { setLink(kFirst - 1 - index); }

 private:
  /// The bits of 1.f. As the fourth lane of arithmetic, a link is then an ordinary number near 1;
  /// small integers would be denormal ones, with which processors are slow.
  static constexpr std::int32_t kFirst = 0x3f800000;

  std::int32_t link() const {
    std::int32_t bits;
    std::memcpy(&bits, low_ + 3, sizeof(bits));
    return bits;
  }
  void setLink(std::int32_t bits) { std::memcpy(low_ + 3, &bits, sizeof(bits)); }

  float low_[4] = {0, 0, 0, 1};  ///< the fourth: the bits of a link
  float high_[4] = {0, 0, 0, 1};  ///< the fourth: see chosenArea
};

/// The nodes of a BoxTree, by FCL's numbers; cheap to copy. `Node` is BoxNode, or const.
template <typename Node>
class BoxNodes {
 public:
  explicit BoxNodes(Node* root) : root_(root) {}

  ADAPTIVE_BVH_INLINE Box box(int node) const { return root_[node].box(); }
  ADAPTIVE_BVH_INLINE bool isLeaf(int node) const { return root_[node].isLeaf(); }
  /// Of an inner node: the left child, which the right one follows.
  ADAPTIVE_BVH_INLINE int left(int node) const { return root_[node].left(); }
  /// Of a leaf: its index among the leaves.
  ADAPTIVE_BVH_INLINE int leafIndex(int node) const { return root_[node].leafIndex(); }

  ADAPTIVE_BVH_INLINE void setBox(int node, const Box& box) const { root_[node].setBox(box); }

  float chosenArea(int node) const { return root_[node].chosenArea(); }
  void setChosenArea(int node, float area) const { root_[node].setChosenArea(area); }

 private:
  Node* root_;
};

/// All that queries by boxes read: one tight box for each of FCL's nodes, in body coordinates,
/// renewed in every step, with the links of the tree (FCL's nodes are 136 bytes each).
template <typename S>
class BoxTree {
 public:
  BodyFrame<S> frame;

  /// Links of the model's tree; the boxes come with the next propagation.
  template <typename BV>
  void adopt(const fcl::BVHModel<BV>& model) {
    const int size = model.getNumBVs();
    nodes_.assign(static_cast<std::size_t>(size) + 1, BoxNode());
    for (int i = 0; i < size; ++i) {
      const auto& node = model.getBV(i);
      BoxNode& box_node = nodes_[static_cast<std::size_t>(i) + 1];
      if (node.isLeaf())
        box_node.setLeafIndex(node.first_primitive);
      else
        box_node.setLeft(node.leftChild());
    }
  }

  BoxNodes<const BoxNode> nodes() const { return BoxNodes<const BoxNode>(nodes_.data() + 1); }
  BoxNodes<BoxNode> nodes() { return BoxNodes<BoxNode>(nodes_.data() + 1); }

  Box root() const { return nodes_[1].box(); }
  /// The middle of all triangles, in the model's coordinates.
  fcl::Vector3<S> middle() const { return frame.fromBodyFrame(root().center()); }

  std::size_t bytes() const { return nodes_.capacity() * sizeof(BoxNode); }

 private:
  std::vector<BoxNode> nodes_;  // by node + 1: siblings are then aligned to a cache line
};

}  // namespace adaptive_bvh
