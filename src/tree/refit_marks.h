#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

namespace adaptive_bvh {

/// Which volumes the last update recomputed. A byte a node holds the number of the step that did
/// it; a step clears all marks by raising that number. Several threads may mark different nodes.
class RefitMarks {
 public:
  /// Room for `nodes` nodes, none marked.
  void reset(int nodes) {
    steps_.assign(static_cast<std::size_t>(nodes), 0);
    step_ = 1;
  }
  /// Forgets all marks.
  void clear() {
    if (++step_ != 0) return;
    std::fill(steps_.begin(), steps_.end(), std::uint8_t(0));
    step_ = 1;
  }
  void mark(int node) { steps_[static_cast<std::size_t>(node)] = step_; }
  void markAll() { std::fill(steps_.begin(), steps_.end(), step_); }
  /// In ascending order.
  std::vector<int> marked() const {
    std::vector<int> nodes;
    if (steps_.empty()) return nodes;
    const std::uint8_t *const first = steps_.data(), *const end = first + steps_.size();
    for (const std::uint8_t* at = first; at < end; ++at) {
      at = static_cast<const std::uint8_t*>(
          std::memchr(at, step_, static_cast<std::size_t>(end - at)));
      if (!at) break;
      nodes.push_back(static_cast<int>(at - first));
    }
    return nodes;
  }

  std::size_t bytes() const { return steps_.capacity(); }

 private:
  std::vector<std::uint8_t> steps_;  // 0 is no step
  std::uint8_t step_ = 1;
};

}  // namespace adaptive_bvh
