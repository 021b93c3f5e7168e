#pragma once

#include <memory>
#include <vector>

#include "query/wide_search.h"
#include "query/within_tests.h"
#include "threads/task_pool.h"

namespace adaptive_bvh {

/// What one thread does of a query for near pairs: a walk over grown boxes, the tests of what it
/// finds, and a record of both.
template <bool kIsSelf, typename BV, typename Frame, typename Sink>
class WithinSearch {
 public:
  /// Of VisitedNodes.
  using Memory = std::vector<std::uint8_t>[2];

  WithinSearch(const WithinInput<BV>& input, const Frame& frame, Sink& sink, Memory& memory)
      : input_(input),
        grown_(frame, input.distance * input.tree1.scale()),
        visited1_(memory[0], input.tree1.size()),
        visited2_(memory[1], kIsSelf ? 0 : input.tree2.size()),
        tests_(input, frame, sink),
        walk_(input.tree1.nodes(), input.tree2.nodes(), grown_, tests_, visited1_,
              kIsSelf ? visited1_ : visited2_) {}
  WithinSearch(const WithinSearch&) = delete;
  WithinSearch& operator=(const WithinSearch&) = delete;

  /// All near pairs at or below a pair of nodes, until the sink has enough.
  void run(const NodePair& from) {
    walk_.run(from, input_.tree1.depth() + input_.tree2.depth());
    tests_.finish();
  }
  void split(std::vector<NodePair>& pairs, std::size_t enough, const TaskPool& pool) {
    walk_.split(pairs, enough, pool);
  }

  /// Takes over the record of another search of this query.
  void add(const WithinSearch& other) {
    visited1_.add(other.visited1_);
    visited2_.add(other.visited2_);
    box_tests_ += other.walk_.boxTests();
    candidates_ += other.tests_.candidates();
    leaf_tests_ += other.tests_.exactTests();
  }
  /// In both models.
  void record(const TaskPool& pool) const {
    visited1_.record(input_.tree1.nodes(), input_.first.visits(), pool);
    visited2_.record(input_.tree2.nodes(), input_.second.visits(), pool);
    QueryWork work;
    work.box_tests = walk_.boxTests() + box_tests_;
    work.candidates = tests_.candidates() + candidates_;
    work.leaf_tests = tests_.exactTests() + leaf_tests_;
    statisticsOf(input_.first, input_.second).recordQuery(work);
  }

 private:
  using Grown = GrownFrame<Frame>;
  using Tests = WithinTests<BV, Frame, Sink>;

  const WithinInput<BV>& input_;
  const Grown grown_;
  VisitedNodes visited1_, visited2_;
  Tests tests_;
  WideSearch<Grown, kIsSelf, Tests> walk_;
  long box_tests_ = 0, candidates_ = 0, leaf_tests_ = 0;  ///< of other searches
};

/// The same query on several threads. The walk is cut into many tasks, in the order in which one
/// thread comes to them; what each task finds is put together in that order.
template <bool kIsSelf, typename BV, typename Frame, typename Sink>
class WithinTasks {
 public:
  using Search = WithinSearch<kIsSelf, BV, Frame, Sink>;

  /// A search of fewer pairs of nodes is not worth threads.
  static constexpr std::size_t kLeastTasks = 512;

  WithinTasks(const WithinInput<BV>& input, const Frame& frame, const Sink& sink)
      : input_(input), frame_(frame), sink_(sink) {}

  /// Throws std::bad_alloc when memory ran out in a task.
  void run(const TaskPool& pool, const std::vector<NodePair>& tasks) {
    workers_.resize(static_cast<std::size_t>(pool.size()));
    found_.resize(tasks.size());
    std::atomic<bool> out_of_memory{false};
    pool.forEach(static_cast<int>(tasks.size()), [&](int task, int slot) {
      const auto at = static_cast<std::size_t>(task);
      try {
        run(tasks[at], workers_[static_cast<std::size_t>(slot)], found_[at]);
      } catch (const std::bad_alloc&) {
        out_of_memory = true;
      }
    });
    if (out_of_memory) throw std::bad_alloc();
  }

  /// Adds all that was found to the query's sink, and the record of all threads to `search`.
  void collect(Sink& sink, Search& search) const {
    for (const Found& found : found_) sink.append(found.worker->sink, found.begin, found.end);
    for (const auto& worker : workers_)
      if (worker) search.add(worker->search);
  }

 private:
  struct Worker {
    explicit Worker(const WithinTasks& t)
        : sink(t.sink_.another(own)), search(t.input_, t.frame_, sink, memory) {}
    typename Search::Memory memory;
    typename Sink::Result own;
    Sink sink;
    Search search;
  };
  /// What a task found: some of a worker's.
  struct Found {
    const Worker* worker = nullptr;
    typename Sink::Mark begin = {}, end = {};
  };

  void run(const NodePair& task, std::unique_ptr<Worker>& worker, Found& found) {
    if (!worker) worker = std::make_unique<Worker>(*this);
    const auto begin = Sink::markOf(worker->own);
    worker->search.run(task);
    found = {worker.get(), begin, Sink::markOf(worker->own)};
  }

  const WithinInput<BV>& input_;
  const Frame& frame_;
  const Sink& sink_;
  std::vector<Found> found_;  ///< by task
  std::vector<std::unique_ptr<Worker>> workers_;
};

}  // namespace adaptive_bvh
