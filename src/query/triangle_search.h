#pragma once

#include <algorithm>
#include <memory>
#include <vector>

#include "base/interruption.h"
#include "base/leased.h"
#include "base/task_pool.h"
#include "boxes/wide_search.h"

// Searches for pairs of triangles of two trees, on one thread (TriangleSearch) or on several
// (searchAll). Results do not depend on the number of threads, and have the same order.
namespace adaptive_bvh {

/// A walk over two trees cut into kSize tasks. Each task is a range of pairs of nodes, in the order
/// in which one thread would visit them.
class WalkTasks {
 public:
  static constexpr int kSize = 512;

  /// Keeps a reference to `pairs`, the pairs of nodes to search below: at least kSize.
  explicit WalkTasks(const std::vector<NodePair>& pairs) : pairs_(pairs) {}

  int size() const { return kSize; }
  NodePairs operator[](int task) const {
    const auto beginOf = [&](int i) {
      return pairs_.data() + partBegin(static_cast<int>(pairs_.size()), kSize, i);
    };
    return {beginOf(task), beginOf(task + 1)};
  }

 private:
  const std::vector<NodePair>& pairs_;
};

/// A search on one thread: a walk over boxes finds pairs of leaves, for tests of their triangles.
///
///   Tests(sink, input...)           constructor; the tests pass their results to the sink
///   tests.begin(), tests.finish()   called before and after each walk
///   tests.foundLeaves(a, b, pairs)  called for two leaves, or twice the same leaf, whose triangles
///                                   `pairs` have overlapping boxes (LeavesFound)
///   tests.isDone()                  whether the search can stop
template <typename Tests>
class TriangleSearch final : private LeafSink {
 public:
  template <typename Sink, typename... Input>
  TriangleSearch(const WideTrees& trees, Sink& sink, const Input&... input)
      : tests_(sink, input...), walk_(trees) {}
  TriangleSearch(const TriangleSearch&) = delete;
  TriangleSearch& operator=(const TriangleSearch&) = delete;

  /// Tests all pairs of triangles at or below some pairs of nodes, until tests.isDone().
  void run(const NodePairs& from) {
    tests_.begin();
    if (!tests_.isDone()) walk_.run(from, *this);
    tests_.finish();
  }
  /// Tests all pairs of triangles of both trees, until tests.isDone().
  void runFromRoots() {
    const NodePair roots{0, 0};
    run({&roots, &roots + 1});
  }
  /// Expands the roots into at least WalkTasks::kSize pairs of nodes, in the order of a walk.
  /// Returns false if there are fewer, or the pool has one thread: then use runFromRoots.
  bool splitRoots(const TaskPool& pool, std::vector<NodePair>& pairs) {
    if (pool.size() == 1) return false;
    pairs.assign(1, {0, 0});
    walk_.split(pairs, WalkTasks::kSize, pool);
    return pairs.size() >= WalkTasks::kSize;
  }

 private:
  bool take(const LeavesFound* found, int count) override {
    constexpr unsigned kTakes = 1024;  // some milliseconds: up to 512 pairs each
    if (++takes_ % kTakes == 0) checkInterruption();
    for (int i = 0; i < count; ++i)
      tests_.foundLeaves(*found[i].first, *found[i].second, found[i].pairs);
    return tests_.isDone();
  }

  Tests tests_;
  WideSearch walk_;
  unsigned takes_ = 0;
};

/// Memory of a query's workers, one object for each slot of the pool. The calling thread keeps it.
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

/// Runs the tasks of a walk on a pool. Each slot of the pool has a worker, which appends the
/// results of its tasks to its own list. Each task records its range of that list, so that all
/// results can be joined in the order in which one thread would find them.
///
///   worker.run(pairs, task)  searches at or below the pairs of nodes of a task
///   worker.mark()            the number of the worker's results so far, a Worker::Mark
template <typename Worker>
class SearchTasks {
 public:
  /// The results of a task: the range [from, to) of its worker's results.
  struct Found {
    Worker* worker = nullptr;
    typename Worker::Mark from{}, to{};
  };

  /// makeWorker(slot), called on the worker's thread, returns a new worker in a std::unique_ptr.
  template <typename MakeWorker>
  void run(const TaskPool& pool, const WalkTasks& walks, const MakeWorker& makeWorker) {
    workers_.resize(static_cast<std::size_t>(pool.size()));
    found_.resize(static_cast<std::size_t>(walks.size()));
    pool.forEach(walks.size(), [&](int task, int slot) {
      const auto index = static_cast<std::size_t>(task);
      std::unique_ptr<Worker>& worker = workers_[static_cast<std::size_t>(slot)];
      if (!worker) worker = makeWorker(static_cast<std::size_t>(slot));
      found_[index].from = worker->mark();
      worker->run(walks[task], index);
      found_[index].to = worker->mark();
      found_[index].worker = worker.get();
    });
  }

  /// The results, by task. The workers, which hold them, live as long as this object.
  const std::vector<Found>& found() const { return found_; }

 private:
  std::vector<Found> found_;
  std::vector<std::unique_ptr<Worker>> workers_;  ///< by slot of the pool; null if unused
};

/// A worker of searchAll: a search whose sink is its own, so that no other thread writes to it.
template <typename Tests, typename Sink>
class SinkWorker {
 public:
  using Mark = typename Sink::Mark;

  template <typename... Input>
  SinkWorker(const WideTrees& trees, const Sink& query_sink, typename Sink::Result& memory,
             const Input&... input)
      : sink_(query_sink.another(memory)), search_(trees, sink_, input...) {
    sink_.clear();
  }

  Mark mark() const { return sink_.mark(); }
  void run(const NodePairs& pairs, std::size_t) { search_.run(pairs); }

  const Sink& sink() const { return sink_; }

 private:
  Sink sink_;
  TriangleSearch<Tests> search_;
};

/// Finds all results of a search, on up to `threads` threads, and writes them to `sink`. The sink's
/// earlier results are discarded. `input`: further arguments of Tests.
///
///   sink.clear()             discards its results
///   sink.another(result)     returns a sink for another thread, which writes to `result`
///   sink.mark()              the number of its results so far, a Sink::Mark
///   sink.take(tasks, pool)   replaces its results by those of `tasks`, a list of
///                            SearchTasks<SinkWorker>::Found, in their order
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
