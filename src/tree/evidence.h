#pragma once

#include <atomic>
#include <limits>
#include <memory>

#include "adaptive_bvh/update_report.h"

namespace adaptive_bvh {

/// What recording queries saw of a tree since its last update: which nodes they went below (test B)
/// and, for test C, how much farther off than the node both its children lay.
///
/// Test C asks for a visit with alpha > t and beta > t. Over all visits that is: the largest
/// min(alpha, beta) exceeds t. So one number a node is enough, and no query needs the policy.
/// Single precision will do: it decides about work, not about answers.
///
/// Queries hold the model const and run on many threads: marks are relaxed atomic maxima, so their
/// order does not matter and no lock is taken. Reading and clearing belong to the update, which the
/// caller keeps apart from queries.
class Evidence {
 public:
  Evidence() = default;
  Evidence(const Evidence& other) { *this = other; }
  Evidence& operator=(const Evidence& other) {
    reset(other.size_);
    for (int i = 0; i < size_; ++i)
      gap_[i].store(other.gap_[i].load(std::memory_order_relaxed), std::memory_order_relaxed);
    setWork(other.work());
    return *this;
  }

  /// Room for `nodes` nodes, none visited.
  void reset(int nodes) {
    if (nodes != size_)
      gap_ = std::make_unique<std::atomic<float>[]>(static_cast<std::size_t>(nodes));
    size_ = nodes;
    clear();
  }

  void clear() {
    for (int i = 0; i < size_; ++i) gap_[i].store(notVisited(), std::memory_order_relaxed);
    setWork(QueryWork());
  }

  /// Forgets what was seen of a node.
  void clear(int node) { gap_[node].store(notVisited(), std::memory_order_relaxed); }
  void clearWork() { setWork(QueryWork()); }

  void addQuery(long bv_tests, long leaf_tests) {
    queries_.fetch_add(1, std::memory_order_relaxed);
    bv_tests_.fetch_add(bv_tests, std::memory_order_relaxed);
    leaf_tests_.fetch_add(leaf_tests, std::memory_order_relaxed);
  }
  void addVisit(int node) { raise(node, std::numeric_limits<float>::lowest()); }
  /// min(alpha, beta) of thesis 4.4.3. NaN (no parent distance known) is no evidence.
  template <typename S>
  void addChildGap(int node, S gap) {
    raise(node, static_cast<float>(gap));
  }

  /// Of recording queries since the last `clear`.
  QueryWork work() const {
    QueryWork work;
    work.queries = queries_.load(std::memory_order_relaxed);
    work.bv_tests = bv_tests_.load(std::memory_order_relaxed);
    work.leaf_tests = leaf_tests_.load(std::memory_order_relaxed);
    return work;
  }
  bool visited(int node) const { return childGap(node) > notVisited(); }
  /// The largest min(alpha, beta); the lowest number when no visit had one.
  float childGap(int node) const { return gap_[node].load(std::memory_order_relaxed); }

  std::size_t bytes() const { return static_cast<std::size_t>(size_) * sizeof(gap_[0]); }

 private:
  void setWork(const QueryWork& work) {
    queries_.store(work.queries, std::memory_order_relaxed);
    bv_tests_.store(work.bv_tests, std::memory_order_relaxed);
    leaf_tests_.store(work.leaf_tests, std::memory_order_relaxed);
  }

  static constexpr float notVisited() { return -std::numeric_limits<float>::infinity(); }

  void raise(int node, float value) {
    std::atomic<float>& gap = gap_[node];
    float seen = gap.load(std::memory_order_relaxed);
    while (seen < value && !gap.compare_exchange_weak(seen, value, std::memory_order_relaxed)) {
    }
  }

  int size_ = 0;
  std::unique_ptr<std::atomic<float>[]> gap_;
  std::atomic<int> queries_{0};
  std::atomic<long> bv_tests_{0}, leaf_tests_{0};
};

}  // namespace adaptive_bvh
