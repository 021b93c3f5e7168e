#pragma once

#include <atomic>
#include <cmath>
#include <cstdint>
#include <mutex>

#include "tree/wide_tree.h"

namespace adaptive_bvh {

/// The four-wide tree of one model, brought up to date by the first query that needs it after an
/// update: who asks for distances only does not pay for it. Queries on many threads may ask at
/// once; one of them does the work, the others wait. A copy begins without one.
template <typename S>
class WideTreeOnDemand {
 public:
  WideTreeOnDemand() = default;
  WideTreeOnDemand(const WideTreeOnDemand&) {}
  WideTreeOnDemand& operator=(const WideTreeOnDemand&) = delete;

  template <typename Tree>
  bool isCurrent(const Tree& tree) const {
    return positions_.load(std::memory_order_acquire) == tree.positions;
  }

  /// `tree`: the model's AdaptiveTree, with boxes or without. `axes`: where the four-wide tree is
  /// not up to date, it is renewed along these axes; by default along those of the boxes.
  template <typename BV, typename Tree>
  const WideTree<S>& current(const fcl::BVHModel<BV>& model, const Tree& tree,
                             const fcl::Matrix3d* axes = nullptr) {
    if (isCurrent(tree)) return wide_;
    const std::lock_guard<std::mutex> lock(refitting_);
    if (isCurrent(tree)) return wide_;
    adopt(model, tree);
    if (tree.boxes)
      refitInBox(model, tree, axes ? *axes : tree.boxes->frame.axes());
    else
      refitAroundMiddle(model, tree.topology.slots, axes ? *axes : fcl::Matrix3d::Identity());
    positions_.store(tree.positions, std::memory_order_release);
    return wide_;
  }

  /// As above, but boxes and positions may be old ones, and change at any time: links and vertices
  /// only may be read. Also of a tree without boxes.
  template <typename BV, typename Tree>
  const WideTree<S>& topology(const fcl::BVHModel<BV>& model, const Tree& tree) {
    const std::lock_guard<std::mutex> lock(refitting_);
    adopt(model, tree);
    return wide_;
  }

  std::size_t bytes() const { return wide_.bytes(); }

 private:
  /// From the origin of the tree's boxes. A coordinate along other axes is at most as large as the
  /// distance from it.
  template <typename BV, typename Tree>
  void refitInBox(const fcl::BVHModel<BV>& model, const Tree& tree, const fcl::Matrix3d& axes) {
    BodyFrame<S> frame = tree.boxes->frame;
    frame.turn(axes);
    const Box root = tree.boxes->root();
    const Float4 corner = float4::upper(float4::absolute(root.low), float4::absolute(root.high));
    const float size =
        std::sqrt(corner[0] * corner[0] + corner[1] * corner[1] + corner[2] * corner[2]);
    wide_.refit(model, tree.topology.slots, frame, size * (1 + 1.f / (1 << 20)));
  }
  /// From the middle of the model's local AABB.
  template <typename BV>
  void refitAroundMiddle(const fcl::BVHModel<BV>& model, const VertexSlots& slots,
                         const fcl::Matrix3d& axes) {
    const BodyFrame<S> frame(axes, model.aabb_center, model.aabb_radius);
    wide_.refit(model, slots, frame, static_cast<float>(model.aabb_radius * frame.scale()));
  }
  template <typename BV, typename Tree>
  void adopt(const fcl::BVHModel<BV>& model, const Tree& tree) {
    if (topology_ != tree.topology_number) wide_.adopt(model);
    topology_ = tree.topology_number;
  }

  std::atomic<std::uint64_t> positions_{0};  ///< AdaptiveTree::positions at the last refit
  std::uint64_t topology_ = 0;               ///< AdaptiveTree::topology_number
  std::mutex refitting_;
  WideTree<S> wide_;
};

}  // namespace adaptive_bvh
