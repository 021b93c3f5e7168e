#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "mesh/named_vertices.h"

namespace adaptive_bvh {

/// For updates of some vertices: marks the nodes of a tree above moved vertices. Node 0 is the
/// root, and a node has a larger number than its parent. It can be rebuilt, so a copy is empty.
class DirtyNodes {
 public:
  DirtyNodes() = default;
  /// `parents` are those of all nodes. forEachCorner(visit) calls visit(vertex, node) for the
  /// corners of the triangles of all leaves, leaf by leaf, in the same order whenever it is called.
  template <typename ForEachCorner>
  DirtyNodes(std::size_t num_vertices, std::vector<unsigned> parents,
             const ForEachCorner& forEachCorner)
      : begins_(num_vertices + 2, 0),  // shifted by one while they are filled
        parents_(std::move(parents)),
        marked_(parents_.size() / 64 + 1, 0) {
    named_.reserve(num_vertices);
    const auto forEachLeaf = [&](const auto& visit) {  // of each vertex once
      std::vector<unsigned> last(num_vertices, ~0u);
      forEachCorner([&](unsigned vertex, unsigned node) {
        if (std::exchange(last[vertex], node) != node) visit(vertex, node);
      });
    };
    forEachLeaf([&](unsigned vertex, unsigned) { ++begins_[vertex + 2]; });
    for (std::size_t i = 2; i < begins_.size(); ++i) begins_[i] += begins_[i - 1];
    leaves_.resize(begins_.back());
    forEachLeaf([&](unsigned vertex, unsigned node) { leaves_[begins_[vertex + 1]++] = node; });
    begins_.pop_back();
  }
  DirtyNodes(const DirtyNodes&) {}
  DirtyNodes& operator=(const DirtyNodes& other) {
    if (this != &other) *this = DirtyNodes();
    return *this;
  }
  DirtyNodes(DirtyNodes&&) = default;
  DirtyNodes& operator=(DirtyNodes&&) = default;

  bool isEmpty() const { return begins_.empty(); }
  /// The number of nodes.
  int size() const { return static_cast<int>(parents_.size()); }

  /// Calls visit(i) once for each listed vertex (NamedVertices::forEachLast).
  template <typename Visit>
  void forEachLast(const unsigned* indices, std::size_t count, const Visit& visit) {
    named_.forEachLast(indices, count, visit);
  }
  /// Calls visit(node) for the leaves of a vertex.
  template <typename Visit>
  void forEachLeaf(unsigned vertex, const Visit& visit) const {
    for (unsigned i = begins_[vertex]; i < begins_[vertex + 1]; ++i) visit(leaves_[i]);
  }
  /// Marks the leaves of a vertex.
  void add(unsigned vertex) {
    forEachLeaf(vertex, [&](unsigned node) { mark(node); });
  }

  bool isMarked(int node) const { return (marked_[wordOf(node)] & bitOf(node)) != 0; }
  /// The last marked node before `node`, or -1; marks its parent. So a loop from size() on visits
  /// the marked leaves and the nodes above them, children first.
  int before(int node) {
    auto word = static_cast<int>(wordOf(node));
    std::uint64_t bits = marked_[wordOf(node)] & (bitOf(node) - 1);
    while (bits == 0) {
      if (--word < 0) return -1;
      bits = marked_[static_cast<std::size_t>(word)];
    }
    const int found = 64 * word + 63 - __builtin_clzll(bits);
    if (found > 0) mark(parents_[static_cast<std::size_t>(found)]);
    return found;
  }
  void unmark(int node) { marked_[wordOf(node)] &= ~bitOf(node); }
  void unmarkAll() { std::fill(marked_.begin(), marked_.end(), 0); }

  std::size_t bytes() const {
    return (begins_.capacity() + leaves_.capacity() + parents_.capacity()) * sizeof(unsigned) +
           marked_.capacity() * sizeof(marked_[0]) + named_.bytes();
  }

 private:
  static std::size_t wordOf(int node) { return static_cast<std::size_t>(node) / 64; }
  static std::uint64_t bitOf(int node) { return std::uint64_t(1) << node % 64; }
  void mark(unsigned node) { marked_[node / 64] |= bitOf(static_cast<int>(node)); }

  /// The leaves with vertex v are leaves_[begins_[v]] to leaves_[begins_[v + 1] - 1].
  std::vector<unsigned> begins_, leaves_;
  std::vector<unsigned> parents_;      ///< by node
  std::vector<std::uint64_t> marked_;  ///< one bit for each node; none is set between updates
  NamedVertices named_;
};

}  // namespace adaptive_bvh
