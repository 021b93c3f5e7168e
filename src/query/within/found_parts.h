#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "adaptive_bvh/feature_pairs.h"
#include "base/pack.h"
#include "base/scratch.h"
#include "base/task_pool.h"

// Long lists of found pairs: fast appending, and joining the parts of several threads.
namespace adaptive_bvh {

/// Enlarges the capacity fourfold: copying pairs costs more than memory that is never touched.
[[gnu::noinline]] inline void growPairs(std::vector<FeaturePair>& pairs) {
  constexpr std::size_t kFirst = 256;
  pairs.reserve(4 * pairs.capacity() + kFirst);
}

/// Appends a pair, for searches that find millions of them. Growth is a separate function, so that
/// a pair costs little more than writing it. Writes both numbers in place, because copying
/// as a whole a pair that was just written in parts stalls the processor.
ADAPTIVE_BVH_INLINE void appendPair(unsigned first, unsigned second,
                                    std::vector<FeaturePair>& pairs) {
  if (pairs.size() == pairs.capacity()) growPairs(pairs);
  FeaturePair& pair = pairs.emplace_back();
  pair.first = first;
  pair.second = second;
}

/// A range of a vector.
template <typename T>
struct VectorPart {
  VectorPart(const std::vector<T>& of, std::size_t from, std::size_t to)
      : begin(of.data() + from), end(of.data() + to) {}

  const T *begin, *end;
};

/// Sets `to` to the results of tasks, in their order. partOf(task): the VectorPart of a task. Does
/// not clear `to`, because resizing a cleared vector writes zeros to all of it, on one thread.
template <typename T, typename Found, typename PartOf>
void joinParts(const std::vector<Found>& tasks, const TaskPool& pool, std::vector<T>& to,
               const PartOf& partOf) {
  Scratch<std::size_t> begins(1, 0);  // where the results of each task begin in `to`; their number
  for (const Found& task : tasks) {
    const VectorPart<T> part = partOf(task);
    begins.push_back(begins.back() + static_cast<std::size_t>(part.end - part.begin));
  }
  // Reserves twice as much: while bodies approach, more pairs are near at each step.
  if (begins.back() > to.capacity()) {
    to.clear();
    to.reserve(2 * begins.back());
  }
  to.resize(begins.back());
  pool.forEach(static_cast<int>(tasks.size()), [&](int task, int) {
    const auto i = static_cast<std::size_t>(task);
    const VectorPart<T> part = partOf(tasks[i]);
    std::copy(part.begin, part.end, to.data() + begins[i]);
  });
}

/// Numbers of pairs of each kind: the Mark of a sink of FeaturePairs (SearchTasks).
using FeatureMark = std::array<std::size_t, 3>;
inline FeatureMark markOf(const FeaturePairs& pairs) {
  return {pairs.vertex_face.size(), pairs.face_vertex.size(), pairs.edge_edge.size()};
}
/// Like joinParts, for pairs of all kinds: pairsOf(task) returns all pairs of the task's worker.
template <typename Found, typename PairsOf>
void joinFeatures(const std::vector<Found>& tasks, const TaskPool& pool, FeaturePairs& to,
                  const PairsOf& pairsOf) {
  constexpr std::vector<FeaturePair> FeaturePairs::*kKinds[] = {
      &FeaturePairs::vertex_face, &FeaturePairs::face_vertex, &FeaturePairs::edge_edge};
  for (std::size_t k = 0; k < 3; ++k)
    joinParts(tasks, pool, to.*kKinds[k], [&](const Found& task) -> VectorPart<FeaturePair> {
      return {pairsOf(task).*kKinds[k], task.from[k], task.to[k]};
    });
}

}  // namespace adaptive_bvh
