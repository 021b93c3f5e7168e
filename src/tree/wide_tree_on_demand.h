#pragma once

#include <atomic>
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

  /// `tree`: the model's AdaptiveTree, with boxes or without.
  template <typename BV, typename Tree>
  const WideTree<S>& current(const fcl::BVHModel<BV>& model, const Tree& tree) {
    return current(model, tree, [&] { return ownCoordinates(model, tree); });
  }
  /// As above, renewed in the coordinates that `coordinates()` returns, where it was not up to
  /// date.
  template <typename BV, typename Tree, typename Coordinates>
  const WideTree<S>& current(const fcl::BVHModel<BV>& model, const Tree& tree,
                             const Coordinates& coordinates) {
    if (isCurrent(tree)) return wide_;
    const std::lock_guard<std::mutex> lock(refitting_);
    if (isCurrent(tree)) return wide_;
    adopt(model, tree);
    wide_.refit(model, tree.topology.slots, coordinates(), TaskPool(tree.query_threads));
    positions_.store(tree.positions, std::memory_order_release);
    return wide_;
  }

  /// Along the body's axes, from its middle.
  template <typename BV, typename Tree>
  static BodyCoordinates ownCoordinates(const fcl::BVHModel<BV>& model, const Tree& tree) {
    const BodyFrame<S> frame(tree.axes, model.aabb_center, model.aabb_radius);
    constexpr float kSlack = 1 + 1.f / (1 << 16);  // for what the radius is rounded by
    return {frame, kSlack * static_cast<float>(model.aabb_radius * frame.scale())};
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
  template <typename BV, typename Tree>
  void adopt(const fcl::BVHModel<BV>& model, const Tree& tree) {
    if (topology_ != tree.topology_number) wide_.adopt(model, tree.topology.slots);
    topology_ = tree.topology_number;
  }

  std::atomic<std::uint64_t> positions_{0};  ///< AdaptiveTree::positions at the last refit
  std::uint64_t topology_ = 0;               ///< AdaptiveTree::topology_number
  std::mutex refitting_;
  WideTree<S> wide_;
};

}  // namespace adaptive_bvh
