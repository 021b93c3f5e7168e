#pragma once

#include "adaptive_bvh/feature_pairs.h"
#include "query/moving_mesh.h"

namespace adaptive_bvh {

/// A visitor of FeatureFinder that lists all pairs, by the numbers of their features.
template <bool kIsSelf>
class FeatureLists {
 public:
  FeatureLists(const MovingMesh& first, const MovingMesh& second, FeaturePairs& pairs)
      : first_(first), second_(second), pairs_(&pairs) {}

  ADAPTIVE_BVH_INLINE void vertexFace(unsigned v, unsigned t) {
    pairs_->vertex_face.push_back({vertex(first_, v), triangle(second_, t)});
  }
  ADAPTIVE_BVH_INLINE void faceVertex(unsigned t, unsigned v) {
    if (kIsSelf)
      pairs_->vertex_face.push_back({vertex(second_, v), triangle(first_, t)});
    else
      pairs_->face_vertex.push_back({triangle(first_, t), vertex(second_, v)});
  }
  ADAPTIVE_BVH_INLINE void edgeEdge(unsigned e, unsigned f) {
    const unsigned a = first_.features->edges()[e].number, b = second_.features->edges()[f].number;
    if (kIsSelf && b < a)
      pairs_->edge_edge.push_back({b, a});
    else
      pairs_->edge_edge.push_back({a, b});
  }

  FeatureLists forWorker() const { return FeatureLists(first_, second_); }
  void finish() {}
  struct Mark {
    std::size_t sizes[3];
  };
  Mark mark() const {
    return {{pairs_->vertex_face.size(), pairs_->face_vertex.size(), pairs_->edge_edge.size()}};
  }
  void take(const FeatureLists& worker, const Mark& from, const Mark& to) {
    append(pairs_->vertex_face, worker.pairs_->vertex_face, from.sizes[0], to.sizes[0]);
    append(pairs_->face_vertex, worker.pairs_->face_vertex, from.sizes[1], to.sizes[1]);
    append(pairs_->edge_edge, worker.pairs_->edge_edge, from.sizes[2], to.sizes[2]);
  }

 private:
  FeatureLists(const MovingMesh& first, const MovingMesh& second)
      : first_(first), second_(second), own_(std::make_unique<FeaturePairs>()) {
    pairs_ = own_.get();
  }
  static unsigned vertex(const MovingMesh& mesh, unsigned v) {
    return mesh.features->vertices()[v].vertex;
  }
  static unsigned triangle(const MovingMesh& mesh, unsigned place) {
    return (*mesh.owners)[place].triangle;
  }
  static void append(std::vector<FeaturePair>& to, const std::vector<FeaturePair>& from,
                     std::size_t begin, std::size_t end) {
    to.insert(to.end(), from.begin() + std::ptrdiff_t(begin), from.begin() + std::ptrdiff_t(end));
  }

  const MovingMesh &first_, &second_;
  std::unique_ptr<FeaturePairs> own_;
  FeaturePairs* pairs_;
};

}  // namespace adaptive_bvh
