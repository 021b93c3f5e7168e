#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

#include "adaptive_bvh/refit_policy.h"
#include "base/pack.h"
#include "volumes/traversal_statistics.h"

namespace adaptive_bvh {

/// All that the fitness tests look at, for one node.
struct NodeFitness {
  double inflation;  ///< R' - R: radius now less that when last refitted
  double reference;  ///< the length an inflation is compared with (InflationReference)
  bool visited;      ///< a recording query went below the node since the last update
  double child_gap;  ///< largest min(alpha, beta) of those visits; -infinity when none
  /// One of those queries tested the volume, whose inflation may have been in the way.
  bool obstructing = false;
};

/// (R' - R) / reference: the inflation factor, 4.4.1. Zero when nothing grew, whatever the
/// reference; the largest finite number when the reference is zero: a volume without any extent
/// that moved. The leaf radius may lie below the original by rounding: that is no inflation.
inline double inflationFactor(const NodeFitness& node) {
  if (node.inflation <= 0) return 0;
  return std::min(node.inflation / node.reference, std::numeric_limits<double>::max());
}

/// Test A, inflation factor (4.4.1).
inline bool testA(const NodeFitness& node, const RefitPolicy& policy) {
  return inflationFactor(node) > policy.max_inflation;
}

/// Test B, recent traversal (4.4.2).
inline bool testB(const NodeFitness& node) { return node.visited; }

/// Test C, child node distances (4.4.3). The factor is compared by >=, as in the thesis.
inline bool testC(const NodeFitness& node, const RefitPolicy& policy) {
  return inflationFactor(node) >= policy.min_inflation &&
         node.child_gap > policy.child_distance_ratio * node.inflation;
}

/// Test D, obstruction (FitnessCriterion).
inline bool testD(const NodeFitness& node) { return node.obstructing; }

/// True when the criterion calls no volume unfit that was not visited.
inline bool needsVisit(FitnessCriterion criterion) {
  switch (criterion) {
    case FitnessCriterion::A:
    case FitnessCriterion::AOrBC:
    case FitnessCriterion::RefitAll: return false;
    default: return true;
  }
}

/// True when, after what queries have recorded, a volume that was not visited is not unfit.
inline bool onlyVisitedAreUnfit(const TraversalStatistics& seen, const RefitPolicy& policy) {
  return seen.work().queries > 0 && needsVisit(policy.criterion);
}

/// The criterion (thesis 4.5): true when the volume is to be recomputed.
inline bool isUnfit(const NodeFitness& node, const RefitPolicy& policy) {
  const auto a = [&] { return testA(node, policy); };
  const auto b = [&] { return testB(node); };
  const auto c = [&] { return testC(node, policy); };
  switch (policy.criterion) {
    case FitnessCriterion::A: return a();
    case FitnessCriterion::B: return b();
    case FitnessCriterion::AB: return b() && a();
    case FitnessCriterion::BC: return b() && c();
    case FitnessCriterion::ABC: return b() && a() && c();
    case FitnessCriterion::AOrBC: return a() || (b() && c());
    case FitnessCriterion::ABOrBC: return b() && (a() || c());  // (A and B) or (B and C)
    case FitnessCriterion::RefitAll: return true;
    case FitnessCriterion::RefitNone: return false;
    case FitnessCriterion::AD: return testD(node) && a();
  }
  return true;
}

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

    /// Marks `left`, by the lowest bit, and its sibling. With -1 the second bit marks the root.
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
