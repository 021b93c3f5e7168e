#pragma once

#include "query/swept_tree.h"
#include "query/wide_search.h"

namespace adaptive_bvh {

/// Boxes of the vertices, edges and the face of one triangle: lanes 0 to 2 are corner k, and the
/// edge from corner k to the next.
struct TriangleBoxes {
  Boxes4 vertices, edges, face;

  TriangleBoxes() = default;
  ADAPTIVE_BVH_INLINE TriangleBoxes(const VertexIndices& slots, const Box* boxes) {
    const Box &a = boxes[slots[0]], &b = boxes[slots[1]], &c = boxes[slots[2]];
    vertices = boxes4(a, b, c, c);
    for (int k = 0; k < 3; ++k) {
      using float4::broadcast;
      using float4::lower;
      using float4::rotated;
      using float4::upper;
      edges.low[k] = lower(vertices.low[k], rotated(vertices.low[k]));
      edges.high[k] = upper(vertices.high[k], rotated(vertices.high[k]));
      face.low[k] = broadcast<0>(lower(edges.low[k], rotated(edges.low[k])));
      face.high[k] = broadcast<0>(upper(edges.high[k], rotated(edges.high[k])));
    }
  }
};

/// A bit for each lane in which boxes overlap.
ADAPTIVE_BVH_INLINE unsigned overlapsByLane(const Boxes4& a, const Boxes4& b) {
  return float4::bits((a.low[0] <= b.high[0]) & (b.low[0] <= a.high[0]) & (a.low[1] <= b.high[1]) &
                      (b.low[1] <= a.high[1]) & (a.low[2] <= b.high[2]) & (b.low[2] <= a.high[2]));
}
/// Box `k` of four, in all lanes.
ADAPTIVE_BVH_INLINE Boxes4 broadcast(const Boxes4& boxes, unsigned k) {
  Boxes4 all;
  for (int i = 0; i < 3; ++i) {
    all.low[i] = float4::all(boxes.low[i][k]);
    all.high[i] = float4::all(boxes.high[i][k]);
  }
  return all;
}

/// A visitor of WideSearch: from pairs of triangles it makes the pairs of features that they own
/// and whose boxes overlap, each once. Features that share a vertex are left out in one mesh.
///
///   Visitor::vertexFace(i, k, j)     corner k of triangle i of the first, and triangle j
///   Visitor::faceVertex(i, j, l)     triangle i, and corner l of triangle j of the second
///   Visitor::edgeEdge(i, k, j, l)    the edges from corner k of i and from corner l of j
template <bool kIsSelf, typename Visitor>
class FeatureFinder {
 public:
  FeatureFinder(const MovingMesh& first, const SweptTree& tree1, const MovingMesh& second,
                const SweptTree& tree2, Visitor& visitor)
      : first_(first), second_(second), tree1_(tree1), tree2_(tree2), visitor_(visitor) {}

  ADAPTIVE_BVH_INLINE void found(unsigned i, unsigned j) {
    const FeatureOwner &a = (*first_.owners)[i], &b = (*second_.owners)[j];
    if ((a.bits | b.bits) == 0) return;
    const unsigned shared = kIsSelf ? sharedVertices(first_.vertices[i], second_.vertices[j]) : 0;
    if (i != triangle1_) boxes1_ = TriangleBoxes(first_.slots->slotsOf(i), tree1_.boxes());
    if (j != triangle2_) boxes2_ = TriangleBoxes(second_.slots->slotsOf(j), tree2_.boxes());
    triangle1_ = i;
    triangle2_ = j;
    unsigned of_first = 0, of_second = 0;  // vertices that they share
    if (shared) {
      of_first = (shared | shared >> 3 | shared >> 6) & 7;
      of_second = sharedOfSecond(shared);
    }
    if (const unsigned owned = a.vertices() & ~of_first)
      forEach(owned & overlapsByLane(boxes1_.vertices, boxes2_.face),
              [&](unsigned k) { visitor_.vertexFace(i, k, j); });
    if (const unsigned owned = b.vertices() & ~of_second)
      forEach(owned & overlapsByLane(boxes2_.vertices, boxes1_.face),
              [&](unsigned l) { visitor_.faceVertex(i, j, l); });
    const unsigned edges2 = b.edges();
    if (edges2 == 0) return;
    forEach(a.edges(), [&](unsigned k) {
      unsigned bits = edges2 & overlapsByLane(broadcast(boxes1_.edges, k), boxes2_.edges);
      if (shared && bits) bits &= ~edgesSharing(i, k, j);
      forEach(bits, [&](unsigned l) { visitor_.edgeEdge(i, k, j, l); });
    });
  }
  bool isDone() const { return false; }

 private:
  /// The corners of the second that are corners of the first: lane l of group g compares corner l
  /// of the first with corner l + g of the second.
  static unsigned sharedOfSecond(unsigned shared) {
    const unsigned as_is = shared & 7, once = shared >> 3 & 7, twice = shared >> 6 & 7;
    return as_is | ((once << 1 | once >> 2) & 7) | ((twice << 2 | twice >> 1) & 7);
  }
  /// The edges of triangle j that share a vertex with edge k of triangle i.
  unsigned edgesSharing(unsigned i, unsigned k, unsigned j) const {
    const auto e = first_.edge(i, k);
    const Int4& v = second_.vertices[j];
    unsigned corners = 0;
    for (unsigned l = 0; l < 3; ++l) {
      const auto x = static_cast<unsigned>(v[l]);
      corners |= static_cast<unsigned>(x == e[0] || x == e[1]) << l;
    }
    return corners | (corners >> 1 | corners << 2);  // an edge from corner l, or to it
  }
  template <typename Do>
  ADAPTIVE_BVH_INLINE static void forEach(unsigned bits, Do&& act) {
    for (; bits; bits &= bits - 1) act(static_cast<unsigned>(__builtin_ctz(bits)));
  }

  const MovingMesh &first_, &second_;
  const SweptTree &tree1_, &tree2_;
  Visitor& visitor_;
  unsigned triangle1_ = ~0u, triangle2_ = ~0u;
  TriangleBoxes boxes1_, boxes2_;
};

}  // namespace adaptive_bvh
