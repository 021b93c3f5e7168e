#pragma once

#include <vector>

#include "adaptive_bvh/feature_pairs.h"
#include "boxes/wide_search.h"
#include "ccd/swept_tree.h"
#include "query/triangle_search.h"
#include "query/within/found_parts.h"

namespace adaptive_bvh {

/// Two meshes, or one mesh twice, with their trees of swept boxes.
struct SweptPair {
  const MovingMesh& first;
  const SweptTree& tree1;
  const MovingMesh& second;
  const SweptTree& tree2;

  bool isSelf() const { return &first == &second; }
  WideTrees trees() const {
    return {tree1.nodes(), tree2.nodes(), first.depth + second.depth, BoxFrame(nullptr, 0),
            isSelf()};
  }
};

/// A visitor of FeatureFinder, and a sink of searchAll, that lists all pairs by the numbers of
/// their features. In a pair of vertex and face within one mesh, the vertex comes first.
class FeatureLists {
 public:
  FeatureLists(const SweptPair& pair, FeaturePairs& pairs)
      : pair_(pair), is_self_(pair.isSelf()), pairs_(pairs) {}

  void clear() { pairs_.clear(); }

  ADAPTIVE_BVH_INLINE void vertexFace(unsigned v, unsigned t) {
    appendPair(vertex(pair_.first, v), triangle(pair_.second, t), pairs_.vertex_face);
  }
  ADAPTIVE_BVH_INLINE void faceVertex(unsigned t, unsigned v) {
    if (is_self_)
      appendPair(vertex(pair_.second, v), triangle(pair_.first, t), pairs_.vertex_face);
    else
      appendPair(triangle(pair_.first, t), vertex(pair_.second, v), pairs_.face_vertex);
  }
  ADAPTIVE_BVH_INLINE void edgeEdge(unsigned e, unsigned f) {
    const unsigned a = pair_.first.features->edges()[e].number,
                   b = pair_.second.features->edges()[f].number;
    const bool swaps = is_self_ && b < a;
    appendPair(swaps ? b : a, swaps ? a : b, pairs_.edge_edge);
  }
  void finish() {}

  // The interface of a sink of searchAll.
  using Result = FeaturePairs;
  FeatureLists another(Result& result) const { return {pair_, result}; }
  using Mark = FeatureMark;
  Mark mark() const { return markOf(pairs_); }
  const FeatureLists& lists() const { return *this; }
  /// Replaces the lists by those of all tasks.
  template <typename Found>
  void take(const std::vector<Found>& tasks, const TaskPool& pool) {
    joinFeatures(
        tasks, pool, pairs_,
        [](const Found& task) -> auto& { return task.worker->sink().lists().pairs_; });
  }

 private:
  /// The number of an owned vertex, and of a triangle given by its leaf index.
  static unsigned vertex(const MovingMesh& mesh, unsigned v) {
    return mesh.features->vertices()[v].vertex;
  }
  static unsigned triangle(const MovingMesh& mesh, unsigned leaf_index) {
    return (*mesh.owners)[leaf_index].triangle;
  }

  const SweptPair pair_;
  const bool is_self_;
  FeaturePairs& pairs_;
};

/// The tests of a TriangleSearch: in pairs of leaves, finds the pairs of features whose boxes
/// overlap, each once, because each feature is owned by one triangle. In one mesh, features that
/// share a vertex are left out.
///
///   visitor.vertexFace(v, t)   a vertex of the first mesh, a triangle of the second
///   visitor.faceVertex(t, v)   a triangle of the first mesh, a vertex of the second
///   visitor.edgeEdge(e, f)     an edge of each mesh
///   visitor.finish()           ends a traversal
///
/// Triangles are given by leaf indices, vertices and edges by indices in FeatureLeaves.
template <typename Visitor>
class FeatureFinder {
 public:
  FeatureFinder(Visitor& visitor, const SweptPair& pair)
      : first_(pair.first),
        second_(pair.second),
        tree1_(pair.tree1),
        tree2_(pair.tree2),
        is_self_(pair.isSelf()),
        visitor_(visitor) {}

  void begin() {}
  void finish() { visitor_.finish(); }
  static bool isDone() { return false; }
  /// Visits the pairs of two leaves whose boxes overlap.
  void foundLeaves(const WideNode& a, const WideNode& b, unsigned) {
    if (is_self_ && &a == &b)
      within(a);
    else
      between(a, b);
  }

 private:
  /// Finds the pairs of one feature of each leaf.
  ADAPTIVE_BVH_INLINE void between(const WideNode& a, const WideNode& b) {
    const FeatureLeaves::Leaf &leaf_a = tree1_.leaf(first_, a), &leaf_b = tree2_.leaf(second_, b);
    for (unsigned g = 0; g < leaf_a.vertexGroups(); ++g)
      forEach(overlaps(tree1_.vertexBoxes(leaf_a.vertices + g), b.boxes),
              [&](unsigned k, unsigned j) {
                vertexFace(4 * (leaf_a.vertices + g) + k, unsigned(b.first) + j);
              });
    for (unsigned g = 0; g < leaf_b.vertexGroups(); ++g)
      forEach(overlaps(tree2_.vertexBoxes(leaf_b.vertices + g), a.boxes),
              [&](unsigned k, unsigned i) {
                faceVertex(unsigned(a.first) + i, 4 * (leaf_b.vertices + g) + k);
              });
    for (unsigned g = 0; g < leaf_a.edgeGroups(); ++g)
      for (unsigned h = 0; h < leaf_b.edgeGroups(); ++h)
        edges(leaf_a.edges + g, leaf_b.edges + h, 0xffff);
  }
  /// Finds the pairs within a leaf.
  void within(const WideNode& a) {
    const FeatureLeaves::Leaf& leaf = tree1_.leaf(first_, a);
    for (unsigned g = 0; g < leaf.vertexGroups(); ++g)
      forEach(overlaps(tree1_.vertexBoxes(leaf.vertices + g), a.boxes),
              [&](unsigned k, unsigned j) {
                vertexFace(4 * (leaf.vertices + g) + k, unsigned(a.first) + j);
              });
    constexpr unsigned kUpper = 0x7310;  // bits 4 j + i with i < j
    for (unsigned g = 0; g < leaf.edgeGroups(); ++g)
      for (unsigned h = g; h < leaf.edgeGroups(); ++h)
        edges(leaf.edges + g, leaf.edges + h, g == h ? kUpper : 0xffff);
  }
  /// Finds the pairs of edges of the groups g and h, for the bits set in `mask`.
  ADAPTIVE_BVH_INLINE void edges(unsigned g, unsigned h, unsigned mask) {
    forEach(overlaps(tree1_.edgeBoxes(g), tree2_.edgeBoxes(h)) & mask,
            [&](unsigned k, unsigned l) { edgeEdge(4 * g + k, 4 * h + l); });
  }

  // Pass a pair to the visitor, unless both features are of one mesh and share a vertex.
  ADAPTIVE_BVH_INLINE void vertexFace(unsigned v, unsigned t) {
    if (!is_self_ || !has(second_.vertices[t], first_.features->vertices()[v].vertex))
      visitor_.vertexFace(v, t);
  }
  ADAPTIVE_BVH_INLINE void faceVertex(unsigned t, unsigned v) {
    if (!is_self_ || !has(first_.vertices[t], second_.features->vertices()[v].vertex))
      visitor_.faceVertex(t, v);
  }
  ADAPTIVE_BVH_INLINE void edgeEdge(unsigned e, unsigned f) {
    const OwnedEdge &a = first_.features->edges()[e], &b = second_.features->edges()[f];
    const unsigned *p = a.vertices, *q = b.vertices;
    if (!is_self_ || !((p[0] == q[0]) | (p[0] == q[1]) | (p[1] == q[0]) | (p[1] == q[1])))
      visitor_.edgeEdge(e, f);
  }
  ADAPTIVE_BVH_INLINE static bool has(const Int4& corners, unsigned vertex) {
    const auto v = static_cast<std::int32_t>(vertex);
    return (corners[0] == v) | (corners[1] == v) | (corners[2] == v);
  }
  /// Calls act(i, j) for each set bit 4 j + i of sixteen bits.
  template <typename Do>
  ADAPTIVE_BVH_INLINE static void forEach(unsigned bits, Do&& act) {
    for (; bits; bits &= bits - 1) {
      const auto bit = static_cast<unsigned>(__builtin_ctz(bits));
      act(bit & 3, bit >> 2);
    }
  }

  const MovingMesh &first_, &second_;
  const SweptTree &tree1_, &tree2_;
  const bool is_self_;
  Visitor& visitor_;
};

/// Calls the visitor, a sink of searchAll, for all pairs of features whose swept boxes overlap.
template <typename Visitor>
void searchFeatures(const SweptPair& pair, Visitor& visitor, int threads) {
  searchAll<FeatureFinder<Visitor>>(threads, pair.trees(), visitor, pair);
}

}  // namespace adaptive_bvh
