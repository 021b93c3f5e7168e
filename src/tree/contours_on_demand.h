#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>

#include "tree/contours.h"

namespace adaptive_bvh {

/// The contours of one model's four-wide tree, found by the first query that needs them after the
/// topology changed. Queries on many threads may ask at once. A copy begins without them.
class ContoursOnDemand {
 public:
  ContoursOnDemand() = default;
  ContoursOnDemand(const ContoursOnDemand&) {}
  ContoursOnDemand& operator=(const ContoursOnDemand&) = delete;

  /// `wide`: of the model whose AdaptiveTree is `tree`, up to date.
  template <typename S, typename Tree>
  const Contours& current(const WideTree<S>& wide, const Tree& tree) {
    if (topology_.load(std::memory_order_acquire) == tree.topology_number) return contours_;
    const std::lock_guard<std::mutex> lock(adopting_);
    if (topology_.load(std::memory_order_relaxed) == tree.topology_number) return contours_;
    contours_.adopt(wide.nodes(), wide.size(), tree.topology.slots);
    topology_.store(tree.topology_number, std::memory_order_release);
    return contours_;
  }

  std::size_t bytes() const { return contours_.bytes(); }

 private:
  std::atomic<std::uint64_t> topology_{0};  ///< AdaptiveTree::topology_number
  std::mutex adopting_;
  Contours contours_;
};

}  // namespace adaptive_bvh
