#pragma once

#include <cstdint>
#include <vector>

#include "thesis/adaptive_tree.h"

// Which nodes a step of a few vertices has to visit: the nodes above the leaves of these vertices.
// The children of the k-th inner node are the pair of siblings (2k+1, 2k+2), see Topology. A pair
// is identified by its left sibling 2k+1 and has the number k.
namespace adaptive_bvh {

/// Dirty flags of pairs of siblings.
class DirtyPairs {
 public:
  /// Allocates this number of pairs, none dirty.
  void reset(std::size_t pairs) { words_.assign(pairs / 64 + 1, 0); }

  bool isDirty(int left) const { return (words_[wordOf(left)] & bitOf(left)) != 0; }
  /// Marks a pair as dirty. Returns whether it was dirty before.
  bool set(int left) {
    std::uint64_t& word = words_[wordOf(left)];
    const bool was_dirty = (word & bitOf(left)) != 0;
    word |= bitOf(left);
    return was_dirty;
  }
  void unset(int left) { words_[wordOf(left)] &= ~bitOf(left); }

  /// The left sibling of the last dirty pair before the pair of `left`; -1 if there is none.
  int before(int left) const {
    int pair = (left - 1) / 2;
    if (pair <= 0) return -1;
    auto word = static_cast<int>((pair - 1) / 64);
    std::uint64_t bits = words_[static_cast<std::size_t>(word)];
    if (pair % 64 != 0) bits &= (std::uint64_t(1) << (pair % 64)) - 1;
    while (bits == 0) {
      if (--word < 0) return -1;
      bits = words_[static_cast<std::size_t>(word)];
    }
    return 2 * (64 * word + 63 - __builtin_clzll(bits)) + 1;
  }

  std::size_t bytes() const { return words_.capacity() * sizeof(std::uint64_t); }

 private:
  static std::size_t wordOf(int left) { return static_cast<std::size_t>(left - 1) / 128; }
  static std::uint64_t bitOf(int left) { return std::uint64_t(1) << (((left - 1) / 2) % 64); }

  std::vector<std::uint64_t> words_;  ///< bit k % 64 of word k / 64 stands for pair k
};

/// Maps each vertex to its leaves, and each pair of siblings to its parent.
class VertexLeafMap {
 public:
  bool empty() const { return parent_.empty(); }
  void clear() { *this = VertexLeafMap(); }

  /// Sets the map for a tree whose mesh has this number of vertices.
  void assign(const Topology& topology, int num_vertices) {
    const std::size_t leaves = topology.slots.leaves();
    parent_.assign(leaves - 1, 0);
    first_.assign(static_cast<std::size_t>(num_vertices) + 1, 0);
    leaf_.resize(3 * leaves);
    // A counting sort: count the leaves of each vertex, turn the counts into the ends of ranges,
    // then fill each range from its end, which leaves its beginning in `first_`.
    for (std::size_t leaf = 0; leaf < leaves; ++leaf)
      for (unsigned v : topology.slots.verticesOf(leaf)) ++first_[v];
    int sum = 0;
    for (int& first : first_) first = sum += first;
    for (int i = 0; i < static_cast<int>(topology.links.size()); ++i) {
      if (!topology.isLeaf(i)) {
        parent_[topology.innerIndex(i)] = i;
        continue;
      }
      for (unsigned v : topology.slots.verticesOf(static_cast<std::size_t>(topology.leafIndex(i))))
        leaf_[static_cast<std::size_t>(--first_[v])] = i;
    }
  }

  /// Marks all pairs of siblings on the paths from the leaves of `vertex` to the root as dirty.
  void markAncestors(unsigned vertex, DirtyPairs& dirty) const {
    for (int i = first_[vertex]; i < first_[vertex + 1]; ++i) {
      // From pair to pair: the parent of a pair is a node in another pair, or the root. The pairs
      // above a dirty pair are dirty already.
      for (int node = leaf_[static_cast<std::size_t>(i)]; node > 0;) {
        const int left = node - (node % 2 == 0);  // left siblings are odd
        if (dirty.set(left)) break;
        node = parent_[static_cast<std::size_t>(left - 1) / 2];
      }
    }
  }

  /// Calls visit(slot) for every slot of a vertex (see VertexSlots), for some slots more than once.
  /// A vertex without a triangle has none.
  template <typename Visit>
  void forEachSlot(unsigned vertex, const Topology& topology, Visit&& visit) const {
    for (int i = first_[vertex]; i < first_[vertex + 1]; ++i) {
      const int leaf = topology.leafIndex(leaf_[static_cast<std::size_t>(i)]);
      for (unsigned slot : topology.slots.slotsOf(static_cast<std::size_t>(leaf)))
        if (topology.slots.vertices()[slot] == vertex) visit(slot);
    }
  }

  std::size_t bytes() const {
    return (parent_.capacity() + first_.capacity() + leaf_.capacity()) * sizeof(int);
  }

 private:
  std::vector<int> parent_;  ///< by number of a pair: its parent node
  std::vector<int> first_;   ///< by vertex, plus one element: beginning of its leaves in `leaf_`
  std::vector<int> leaf_;    ///< nodes; a leaf that has a vertex twice is listed twice
};

}  // namespace adaptive_bvh
