#pragma once

#include <cstdint>
#include <vector>

namespace adaptive_bvh {

/// Dirty flags of pairs of siblings (2k+1, 2k+2), given by their left one: what a step of a few
/// vertices has to visit.
class DirtyPairs {
 public:
  /// Room for so many pairs, none dirty.
  void reset(std::size_t pairs) { words_.assign(pairs / 64 + 1, 0); }

  bool isDirty(int left) const { return (words_[wordOf(left)] & bitOf(left)) != 0; }
  /// Returns whether it was dirty already.
  bool set(int left) {
    std::uint64_t& word = words_[wordOf(left)];
    const bool was_dirty = (word & bitOf(left)) != 0;
    word |= bitOf(left);
    return was_dirty;
  }
  void unset(int left) { words_[wordOf(left)] &= ~bitOf(left); }

  /// The left sibling of the last dirty pair before the pair of `left`; -1 when there is none.
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

  std::vector<std::uint64_t> words_;  // a bit for each pair
};

}  // namespace adaptive_bvh
