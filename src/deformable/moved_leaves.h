#pragma once

#include <cstdint>
#include <vector>

#include "boxes/wide_tree.h"
#include "mesh/named_vertices.h"

namespace adaptive_bvh {

/// The data for updates of some vertices: maps each vertex to the leaf nodes of a four-wide tree
/// that contain it, and marks nodes to refit. It can be rebuilt, so a copy is empty.
class MovedLeaves {
 public:
  MovedLeaves() = default;
  MovedLeaves(const WideTree& tree, std::size_t num_vertices);
  MovedLeaves(const MovedLeaves&) {}
  MovedLeaves& operator=(const MovedLeaves& other) {
    if (this != &other) *this = MovedLeaves();
    return *this;
  }
  MovedLeaves(MovedLeaves&&) = default;
  MovedLeaves& operator=(MovedLeaves&&) = default;

  bool isEmpty() const { return begins_.empty(); }
  /// Calls visit(i) once for each listed vertex (NamedVertices::forEachLast).
  template <typename Visit>
  void forEachLast(const unsigned* indices, std::size_t count, const Visit& visit) {
    named_.forEachLast(indices, count, visit);
  }
  /// Marks the leaves that contain a vertex.
  void add(unsigned vertex) {
    for (unsigned i = begins_[vertex]; i < begins_[vertex + 1]; ++i) mark(leaves_[i]);
  }
  /// Calls refit(node) for every marked node and its ancestors, children first, because they have
  /// larger numbers; clears the marks. Returns the number of calls.
  template <typename Refit>
  std::size_t refitAll(const Refit& refit) {
    std::size_t count = 0;
    for (std::size_t word = marked_.size(); word-- > 0;)
      while (marked_[word]) {
        const int bit = 63 - __builtin_clzll(marked_[word]);
        marked_[word] ^= std::uint64_t(1) << bit;
        const auto node = static_cast<int>(64 * word) + bit;
        refit(node);
        ++count;
        if (node > 0) mark(parents_[static_cast<std::size_t>(node)]);
      }
    return count;
  }

  std::size_t bytes() const {
    return (begins_.capacity() + leaves_.capacity()) * sizeof(unsigned) +
           parents_.capacity() * sizeof(unsigned) + marked_.capacity() * sizeof(marked_[0]) +
           named_.bytes();
  }

 private:
  void mark(unsigned node) { marked_[node / 64] |= std::uint64_t(1) << node % 64; }

  /// The leaf nodes with vertex v are leaves_[begins_[v]] to leaves_[begins_[v + 1] - 1].
  std::vector<unsigned> begins_, leaves_;
  std::vector<unsigned> parents_;      ///< by node
  std::vector<std::uint64_t> marked_;  ///< one bit for each node
  NamedVertices named_;
};

}  // namespace adaptive_bvh
