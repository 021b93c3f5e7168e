#pragma once

#include <memory>
#include <vector>

#include "adaptive_bvh/feature_pairs.h"
#include "query/feature_search.h"
#include "query/search_tasks.h"

namespace adaptive_bvh {

/// One mesh twice, or two, with their swept boxes.
struct SweptPair {
  const MovingMesh& first;
  const SweptTree& tree1;
  const MovingMesh& second;
  const SweptTree& tree2;
};

/// A walk of one thread over all pairs of features at or below some pairs of nodes.
template <bool kIsSelf, typename Visitor>
class FeatureWalk {
 public:
  FeatureWalk(const SweptPair& pair, Visitor& visitor)
      : finder_(pair.first, pair.tree1, pair.second, pair.tree2, visitor),
        walk_({pair.tree1.nodes(), pair.tree2.nodes(), pair.first.depth + pair.second.depth,
               BoxFrame(nullptr, 0), kIsSelf}),
        visitor_(visitor) {}
  FeatureWalk(const FeatureWalk&) = delete;
  FeatureWalk& operator=(const FeatureWalk&) = delete;

  void clear() { visitor_.clear(); }
  void run(const NodePairs& from) { walk_.run(from, finder_); }
  void split(std::vector<NodePair>& pairs, std::size_t enough, const TaskPool& pool) {
    walk_.split(pairs, enough, pool);
  }

 private:
  FeatureFinder<kIsSelf, Visitor> finder_;
  WideSearch walk_;
  Visitor& visitor_;
};

/// One thread's worker (SearchTasks): a visitor of its own, and its walk.
///
///   visitor.forWorker(pairs)    another visitor, of one thread; `pairs` is memory
///   visitor.clear()             forgets the results of another query
///   visitor.finish()            after a task: what was found and not yet looked at
///   visitor.mark()              where it stands
///   visitor.take(found, pool)   its results become what tasks found
template <bool kIsSelf, typename Visitor>
class FeatureWorker : public Visitor {
 public:
  FeatureWorker(const SweptPair& pair, const Visitor& visitor, FeaturePairs& memory)
      : Visitor(visitor.forWorker(memory)), walk_(pair, *this) {
    this->clear();
  }
  void run(const NodePairs& pairs, std::size_t) {
    walk_.run(pairs);
    this->finish();
  }

 private:
  FeatureWalk<kIsSelf, Visitor> walk_;
};

/// Lets the visitor see all pairs of features whose swept boxes overlap, on so many threads.
template <bool kIsSelf, typename Visitor>
void searchFeatures(const SweptPair& pair, Visitor& visitor, int threads) {
  FeatureWalk<kIsSelf, Visitor> walk(pair, visitor);
  const TaskPool pool(threads);
  runFromRoots(walk, pool, [&](const WalkTasks& walks) {
    using Worker = FeatureWorker<kIsSelf, Visitor>;
    std::vector<FeaturePairs>& memory = workersMemory<FeaturePairs>(pool);
    SearchTasks<Worker> tasks;
    tasks.run(pool, walks, [&](std::size_t slot) {
      return std::make_unique<Worker>(pair, visitor, memory[slot]);
    });
    visitor.take(tasks.found(), pool);
  });
  visitor.finish();
}

}  // namespace adaptive_bvh
