#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace adaptive_bvh {

/// Finds duplicates among the vertex indices that the user lists for an update of some vertices. If
/// a vertex is listed more than once, its last position counts, and its displacement is measured
/// from the position before the update.
class NamedVertices {
 public:
  /// Allocates memory for this number of vertices.
  void reserve(std::size_t vertices) { words_.resize((vertices + 63) / 64); }

  /// Calls visit(i) once for each listed vertex, where i is the last index at which indices[i] is
  /// this vertex. `visit` may throw.
  template <typename Visit>
  void forEachLast(const unsigned* indices, std::size_t count, const Visit& visit) {
    const ClearAtEnd clear_at_end{*this, indices, count};
    for (std::size_t i = count; i-- > 0;)
      if (mark(indices[i])) visit(i);
  }

  std::size_t bytes() const { return words_.capacity() * sizeof(words_[0]); }

 private:
  /// Clears the marks of the listed vertices at the end of forEachLast, also if `visit` throws.
  struct ClearAtEnd {
    NamedVertices& owner;
    const unsigned* const indices;
    const std::size_t count;
    ~ClearAtEnd() {
      for (std::size_t i = 0; i < count; ++i) owner.words_[indices[i] / 64] = 0;
    }
  };
  /// Marks a vertex. Returns whether it was not marked before.
  bool mark(unsigned vertex) {
    std::uint64_t& word = words_[vertex / 64];
    const std::uint64_t bit = std::uint64_t(1) << vertex % 64;
    const bool is_new = (word & bit) == 0;
    word |= bit;
    return is_new;
  }

  std::vector<std::uint64_t> words_;  ///< one bit for each vertex; all clear between updates
};

}  // namespace adaptive_bvh
