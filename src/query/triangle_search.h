#pragma once

#include <algorithm>
#include <memory>
#include <vector>

#include "base/task_pool.h"
#include "boxes/wide_search.h"
#include "query/placed_mesh.h"

namespace adaptive_bvh {

/// The part of a query for pairs of triangles that runs on one thread: a walk over boxes, and the
/// tests of the pairs found. If both meshes of the input are one object, each pair is found once.
///
///   Tests                        made of (input, frame, output)
///   Tests::Input                 the meshes, first and second, and their trees, tree1 and tree2
///   Tests::boxFrame(input, frame)  how boxes of the second are compared with the first's
///   Tests::flat(input)           nodes to leave out, or null
///   tests.clear()                forgets the results of another query
///   tests.begin(), finish()      before and after a walk
///   tests.foundLeaves(a, b, pairs)  two leaves, or one twice, as LeavesFound
///   tests.isDone()               whether the answer is found
template <typename Tests>
class TriangleSearch final : private LeafSink {
 public:
  using Input = typename Tests::Input;

  /// `output` takes what is found.
  template <typename Frame, typename Output>
  TriangleSearch(const Input& input, const Frame& frame, Output& output)
      : tests_(input, frame, output),
        walk_({input.tree1.nodes(), input.tree2.nodes(), input.tree1.depth() + input.tree2.depth(),
               Tests::boxFrame(input, frame), &input.first == &input.second, Tests::flat(input)}) {}
  TriangleSearch(const TriangleSearch&) = delete;
  TriangleSearch& operator=(const TriangleSearch&) = delete;

  /// Forgets the results of another query.
  void clear() { tests_.clear(); }
  /// All pairs at or below some pairs of nodes, until there are enough.
  void run(const NodePairs& from) {
    tests_.begin();
    if (!tests_.isDone()) walk_.run(from, *this);
    tests_.finish();
  }
  void split(std::vector<NodePair>& pairs, std::size_t enough, const TaskPool& pool) {
    walk_.split(pairs, enough, pool);
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

/// A walk cut into tasks, each some pairs of nodes, in the order in which one thread comes to them.
class WalkTasks {
 public:
  static constexpr int kSize = 512;

  /// At least kSize.
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

/// Calls search.run for the roots, after search.clear(); or, on several threads, runTasks(walks)
/// for tasks that stand for these, where there are enough to be worth it: what they find takes the
/// place of the results.
template <typename Search, typename RunTasks>
void runFromRoots(Search& search, const TaskPool& pool, const RunTasks& runTasks) {
  const NodePair roots{0, 0};
  if (pool.size() > 1) {
    std::vector<NodePair> pairs{roots};
    search.split(pairs, WalkTasks::kSize, pool);
    if (pairs.size() >= WalkTasks::kSize) return runTasks(WalkTasks(pairs));
  }
  search.clear();
  search.run({&roots, &roots + 1});
}

/// What workers keep from query to query, by slot: the calling thread has it.
template <typename Memory>
std::vector<Memory>& workersMemory(const TaskPool& pool) {
  static thread_local std::vector<Memory> memory;
  memory.resize(std::max(static_cast<std::size_t>(pool.size()), memory.size()));
  return memory;
}

/// The tasks of a walk, run. Each thread has a worker, and notes which part of what it found is a
/// task's: so all can be put together in the order of one thread.
///
///   worker.run(pairs, task)  searches at or below some pairs of nodes
///   worker.mark()            how much it has found so far: a Worker::Mark
template <typename Worker>
class SearchTasks {
 public:
  /// What a task found: some of a worker's.
  struct Found {
    Worker* worker = nullptr;
    typename Worker::Mark from{}, to{};
  };

  /// makeWorker(slot) returns a new worker in a std::unique_ptr, on its thread.
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

  /// By task.
  const std::vector<Found>& found() const { return found_; }

 private:
  std::vector<Found> found_;
  std::vector<std::unique_ptr<Worker>> workers_;
};

}  // namespace adaptive_bvh
