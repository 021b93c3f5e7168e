#pragma once

#include <cstdint>
#include <cstring>
#include <vector>

#include "threads/task_pool.h"
#include "tree/traversal_statistics.h"
#include "tree/wide_tree.h"

namespace adaptive_bvh {

/// The nodes of one four-wide tree that a query went below, for the traversal statistics of the
/// binary tree: noted here first, for the same nodes are visited again and again. Nothing is noted
/// where no statistics are wanted.
class VisitedNodes {
 public:
  /// Memory that a thread can keep.
  using Memory = std::vector<std::uint8_t>;

  VisitedNodes() = default;
  /// `visits`: PlacedMesh::visits.
  VisitedNodes(Memory& memory, int nodes, TraversalStatistics* visits) : visits_(visits) {
    if (!visits) return;
    size_ = nodes;
    memory.assign(static_cast<std::size_t>(nodes), 0);
    lanes_ = memory.data();
  }
  bool isOn() const { return lanes_; }
  /// Of a leaf: `lanes` are the triangles that were tested, a bit each.
  ADAPTIVE_BVH_INLINE void add(int node, unsigned lanes) {
    if (lanes_) lanes_[node] |= static_cast<std::uint8_t>(kVisited | lanes);
  }
  /// Of the same tree.
  void add(const VisitedNodes& other) {
    for (int i = 0; i < size_; ++i) lanes_[i] |= other.lanes_[i];
  }
  void record(const WideNode* nodes, const TaskPool& pool) const {
    if (!visits_) return;
    pool.forEachPart(size_, pool.parts(), [&](int first, int last, int) {
      for (int i = next(first, last); i < last; i = next(i + 1, last))
        record(nodes[i], lanes_[i], *visits_);
    });
  }

 private:
  static constexpr unsigned kVisited = 16;

  /// The first visited node from `i` on, before `last`; or that. Most are skipped by eight.
  int next(int i, int last) const {
    for (std::uint64_t eight; i + 8 <= last; i += 8) {
      std::memcpy(&eight, lanes_ + i, sizeof(eight));
      if (eight) break;
    }
    while (i < last && !lanes_[i]) ++i;
    return i;
  }

  static void record(const WideNode& node, unsigned lanes, TraversalStatistics& visits) {
    for (const std::int32_t binary : node.binary)
      if (binary >= 0) visits.recordVisit(binary);
    if (!node.isLeaf()) return;
    for (int k = 0; k < node.count; ++k)
      if (lanes >> k & 1) visits.recordVisit(node.below[k]);
  }

  TraversalStatistics* visits_ = nullptr;
  std::uint8_t* lanes_ = nullptr;
  int size_ = 0;
};

}  // namespace adaptive_bvh
