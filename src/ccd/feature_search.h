#pragma once

#include <memory>
#include <vector>

#include "adaptive_bvh/feature_pairs.h"
#include "boxes/wide_search.h"
#include "ccd/swept_tree.h"
#include "query/found_parts.h"
#include "query/triangle_search.h"

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

/// Takes what a WideSearch finds: from pairs of leaves it makes the pairs of features that their
/// triangles own and whose boxes overlap, each once. Features that share a vertex are left out in
/// one mesh.
///
///   Visitor::vertexFace(v, t)   owned vertex v of the first, and the triangle in place t
///   Visitor::faceVertex(t, v)   a triangle of the first, and an owned vertex of the second
///   Visitor::edgeEdge(e, f)     two owned edges
template <bool kIsSelf, typename Visitor>
class FeatureFinder final : public LeafSink {
 public:
  FeatureFinder(const MovingMesh& first, const SweptTree& tree1, const MovingMesh& second,
                const SweptTree& tree2, Visitor& visitor)
      : first_(first), second_(second), tree1_(tree1), tree2_(tree2), visitor_(visitor) {}

  bool take(const LeavesFound* found, int count) override {
    for (int i = 0; i < count; ++i)
      if (kIsSelf && found[i].first == found[i].second)
        within(*found[i].first);
      else
        between(*found[i].first, *found[i].second);
    return false;
  }

 private:
  /// All pairs below two leaves.
  ADAPTIVE_BVH_INLINE void between(const WideNode& a, const WideNode& b) {
    const FeatureLeaves::Leaf &of_a = tree1_.leaf(first_, a), &of_b = tree2_.leaf(second_, b);
    for (unsigned g = 0; g < of_a.vertexGroups(); ++g)
      forEach(overlaps(tree1_.vertexBoxes(of_a.vertices + g), b.boxes),
              [&](unsigned k, unsigned j) {
                vertexFace(4 * (of_a.vertices + g) + k, unsigned(b.first) + j);
              });
    for (unsigned g = 0; g < of_b.vertexGroups(); ++g)
      forEach(overlaps(tree2_.vertexBoxes(of_b.vertices + g), a.boxes),
              [&](unsigned k, unsigned i) {
                faceVertex(unsigned(a.first) + i, 4 * (of_b.vertices + g) + k);
              });
    for (unsigned g = 0; g < of_a.edgeGroups(); ++g)
      for (unsigned h = 0; h < of_b.edgeGroups(); ++h)
        edges(of_a.edges + g, of_b.edges + h, 0xffff);
  }
  /// Those within one leaf.
  void within(const WideNode& a) {
    const FeatureLeaves::Leaf& leaf = tree1_.leaf(first_, a);
    for (unsigned g = 0; g < leaf.vertexGroups(); ++g)
      forEach(overlaps(tree1_.vertexBoxes(leaf.vertices + g), a.boxes),
              [&](unsigned k, unsigned j) {
                vertexFace(4 * (leaf.vertices + g) + k, unsigned(a.first) + j);
              });
    constexpr unsigned kUpper = 0x7310;  // the first before the second
    for (unsigned g = 0; g < leaf.edgeGroups(); ++g)
      for (unsigned h = g; h < leaf.edgeGroups(); ++h)
        edges(leaf.edges + g, leaf.edges + h, g == h ? kUpper : 0xffff);
  }
  ADAPTIVE_BVH_INLINE void edges(unsigned g, unsigned h, unsigned mask) {
    forEach(overlaps(tree1_.edgeBoxes(g), tree2_.edgeBoxes(h)) & mask,
            [&](unsigned k, unsigned l) { edgeEdge(4 * g + k, 4 * h + l); });
  }

  ADAPTIVE_BVH_INLINE void vertexFace(unsigned v, unsigned t) {
    if (!kIsSelf || !has(second_.vertices[t], first_.features->vertices()[v].vertex))
      visitor_.vertexFace(v, t);
  }
  ADAPTIVE_BVH_INLINE void faceVertex(unsigned t, unsigned v) {
    if (!kIsSelf || !has(first_.vertices[t], second_.features->vertices()[v].vertex))
      visitor_.faceVertex(t, v);
  }
  ADAPTIVE_BVH_INLINE void edgeEdge(unsigned e, unsigned f) {
    const OwnedEdge &a = first_.features->edges()[e], &b = second_.features->edges()[f];
    const unsigned *p = a.vertices, *q = b.vertices;
    if (!kIsSelf || !((p[0] == q[0]) | (p[0] == q[1]) | (p[1] == q[0]) | (p[1] == q[1])))
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
  Visitor& visitor_;
};

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
