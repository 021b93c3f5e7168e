#pragma once

#include <algorithm>

#include "adaptive_bvh/feature_pairs.h"
#include "geometry/scratch.h"
#include "query/append_pair.h"
#include "query/moving_mesh.h"
#include "threads/task_pool.h"

namespace adaptive_bvh {

/// A visitor of FeatureFinder that lists all pairs, by the numbers of their features.
template <bool kIsSelf>
class FeatureLists {
 public:
  FeatureLists(const MovingMesh& first, const MovingMesh& second, FeaturePairs& pairs)
      : first_(first), second_(second), pairs_(pairs) {}

  void begin() { pairs_.clear(); }

  ADAPTIVE_BVH_INLINE void vertexFace(unsigned v, unsigned t) {
    appendPair(vertex(first_, v), triangle(second_, t), pairs_.vertex_face);
  }
  ADAPTIVE_BVH_INLINE void faceVertex(unsigned t, unsigned v) {
    if (kIsSelf)
      appendPair(vertex(second_, v), triangle(first_, t), pairs_.vertex_face);
    else
      appendPair(triangle(first_, t), vertex(second_, v), pairs_.face_vertex);
  }
  ADAPTIVE_BVH_INLINE void edgeEdge(unsigned e, unsigned f) {
    const unsigned a = first_.features->edges()[e].number, b = second_.features->edges()[f].number;
    const bool swaps = kIsSelf && b < a;
    appendPair(swaps ? b : a, swaps ? a : b, pairs_.edge_edge);
  }
  void finish() {}

  /// How many there are of each kind.
  using Mark = std::array<std::size_t, 3>;
  Mark mark() const {
    return {pairs_.vertex_face.size(), pairs_.face_vertex.size(), pairs_.edge_edge.size()};
  }
  /// Lists apart, in memory that is kept in `memory`.
  FeatureLists forWorker(FeaturePairs& memory) const {
    return FeatureLists(first_, second_, memory);
  }
  /// Takes over what tasks found, in their order; `Found` has a worker, and marks from and to.
  template <typename Found>
  void take(const std::vector<Found>& tasks, const TaskPool& pool) {
    takeKind(
        0, pairs_.vertex_face, tasks, pool,
        [](FeatureLists & f) -> auto& { return f.pairs_.vertex_face; });
    takeKind(
        1, pairs_.face_vertex, tasks, pool,
        [](FeatureLists & f) -> auto& { return f.pairs_.face_vertex; });
    takeKind(
        2, pairs_.edge_edge, tasks, pool,
        [](FeatureLists & f) -> auto& { return f.pairs_.edge_edge; });
  }

 private:
  template <typename Found, typename Of>
  static void takeKind(std::size_t kind, std::vector<FeaturePair>& to,
                       const std::vector<Found>& tasks, const TaskPool& pool, const Of& of) {
    Scratch<std::size_t> begins(1, 0);
    for (const Found& task : tasks)
      begins.push_back(begins.back() + task.to[kind] - task.from[kind]);
    to.resize(begins.back());
    pool.forEach(static_cast<int>(tasks.size()), [&](int task, int) {
      const auto i = static_cast<std::size_t>(task);
      const FeaturePair* const from = of(*tasks[i].worker).data();
      std::copy(from + tasks[i].from[kind], from + tasks[i].to[kind], to.data() + begins[i]);
    });
  }
  static unsigned vertex(const MovingMesh& mesh, unsigned v) {
    return mesh.features->vertices()[v].vertex;
  }
  static unsigned triangle(const MovingMesh& mesh, unsigned place) {
    return (*mesh.owners)[place].triangle;
  }

  const MovingMesh &first_, &second_;
  FeaturePairs& pairs_;
};

}  // namespace adaptive_bvh
