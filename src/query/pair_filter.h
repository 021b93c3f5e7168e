#pragma once

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string>

#include "adaptive_bvh/feature_pairs.h"
#include "boxes/wide_tree.h"
#include "query/neighbour_ranges.h"

// Filters for the pairs that a query has found: those that the caller ignores (Ignored).
namespace adaptive_bvh {

/// Throws std::invalid_argument if a list of pairs is not sorted; within one mesh also if a pair of
/// two triangles or two edges has the larger number first. Results have the smaller number first,
/// so such a pair would match nothing.
inline void requireSorted(const Ignored& ignored, bool is_self) {
  for (const IgnoredPairs* pairs :
       {&ignored.triangles, &ignored.vertex_face, &ignored.face_vertex, &ignored.edge_edge}) {
    if (!pairs->list) continue;
    if (!std::is_sorted(pairs->list->begin(), pairs->list->end()))
      throw std::invalid_argument(
          "adaptive_bvh: the list of pairs to ignore is not sorted by first and second number");
    if (!is_self || pairs == &ignored.vertex_face || pairs == &ignored.face_vertex) continue;
    for (const FeaturePair& pair : *pairs->list)
      if (pair.first > pair.second)
        throw std::invalid_argument("adaptive_bvh: the list of pairs to ignore has the pair (" +
                                    std::to_string(pair.first) + ", " +
                                    std::to_string(pair.second) +
                                    "); within one mesh the smaller number comes first");
  }
}

/// Whether the list, which must be sorted, or the function of `pairs` has the pair (first, second).
inline bool isIgnored(const IgnoredPairs& pairs, unsigned first, unsigned second) {
  const FeaturePair pair{first, second};
  return (pairs.list && std::binary_search(pairs.list->begin(), pairs.list->end(), pair)) ||
         (pairs.test && pairs.test(first, second));
}

/// Returns the vertex indices of a leaf's triangles: element c, lane i is corner c of triangle i.
/// Lanes without a triangle repeat the first triangle.
ADAPTIVE_BVH_INLINE std::array<Int4, 3> verticesOf(const WideTree& tree, const WideNode& leaf) {
  Float4 rows[4];  // triangle i's indices; float4::columns transposes their bits unchanged
  for (int i = 0; i < 4; ++i)
    __builtin_memcpy(&rows[i], &tree.corners(unsigned(leaf.first + (i < leaf.count ? i : 0))),
                     sizeof(rows[i]));
  const Vector4x3 columns = float4::columns(rows[0], rows[1], rows[2], rows[3]);
  std::array<Int4, 3> vertices;
  __builtin_memcpy(vertices.data(), &columns, sizeof(vertices));
  return vertices;
}

/// Neighbouring triangles that a search of one mesh with itself leaves out.
struct LeftOut {
  NeighbourFilter filter = NeighbourFilter::None;
  const NeighbourRanges* surface = nullptr;  ///< or null
};

/// Returns `pairs` without those that are near along the surface.
inline unsigned withoutListed(unsigned pairs, const WideNode& a, const WideNode& b,
                              const NeighbourRanges& surface) {
  for (unsigned rest = pairs; rest; rest &= rest - 1) {
    const int bit = __builtin_ctz(rest);
    if (surface.areListed(unsigned(a.first + (bit & 3)), unsigned(b.first + (bit >> 2))))
      pairs &= ~(1u << bit);
  }
  return pairs;
}

/// Returns `pairs` without the pairs of triangles that have more common vertices than the filter
/// allows: none for SharedVertex, one for SharedEdge. Bit 4 j + i stands for triangle i of leaf `a`
/// and triangle j of leaf `b`. A vertex that a triangle repeats counts once. Returns all pairs for
/// BeyondShared: that filter needs positions, too, and is applied later (meetBeyondShared).
ADAPTIVE_BVH_INLINE unsigned withoutNeighbours(unsigned pairs, const WideTree& tree1,
                                               const WideNode& a, const WideTree& tree2,
                                               const WideNode& b, const LeftOut& left_out) {
  if (left_out.surface) pairs = withoutListed(pairs, a, b, *left_out.surface);
  const NeighbourFilter filter = left_out.filter;
  if (filter == NeighbourFilter::None || filter == NeighbourFilter::BeyondShared) return pairs;
  const std::array<Int4, 3> vertices1 = verticesOf(tree1, a);
  const int allowed = filter == NeighbourFilter::SharedEdge ? 1 : 0;
  for (int j = 0; j < b.count; ++j) {
    if (!(pairs >> (4 * j) & 15)) continue;
    const Int4& v = tree2.corners(static_cast<unsigned>(b.first + j));  // vertices of triangle j
    // For each triangle of `a`: how many more common vertices the filter allows.
    Int4 remaining = {allowed, allowed, allowed, allowed};
    for (int c = 0; c < 3; ++c) {
      if ((c > 0 && v[c] == v[0]) || (c > 1 && v[c] == v[1])) continue;
      const Int4 vertex = {v[c], v[c], v[c], v[c]};
      // A comparison yields -1 in the lanes where it is true, else 0.
      remaining += (vertices1[0] == vertex) | (vertices1[1] == vertex) | (vertices1[2] == vertex);
    }
    pairs &= ~(float4::bits(remaining < Int4{}) << (4 * j));
  }
  return pairs;
}

}  // namespace adaptive_bvh
