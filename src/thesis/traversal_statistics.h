#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>

#include "adaptive_bvh/update_report.h"

namespace adaptive_bvh {

/// Records, for the fitness tests (refit.h), what queries did in a tree since its last update. For
/// each node:
/// - visited (test B): a query went below it, or tested its triangle;
/// - child gap (test C): how much farther away both its children were than the node itself. Test C
///   requires a visit with alpha > t and beta > t, which means that the largest min(alpha, beta)
///   over all visits exceeds t. So one number per node suffices, and queries do not need the
///   policy. Ten bits of mantissa suffice, because it affects only the amount of work, not results.
///
/// All this is packed in one word per node, with the epoch in which it was written. An update
/// clears all words at once by starting a new epoch.
///
/// Queries access the model as const on many threads. They only increase parts of words, by relaxed
/// atomic operations, so their order does not matter and no lock is needed. The update reads and
/// clears the words; the caller must not run it concurrently with queries.
class TraversalStatistics {
 public:
  TraversalStatistics() = default;
  TraversalStatistics(const TraversalStatistics& other) { *this = other; }
  TraversalStatistics& operator=(const TraversalStatistics& other) {
    reset(other.size_);
    epoch_ = other.epoch_;
    for (int i = 0; i < size_; ++i)
      words_[i].store(other.words_[i].load(std::memory_order_relaxed), std::memory_order_relaxed);
    setWork(other.work());
    return *this;
  }

  /// Allocates `nodes` nodes, none visited.
  void reset(int nodes) {
    if (nodes != size_)
      words_ = std::make_unique<std::atomic<Word>[]>(static_cast<std::size_t>(nodes));
    size_ = nodes;
    epoch_ = kEpochs;
    clear();
  }

  /// Clears all visits and the counted work.
  void clear() {
    if (++epoch_ > kEpochs) {
      for (int i = 0; i < size_; ++i) words_[i].store(0, std::memory_order_relaxed);
      epoch_ = 1;
    }
    setWork(QueryWork());
  }

  /// Counts a query.
  void recordQuery(const QueryWork& work) {
    queries_.fetch_add(1, std::memory_order_relaxed);
    box_tests_.fetch_add(work.box_tests, std::memory_order_relaxed);
    bv_tests_.fetch_add(work.bv_tests, std::memory_order_relaxed);
    leaf_tests_.fetch_add(work.leaf_tests, std::memory_order_relaxed);
  }
  void recordVisit(int node) { raise(node, 0); }  ///< records a visit
  /// Records a visit and min(alpha, beta) of thesis 4.4.3. NaN (no parent distance) is ignored.
  template <typename S>
  void recordChildGap(int node, S gap) {
    raise(node, gapBits(static_cast<float>(gap)));
  }

  /// Returns the work of recording queries since the last `clear`.
  QueryWork work() const {
    QueryWork work;
    work.queries = queries_.load(std::memory_order_relaxed);
    work.box_tests = box_tests_.load(std::memory_order_relaxed);
    work.bv_tests = bv_tests_.load(std::memory_order_relaxed);
    work.leaf_tests = leaf_tests_.load(std::memory_order_relaxed);
    return work;
  }
  bool visited(int node) const { return currentWord(node) != 0; }
  /// The largest recorded min(alpha, beta), rounded down by less than one part in 1000; -infinity
  /// if no visit had one.
  float childGap(int node) const {
    const Word bits = currentWord(node) & kGapMask;
    return bits == 0 ? -std::numeric_limits<float>::infinity() : gapOf(bits);
  }

  std::size_t bytes() const { return static_cast<std::size_t>(size_) * sizeof(words_[0]); }

 private:
  /// Bit layout from the top: epoch (13 bits, never 0), child gap (19 bits).
  using Word = std::uint32_t;
  static constexpr int kGapBits = 19;
  static constexpr Word kGapMask = (Word(1) << kGapBits) - 1;
  static constexpr Word kEpochs = (Word(1) << (32 - kGapBits)) - 1;  ///< the last epoch

  /// The most significant bits of a number, encoded so that larger numbers have larger encodings:
  /// the sign bit is inverted, and all bits of a negative number. 0 for NaN, and only for NaN.
  static Word gapBits(float gap) {
    if (gap != gap) return 0;
    Word bits;
    std::memcpy(&bits, &gap, sizeof(bits));
    bits = bits >> 31 ? ~bits : bits | Word(1) << 31;
    return std::max(bits >> (32 - kGapBits), Word(1));
  }
  /// The number with this encoding, its lower bits 0 before they are decoded.
  static float gapOf(Word ordered) {
    ordered <<= 32 - kGapBits;
    const Word bits = ordered >> 31 ? ordered & ~(Word(1) << 31) : ~ordered;
    float gap;
    std::memcpy(&gap, &bits, sizeof(gap));
    return gap;
  }

  /// The word of a node that was visited since the last `clear`; 0 for other nodes.
  Word currentWord(int node) const {
    const Word word = words_[node].load(std::memory_order_relaxed);
    return word >> kGapBits == epoch_ ? word : 0;
  }

  /// Records a visit: keeps the larger child gap.
  void raise(int node, Word gap) {
    std::atomic<Word>& word = words_[node];
    Word old = word.load(std::memory_order_relaxed);
    for (;;) {
      const Word now = old >> kGapBits == epoch_ ? old : epoch_ << kGapBits;
      const Word next = std::max(now, (now & ~kGapMask) | gap);
      if (next == old || word.compare_exchange_weak(old, next, std::memory_order_relaxed)) return;
    }
  }

  void setWork(const QueryWork& work) {
    queries_.store(work.queries, std::memory_order_relaxed);
    box_tests_.store(work.box_tests, std::memory_order_relaxed);
    bv_tests_.store(work.bv_tests, std::memory_order_relaxed);
    leaf_tests_.store(work.leaf_tests, std::memory_order_relaxed);
  }

  int size_ = 0;  ///< number of nodes
  Word epoch_ = 1;
  std::unique_ptr<std::atomic<Word>[]> words_;  ///< by node
  std::atomic<int> queries_{0};
  std::atomic<long> box_tests_{0}, bv_tests_{0}, leaf_tests_{0};
};

/// The statistics of both objects of a query; null for an object that is not an adaptive model.
struct PairStatistics {
  TraversalStatistics* side[2] = {nullptr, nullptr};

  void recordQuery(const QueryWork& work) const {
    if (side[0]) side[0]->recordQuery(work);
    if (side[1] && side[1] != side[0]) side[1]->recordQuery(work);
  }
  void recordVisit(int b1, int b2) const {
    if (side[0]) side[0]->recordVisit(b1);
    if (side[1]) side[1]->recordVisit(b2);
  }
};

}  // namespace adaptive_bvh
