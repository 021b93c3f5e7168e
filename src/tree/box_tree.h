#pragma once

#include <cstdint>
#include <cstring>
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
  /// The node's number among those with three primitives or more: see BoxTree::adopt.
  int largeIndex() const { return bitsOf(high_[3]) - kFirst; }
  void setLargeIndex(int index) { setBits(high_[3], kFirst + index); }
  void setLeft(int node) { setLink(kFirst + node); }
  void setLeafIndex(int index) { setLink(kFirst - 1 - index); }

 private:
  /// The bits of 1.f. As the fourth lane of arithmetic, a link is then an ordinary number near 1;
  /// small integers would be denormal ones, with which processors are slow.
  static constexpr std::int32_t kFirst = 0x3f800000;

  static std::int32_t bitsOf(float number) {
    std::int32_t bits;
    std::memcpy(&bits, &number, sizeof(bits));
    return bits;
  }
  static void setBits(float& number, std::int32_t bits) {
    std::memcpy(&number, &bits, sizeof(bits));
  }
  std::int32_t link() const { return bitsOf(low_[3]); }
  void setLink(std::int32_t bits) { setBits(low_[3], bits); }

  float low_[4] = {0, 0, 0, 1};   ///< the fourth: the bits of a link
  float high_[4] = {0, 0, 0, 1};  ///< the fourth: the bits of largeIndex
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

  int largeIndex(int node) const { return root_[node].largeIndex(); }

 private:
  Node* root_;
};

/// All that TranslationPropagation reads of the tree: the links (FCL's nodes are 136 bytes each),
/// and one tight box for each of FCL's nodes, in body coordinates, renewed in every step.
template <typename S>
class BoxTree {
 public:
  BodyFrame<S> frame;

  /// Links of the model's tree; the boxes come with the next propagation. Numbers the nodes with
  /// three primitives or more from 0.
  template <typename BV>
  void adopt(const fcl::BVHModel<BV>& model) {
    const int size = model.getNumBVs();
    nodes_.assign(static_cast<std::size_t>(size) + 1, BoxNode());
    large_ = 0;
    for (int i = 0; i < size; ++i) {
      const auto& node = model.getBV(i);
      BoxNode& box_node = nodes_[static_cast<std::size_t>(i) + 1];
      if (node.isLeaf())
        box_node.setLeafIndex(node.first_primitive);
      else
        box_node.setLeft(node.leftChild());
      if (node.num_primitives > 2) box_node.setLargeIndex(large_++);
    }
  }

  BoxNodes<const BoxNode> nodes() const { return BoxNodes<const BoxNode>(nodes_.data() + 1); }
  BoxNodes<BoxNode> nodes() { return BoxNodes<BoxNode>(nodes_.data() + 1); }

  /// How many nodes have three primitives or more.
  int largeNodes() const { return large_; }

  Box root() const { return nodes_[1].box(); }
  /// The middle of all triangles, in the model's coordinates.
  fcl::Vector3<S> middle() const { return frame.fromBodyFrame(root().center()); }

  std::size_t bytes() const { return nodes_.capacity() * sizeof(BoxNode); }

 private:
  int large_ = 0;
  std::vector<BoxNode> nodes_;  // by node + 1: siblings are then aligned to a cache line
};

}  // namespace adaptive_bvh
