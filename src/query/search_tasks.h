#pragma once

#include <atomic>
#include <memory>
#include <new>
#include <vector>

#include "query/wide_search.h"
#include "threads/task_pool.h"

namespace adaptive_bvh {

/// Calls search.run for the roots; or, on several threads, runTasks(pairs) for pairs of nodes that
/// stand for these, where there are enough to be worth it.
template <typename Search, typename RunTasks>
void runFromRoots(Search& search, const TaskPool& pool, const RunTasks& runTasks) {
  constexpr std::size_t kEnough = 512;
  if (pool.size() == 1) return search.run({0, 0});
  std::vector<NodePair> pairs{{0, 0}};
  search.split(pairs, kEnough, pool);
  if (pairs.size() >= kEnough) return runTasks(pairs);
  for (const NodePair& pair : pairs) search.run(pair);
}

/// A walk cut into tasks, each a pair of nodes, in the order in which one thread comes to them.
/// Each thread has a worker, and notes which part of what it found is a task's: so all can be put
/// together in the order of one thread.
///
///   worker.run(pair, task)   searches at or below a pair of nodes
///   worker.mark()            how much it has found so far: a Worker::Mark
template <typename Worker>
class SearchTasks {
 public:
  /// What a task found: some of a worker's.
  struct Found {
    Worker* worker = nullptr;
    typename Worker::Mark from{}, to{};
  };

  /// makeWorker(slot) returns a new worker in a std::unique_ptr, on its thread. Throws
  /// std::bad_alloc when memory ran out in a task.
  template <typename MakeWorker>
  void run(const TaskPool& pool, const std::vector<NodePair>& tasks, const MakeWorker& makeWorker) {
    workers_.resize(static_cast<std::size_t>(pool.size()));
    found_.resize(tasks.size());
    std::atomic<bool> out_of_memory{false};
    pool.forEach(static_cast<int>(tasks.size()), [&](int task, int slot) {
      const auto at = static_cast<std::size_t>(task);
      std::unique_ptr<Worker>& worker = workers_[static_cast<std::size_t>(slot)];
      try {
        if (!worker) worker = makeWorker(static_cast<std::size_t>(slot));
        found_[at].from = worker->mark();
        worker->run(tasks[at], at);
        found_[at].to = worker->mark();
        found_[at].worker = worker.get();
      } catch (const std::bad_alloc&) {
        out_of_memory = true;
      }
    });
    if (out_of_memory) throw std::bad_alloc();
  }

  /// By task.
  const std::vector<Found>& found() const { return found_; }
  /// Those that were made.
  template <typename Do>
  void forEachWorker(Do&& act) const {
    for (const auto& worker : workers_)
      if (worker) act(*worker);
  }

 private:
  std::vector<Found> found_;
  std::vector<std::unique_ptr<Worker>> workers_;
};

}  // namespace adaptive_bvh
