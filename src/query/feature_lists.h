#pragma once

#include "adaptive_bvh/feature_pairs.h"
#include "query/append_pair.h"
#include "query/found_parts.h"
#include "query/moving_mesh.h"

namespace adaptive_bvh {

/// A visitor of FeatureFinder that lists all pairs, by the numbers of their features.
template <bool kIsSelf>
class FeatureLists {
 public:
  FeatureLists(const MovingMesh& first, const MovingMesh& second, FeaturePairs& pairs)
      : first_(first), second_(second), pairs_(pairs) {}

  void clear() { pairs_.clear(); }

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

  using Mark = FeatureMark;
  Mark mark() const { return markOf(pairs_); }
  /// Lists apart, in memory that is kept in `memory`.
  FeatureLists forWorker(FeaturePairs& memory) const {
    return FeatureLists(first_, second_, memory);
  }
  /// In place of what it lists: what tasks found, in their order.
  template <typename Found>
  void take(const std::vector<Found>& tasks, const TaskPool& pool) {
    joinFeatures(
        tasks, pool, pairs_, [](const Found& task) -> auto& { return task.worker->pairs_; });
  }

 private:
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
