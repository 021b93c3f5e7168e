#pragma once

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string>

#include "adaptive_bvh/feature_pairs.h"
#include "adaptive_bvh/self_collision.h"
#include "boxes/wide_tree.h"

// Pairs that a query leaves out.
namespace adaptive_bvh {

/// Throws std::invalid_argument when the list is not sorted.
inline void requireSorted(const IgnoredPairs& pairs) {
  if (pairs.list && !std::is_sorted(pairs.list->begin(), pairs.list->end()))
    throw std::invalid_argument(
        "adaptive_bvh: the list of pairs to ignore is not sorted by first and second number");
}

/// Checks the list of a query of one mesh with itself. Also throws when a pair has the larger
/// number first, because such a pair would leave nothing out.
inline void requireSortedOfSelf(const IgnoredPairs& pairs) {
  requireSorted(pairs);
  if (!pairs.list) return;
  for (const FeaturePair& pair : *pairs.list)
    if (pair.first > pair.second)
      throw std::invalid_argument("adaptive_bvh: the list of pairs to ignore has the pair (" +
                                  std::to_string(pair.first) + ", " + std::to_string(pair.second) +
                                  "); within one mesh the smaller number comes first");
}

/// Whether a pair is to be left out.
inline bool isIgnored(const IgnoredPairs& pairs, unsigned first, unsigned second) {
  const FeaturePair pair{first, second};
  return (pairs.list && std::binary_search(pairs.list->begin(), pairs.list->end(), pair)) ||
         (pairs.test && pairs.test(first, second));
}

/// Returns the vertices of a leaf's triangles: for each of the three corners, a lane for each
/// triangle. Lanes without a triangle repeat the first one.
ADAPTIVE_BVH_INLINE std::array<Int4, 3> verticesOf(const WideTree& tree, const WideNode& leaf) {
  Float4 of[4];  // integers; only their bits are moved
  for (int i = 0; i < 4; ++i)
    __builtin_memcpy(&of[i], &tree.corners(unsigned(leaf.first + (i < leaf.count ? i : 0))),
                     sizeof(of[i]));
  const Vector4x3 columns = float4::columns(of[0], of[1], of[2], of[3]);
  std::array<Int4, 3> vertices;
  __builtin_memcpy(vertices.data(), &columns, sizeof(vertices));
  return vertices;
}

/// Removes the pairs of triangles with more common vertices than the filter allows. `pairs` has a
/// bit for each pair (4 j + i: triangle i of leaf `a`, triangle j of leaf `b`). A vertex that a
/// triangle repeats counts once. Keeps all pairs for BeyondShared, which needs more than indices
/// (meetBeyondShared).
ADAPTIVE_BVH_INLINE unsigned withoutNeighbours(unsigned pairs, const WideTree& tree1,
                                               const WideNode& a, const WideTree& tree2,
                                               const WideNode& b, NeighbourFilter filter) {
  if (filter == NeighbourFilter::None || filter == NeighbourFilter::BeyondShared) return pairs;
  const auto of_first = verticesOf(tree1, a);
  const int allowed = filter == NeighbourFilter::SharedEdge ? 1 : 0;
  for (int j = 0; j < b.count; ++j) {
    if (!(pairs >> (4 * j) & 15)) continue;
    const Int4& v = tree2.corners(static_cast<unsigned>(b.first + j));
    Int4 shared = {allowed, allowed, allowed, allowed};  // allowed minus common vertices
    for (int c = 0; c < 3; ++c) {
      if ((c > 0 && v[c] == v[0]) || (c > 1 && v[c] == v[1])) continue;
      const Int4 vertex = {v[c], v[c], v[c], v[c]};
      // A true comparison is -1.
      shared += (of_first[0] == vertex) | (of_first[1] == vertex) | (of_first[2] == vertex);
    }
    pairs &= ~(float4::bits(shared < Int4{}) << (4 * j));
  }
  return pairs;
}

}  // namespace adaptive_bvh
