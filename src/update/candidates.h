#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "update/fitness.h"

namespace adaptive_bvh {

/// The nodes that a criterion may call unfit after a propagation, which marks them while it has
/// their volumes at hand: one bit a node. What is marked is still to be judged. Off where only the
/// nodes that a query visited can be unfit: these are fewer.
class Candidates {
 public:
  using Word = std::uint64_t;
  static constexpr int kWord = 64;

  void reset(int nodes) { words_.assign(static_cast<std::size_t>(nodes) / kWord + 1, 0); }
  /// Before a propagation: none is marked.
  void restart(bool on) {
    on_ = on;
    if (on) std::fill(words_.begin(), words_.end(), Word(0));
  }
  bool isOn() const { return on_; }

  int words() const { return static_cast<int>(words_.size()); }
  /// Calls visit(node) for those in the words [first, last).
  template <typename Visit>
  void forEach(int first, int last, Visit&& visit) const {
    for (int w = first; w < last; ++w)
      for (Word word = words_[static_cast<std::size_t>(w)]; word != 0; word &= word - 1)
        visit(w * kWord + __builtin_ctzll(word) - 1);
  }

  /// Marks pairs of siblings in the order of a traversal. Several threads may use one each.
  class Marks {
   public:
    explicit Marks(Candidates& candidates) : words_(candidates.words_.data()) {}
    ~Marks() { flush(); }
    Marks(const Marks&) = delete;
    Marks& operator=(const Marks&) = delete;

    /// Of `left`, in the lowest bit, and of its sibling. With -1: of nothing, then of the root.
    ADAPTIVE_BVH_INLINE void mark(int left, Word which) {
      const int bit = left + 1;  // even: both are in one word
      if (bit / kWord != at_) {
        flush();
        at_ = bit / kWord;
      }
      word_ |= which << bit % kWord;
    }

   private:
    void flush() {
      if (word_ != 0) __atomic_fetch_or(words_ + at_, word_, __ATOMIC_RELAXED);
      word_ = 0;
    }

    Word* const words_;
    int at_ = 0;
    Word word_ = 0;
  };

  std::size_t bytes() const { return words_.capacity() * sizeof(Word); }

 private:
  std::vector<Word> words_;  // by node + 1
  bool on_ = false;
};

/// The inflation factor from which on a volume may be called unfit; that of no volume is below the
/// result when any may be.
inline double leastUnfitFactor(const RefitPolicy& policy) {
  constexpr double kAny = -std::numeric_limits<double>::infinity();
  const double p_max = policy.max_inflation,
               p_min = policy.min_inflation > 0 ? policy.min_inflation : kAny;
  switch (policy.criterion) {
    case FitnessCriterion::A:
    case FitnessCriterion::AB:
    case FitnessCriterion::ABC:
    case FitnessCriterion::AD: return p_max;
    case FitnessCriterion::BC:
    case FitnessCriterion::AOrBC:
    case FitnessCriterion::ABOrBC: return std::min(p_min, p_max);
    default: return kAny;
  }
}

}  // namespace adaptive_bvh
