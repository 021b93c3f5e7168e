#pragma once

#include <algorithm>
#include <memory>
#include <vector>

#include "base/leased.h"
#include "base/task_pool.h"
#include "boxes/wide_search.h"

namespace adaptive_bvh {

/// A walk cut into tasks. Each task is a range of pairs of nodes, in the order in which one thread
/// would visit them.
class WalkTasks {
 public:
  static constexpr int kSize = 512;

  /// `pairs`: at least kSize.
  explicit WalkTasks(const std::vector<NodePair>& pairs) : pairs_(pairs) {}

  int size() const { return kSize; }
  NodePairs operator[](int task) const {
    const auto at = [&](int i) {
      return pairs_.data() + partBegin(static_cast<int>(pairs_.size()), kSize, i);
    };
    return {at(task), at(task + 1)};
  }

 private:
  const std::vector<NodePair>& pairs_;
};

/// The part of a query for pairs of triangles that runs on one thread: a walk over boxes, and the
/// tests of the pairs found.
///
///   Tests                        constructed from (sink, input...); the sink takes the results
///   tests.begin(), finish()      before and after a walk
///   tests.foundLeaves(a, b, pairs)  two leaves, or one twice, as LeavesFound
///   tests.isDone()               whether the answer is found
template <typename Tests>
class TriangleSearch final : private LeafSink {
 public:
  template <typename Sink, typename... Input>
  TriangleSearch(const WideTrees& trees, Sink& sink, const Input&... input)
      : tests_(sink, input...), walk_(trees) {}
  TriangleSearch(const TriangleSearch&) = delete;
  TriangleSearch& operator=(const TriangleSearch&) = delete;

  /// Tests all pairs at or below some pairs of nodes, until tests.isDone().
  void run(const NodePairs& from) {
    tests_.begin();
    if (!tests_.isDone()) walk_.run(from, *this);
    tests_.finish();
  }
  void runFromRoots() {
    const NodePair roots{0, 0};
    run({&roots, &roots + 1});
  }
  /// Replaces the roots by at least WalkTasks::kSize pairs of nodes. Returns false if one thread
  /// should run from the roots: the pool has only one, or there are too few pairs.
  bool splitRoots(const TaskPool& pool, std::vector<NodePair>& pairs) {
    if (pool.size() == 1) return false;
    pairs.assign(1, {0, 0});
    walk_.split(pairs, WalkTasks::kSize, pool);
    return pairs.size() >= WalkTasks::kSize;
  }

 private:
  bool take(const LeavesFound* found, int count) override {
    for (int i = 0; i < count; ++i)
      tests_.foundLeaves(*found[i].first, *found[i].second, found[i].pairs);
    return tests_.isDone();
  }

  Tests tests_;
  WideSearch walk_;
};

/// Memory of the workers, kept from query to query; one for each slot of the pool.
template <typename Memory>
class WorkersMemory {
 public:
  explicit WorkersMemory(const TaskPool& pool) {
    memory_->resize(std::max(static_cast<std::size_t>(pool.size()), memory_->size()));
  }

  Memory& operator[](std::size_t slot) const { return (*memory_)[slot]; }

 private:
  const Leased<std::vector<Memory>> memory_;
};

/// Runs the tasks of a walk. Each thread has a worker, and each task records its range of the
/// worker's results, so that all results can be joined in the order of one thread.
///
///   worker.run(pairs, task)  searches at or below some pairs of nodes
///   worker.mark()            number of its results so far: a Worker::Mark
template <typename Worker>
class SearchTasks {
 public:
  /// The results of a task: a range of its worker's.
  struct Found {
    Worker* worker = nullptr;
    typename Worker::Mark from{}, to{};
  };

  /// makeWorker(slot) returns a new worker in a std::unique_ptr, and is called on the worker's
  /// thread.
  template <typename MakeWorker>
  void run(const TaskPool& pool, const WalkTasks& walks, const MakeWorker& makeWorker) {
    workers_.resize(static_cast<std::size_t>(pool.size()));
    found_.resize(static_cast<std::size_t>(walks.size()));
    pool.forEach(walks.size(), [&](int task, int slot) {
      const auto at = static_cast<std::size_t>(task);
      std::unique_ptr<Worker>& worker = workers_[static_cast<std::size_t>(slot)];
      if (!worker) worker = makeWorker(static_cast<std::size_t>(slot));
      found_[at].from = worker->mark();
      worker->run(walks[task], at);
      found_[at].to = worker->mark();
      found_[at].worker = worker.get();
    });
  }

  /// Results, by task.
  const std::vector<Found>& found() const { return found_; }

 private:
  std::vector<Found> found_;
  std::vector<std::unique_ptr<Worker>> workers_;
};

/// A worker of searchAll on one thread, with its own sink.
template <typename Tests, typename Sink>
class SinkWorker {
 public:
  using Mark = typename Sink::Mark;

  template <typename... Input>
  SinkWorker(const WideTrees& trees, const Sink& of_query, typename Sink::Result& memory,
             const Input&... input)
      : sink_(of_query.another(memory)), search_(trees, sink_, input...) {
    sink_.clear();
  }

  Mark mark() const { return sink_.mark(); }
  void run(const NodePairs& pairs, std::size_t) { search_.run(pairs); }

  const Sink& sink() const { return sink_; }

 private:
  Sink sink_;
  TriangleSearch<Tests> search_;
};

/// Searches for everything that a sink takes, on `threads` threads. The sink's earlier results are
/// discarded.
///
///   sink.clear()             discards the results of an earlier query
///   sink.another(result)     returns a sink for another thread, which keeps `result`
///   sink.mark(), Sink::Mark  number of results so far
///   sink.take(tasks, pool)   replaces its results by those of the SinkWorkers' sinks in the tasks
///                            (SearchTasks::Found), in the order of the tasks
template <typename Tests, typename Sink, typename... Input>
void searchAll(int threads, const WideTrees& trees, Sink& sink, const Input&... input) {
  using Worker = SinkWorker<Tests, Sink>;
  TriangleSearch<Tests> search(trees, sink, input...);
  const TaskPool pool(threads);
  std::vector<NodePair> pairs;
  if (!search.splitRoots(pool, pairs)) {
    sink.clear();
    return search.runFromRoots();
  }
  const WorkersMemory<typename Sink::Result> memory(pool);
  SearchTasks<Worker> tasks;
  tasks.run(pool, WalkTasks(pairs), [&](std::size_t slot) {
    return std::make_unique<Worker>(trees, sink, memory[slot], input...);
  });
  sink.take(tasks.found(), pool);
}

}  // namespace adaptive_bvh
