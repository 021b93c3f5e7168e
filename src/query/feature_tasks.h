#pragma once

#include <algorithm>
#include <atomic>
#include <memory>
#include <new>
#include <vector>

#include "adaptive_bvh/feature_pairs.h"
#include "query/feature_search.h"
#include "threads/task_pool.h"

namespace adaptive_bvh {

/// One mesh twice, or two, with their swept boxes.
struct SweptPair {
  const MovingMesh& first;
  const SweptTree& tree1;
  const MovingMesh& second;
  const SweptTree& tree2;
};

/// Which nodes WideSearch has visited; not used here.
using VisitedMemory = std::vector<std::uint8_t>;

/// A walk of one thread over all pairs of features at or below some pairs of nodes.
template <bool kIsSelf, typename Visitor>
class FeatureWalk {
 public:
  FeatureWalk(const SweptPair& pair, Visitor& visitor, VisitedMemory (&memory)[2])
      : depth_(pair.first.depth + pair.second.depth),
        visited1_(memory[0], pair.tree1.size()),
        visited2_(memory[1], pair.tree2.size()),
        finder_(pair.first, pair.tree1, pair.second, pair.tree2, visitor),
        walk_(pair.tree1.nodes(), pair.tree2.nodes(), frame_, finder_, visited1_, visited2_) {}
  FeatureWalk(const FeatureWalk&) = delete;
  FeatureWalk& operator=(const FeatureWalk&) = delete;

  void run(const NodePair& from) { walk_.run(from, depth_); }
  void split(std::vector<NodePair>& pairs, std::size_t enough, const TaskPool& pool) {
    walk_.split(pairs, enough, pool);
  }

 private:
  const int depth_;
  const SameFrame<double> frame_{};
  VisitedNodes visited1_, visited2_;
  FeatureFinder<kIsSelf, Visitor> finder_;
  WideSearch<SameFrame<double>, kIsSelf, FeatureFinder<kIsSelf, Visitor>> walk_;
};

/// What a worker's visitor may keep between queries.
struct WorkerMemory {
  VisitedMemory visited[2];
  FeaturePairs pairs;
};

/// The walk cut into tasks, in the order in which one thread comes to them.
///
///   visitor.forWorker(pairs)    another visitor, of one thread; `pairs` is memory
///   visitor.begin()             before a thread runs tasks with it
///   visitor.finish()            after a task: what was found and not yet looked at
///   visitor.mark()              where it stands
///   visitor.take(tasks, pool)   takes over what the tasks found
template <bool kIsSelf, typename Visitor>
class FeatureTasks {
 public:
  static constexpr std::size_t kLeastTasks = 512;

  /// `memory`: of each worker.
  FeatureTasks(const SweptPair& pair, Visitor& visitor, const std::vector<NodePair>& tasks,
               std::vector<WorkerMemory>& memory)
      : pair_(pair), visitor_(visitor), tasks_(tasks), memory_(memory), found_(tasks.size()) {}

  /// Throws std::bad_alloc when memory ran out in a task.
  void run(const TaskPool& pool) {
    const auto workers = static_cast<std::size_t>(pool.size());
    workers_.resize(workers);
    memory_.resize(std::max(workers, memory_.size()));
    pool.forEach(static_cast<int>(tasks_.size()), [this](int task, int slot) {
      try {
        run(static_cast<std::size_t>(task), static_cast<std::size_t>(slot));
      } catch (const std::bad_alloc&) {
        out_of_memory_ = true;
      }
    });
    if (out_of_memory_) throw std::bad_alloc();
    visitor_.take(found_, pool);
  }

 private:
  struct Worker {
    Worker(const FeatureTasks& tasks, WorkerMemory& memory)
        : visitor(tasks.visitor_.forWorker(memory.pairs)),
          walk(tasks.pair_, visitor, memory.visited) {
      visitor.begin();
    }
    Visitor visitor;
    FeatureWalk<kIsSelf, Visitor> walk;
  };
  /// What one task found: some of a worker's.
  struct Found {
    Visitor* visitor = nullptr;
    typename Visitor::Mark from{}, to{};
  };

  void run(std::size_t task, std::size_t slot) {
    std::unique_ptr<Worker>& worker = workers_[slot];
    if (!worker) worker = std::make_unique<Worker>(*this, memory_[slot]);
    Found& found = found_[task];
    found.visitor = &worker->visitor;
    found.from = worker->visitor.mark();
    worker->walk.run(tasks_[task]);
    worker->visitor.finish();
    found.to = worker->visitor.mark();
  }

  const SweptPair& pair_;
  Visitor& visitor_;
  const std::vector<NodePair>& tasks_;
  std::vector<WorkerMemory>& memory_;
  std::vector<Found> found_;
  std::vector<std::unique_ptr<Worker>> workers_;
  std::atomic<bool> out_of_memory_{false};
};

/// That a calling thread keeps for those that help it.
inline std::vector<WorkerMemory>& workersMemory() {
  static thread_local std::vector<WorkerMemory> memory;
  return memory;
}

/// Lets the visitor see all pairs of features whose swept boxes overlap, on so many threads.
template <bool kIsSelf, typename Visitor>
void searchFeatures(const SweptPair& pair, Visitor& visitor, int threads) {
  static thread_local VisitedMemory memory[2];
  FeatureWalk<kIsSelf, Visitor> walk(pair, visitor, memory);
  const TaskPool pool(threads);
  if (pool.size() > 1) {
    std::vector<NodePair> tasks{{0, 0}};
    using Tasks = FeatureTasks<kIsSelf, Visitor>;
    walk.split(tasks, Tasks::kLeastTasks, pool);
    if (tasks.size() >= Tasks::kLeastTasks)
      return Tasks(pair, visitor, tasks, workersMemory()).run(pool);
    visitor.begin();
    for (const NodePair& task : tasks) walk.run(task);
  } else {
    visitor.begin();
    walk.run({0, 0});
  }
  visitor.finish();
}

}  // namespace adaptive_bvh
