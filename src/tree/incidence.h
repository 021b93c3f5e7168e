#pragma once

#include <cstdint>
#include <vector>

#include "tree/topology.h"

namespace adaptive_bvh {

/// The way from vertices up the tree, for updates of a few vertices: which leaves a vertex belongs
/// to, and which pairs of siblings (2k+1, 2k+2) stand above them. Made when first needed.
class Incidence {
 public:
  bool empty() const { return parent_.empty(); }
  void clear() { *this = Incidence(); }

  template <typename BV>
  void adopt(const fcl::BVHModel<BV>& model, const Topology& topology);

  /// False when there are vertices that belong to no triangle.
  bool coversAllVertices() const { return covers_all_; }

  /// Marks all pairs of siblings on the ways from the leaves of `vertex` to the root.
  void mark(unsigned vertex) {
    for (int i = first_[vertex]; i < first_[vertex + 1]; ++i) {
      // From pair to pair: the parent of a pair is a node, and that node is in a pair, or the root.
      for (int node = leaf_[static_cast<std::size_t>(i)]; node > 0;) {
        const int pair = (node - 1) / 2;
        std::uint64_t& word = marks_[static_cast<std::size_t>(pair) / 64];
        const std::uint64_t bit = std::uint64_t(1) << (pair % 64);
        if (word & bit) break;
        word |= bit;
        node = parent_[static_cast<std::size_t>(pair)];
      }
    }
  }
  bool isMarked(int left) const {
    const auto pair = static_cast<std::size_t>(left - 1) / 2;
    return (marks_[pair / 64] >> (pair % 64)) & 1;
  }
  void unmark(int left) {
    const auto pair = static_cast<std::size_t>(left - 1) / 2;
    marks_[pair / 64] &= ~(std::uint64_t(1) << (pair % 64));
  }
  /// The left sibling of the last marked pair before the pair of `left`; -1 when there is none.
  int markedBefore(int left) const {
    int pair = (left - 1) / 2;
    if (pair <= 0) return -1;
    auto word = static_cast<int>((pair - 1) / 64);
    std::uint64_t bits = marks_[static_cast<std::size_t>(word)];
    if (pair % 64 != 0) bits &= (std::uint64_t(1) << (pair % 64)) - 1;
    while (bits == 0) {
      if (--word < 0) return -1;
      bits = marks_[static_cast<std::size_t>(word)];
    }
    return 2 * (64 * word + 63 - __builtin_clzll(bits)) + 1;
  }

  std::size_t bytes() const {
    return (parent_.capacity() + first_.capacity() + leaf_.capacity()) * sizeof(int) +
           marks_.capacity() * sizeof(std::uint64_t);
  }

 private:
  std::vector<int> parent_;  // by pair: the node above it
  std::vector<int> first_;   // by vertex, and one more: where its leaves begin
  std::vector<int> leaf_;
  std::vector<std::uint64_t> marks_;  // a bit for each pair
  bool covers_all_ = false;
};

}  // namespace adaptive_bvh
