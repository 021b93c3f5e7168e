#pragma once

#include "query/swept_tree.h"
#include "query/wide_search.h"

namespace adaptive_bvh {

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
  /// Of sixteen bits: bit 4 j + i.
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

}  // namespace adaptive_bvh
