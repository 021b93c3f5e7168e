#pragma once

#include "adaptive_bvh/self_collision.h"
#include "boxes/wide_tree.h"
#include "query/pair_stages.h"
#include "triangles/triangle_differences.h"

namespace adaptive_bvh {

/// What corners may be off by: their positions, and these with residuals or in the model's numbers.
struct PairErrors {
  PairError coarse, fine;
};
/// `frame` as in WideSearch, of the first tree, whose scale that is; `reach`: PairError::reach.
template <typename Frame>
PairErrors pairErrors(const Frame& frame, double scale, float reach) {
  const float share = differenceError<double>(),
              least = leastProduct<double>(scale, frame.longest());
  return {{frame.error(), share, least, reach}, {frame.preciseError(), share, least, reach}};
}

/// Where the corners of a pair of trees with the same coordinates are. `in`: CandidateInput or
/// WithinInput.
template <typename Input>
PairSource sourceOf(const Input& in) {
  const auto of = [](const WideTree& tree) -> CornerSource {
    return {tree.slots().leafSlots(), tree.positions(), tree.residuals()};
  };
  return {of(in.tree1), of(in.tree2)};
}
/// Keeps the pairs that are not surely apart along a normal, or at right angles to one and to an
/// edge; returns how many.
inline int keepByNormals(const PairSource& from, LeafPair* pairs, int size,
                         const PairErrors& errors) {
  size = pairTests().keepByPlanes(from, pairs, size, errors.coarse);
  return pairTests().keepByNormals(from, pairs, size, errors.fine);
}

/// The corners of four triangles of a four-wide tree, in its coordinates.
ADAPTIVE_BVH_INLINE void gatherCorners(const VertexSlots& slots, const Float4* positions,
                                       const std::array<unsigned, 4>& triangles,
                                       Vector4x3 (&corners)[3]) {
  VertexIndices at[4];
  for (std::size_t k = 0; k < 4; ++k) at[k] = slots.slotsOf(triangles[k]);
  for (std::size_t c = 0; c < 3; ++c)
    corners[c] = float4::columns(positions[at[0][c]], positions[at[1][c]], positions[at[2][c]],
                                 positions[at[3][c]]);
}

/// The corners of the triangles of a leaf. Lanes without a triangle repeat the first.
ADAPTIVE_BVH_INLINE void gatherLeaf(const VertexSlots& slots, const Float4* positions,
                                    const WideNode& leaf, Vector4x3 (&corners)[3]) {
  std::array<unsigned, 4> triangles;
  for (int i = 0; i < 4; ++i)
    triangles[std::size_t(i)] = static_cast<unsigned>(leaf.first + (i < leaf.count ? i : 0));
  gatherCorners(slots, positions, triangles, corners);
}

/// The corners of four pairs of triangles, in the coordinates of the first tree. `in`: trees, of
/// CandidateInput or WithinInput; `frame` as in WideSearch.
template <typename Input, typename Frame>
ADAPTIVE_BVH_INLINE void gatherCorners(const Input& in, const Frame& frame,
                                       const LeafPair (&group)[4], Vector4x3 (&p)[3],
                                       Vector4x3 (&q)[3]) {
  gatherCorners(in.tree1.slots(), in.tree1.positions(),
                {group[0].first, group[1].first, group[2].first, group[3].first}, p);
  gatherCorners(in.tree2.slots(), in.tree2.positions(),
                {group[0].second, group[1].second, group[2].second, group[3].second}, q);
  for (Vector4x3& corner : q) corner = frame(corner);
}

/// The vertices of the triangles of a leaf. Lanes without a triangle repeat the first.
ADAPTIVE_BVH_INLINE std::array<Int4, 3> verticesOf(const WideTree& tree, const WideNode& leaf) {
  Float4 of[4];  // only their bits are moved
  for (int i = 0; i < 4; ++i)
    __builtin_memcpy(&of[i], &tree.corners(unsigned(leaf.first + (i < leaf.count ? i : 0))),
                     sizeof(of[i]));
  const Vector4x3 columns = float4::columns(of[0], of[1], of[2], of[3]);
  std::array<Int4, 3> vertices;
  __builtin_memcpy(vertices.data(), &columns, sizeof(vertices));
  return vertices;
}

/// Returns the pairs of triangles of two leaves (bit 4 j + i: i of `a`, j of `b`) that the filter
/// does not leave out because of common vertices. A vertex that a triangle repeats counts once.
ADAPTIVE_BVH_INLINE unsigned withoutNeighbours(unsigned pairs, const WideTree& tree1,
                                               const WideNode& a, const WideTree& tree2,
                                               const WideNode& b, NeighbourFilter filter) {
  if (filter == NeighbourFilter::None || filter == NeighbourFilter::BeyondShared) return pairs;
  const auto of_first = verticesOf(tree1, a);
  const int allowed = filter == NeighbourFilter::SharedEdge ? 1 : 0;
  for (int j = 0; j < b.count; ++j) {
    if (!(pairs >> (4 * j) & 15)) continue;
    const Int4& v = tree2.corners(static_cast<unsigned>(b.first + j));
    Int4 shared = {allowed, allowed, allowed, allowed};  // less one for each
    for (int c = 0; c < 3; ++c) {
      if ((c > 0 && v[c] == v[0]) || (c > 1 && v[c] == v[1])) continue;
      const Int4 vertex = {v[c], v[c], v[c], v[c]};
      shared += (of_first[0] == vertex) | (of_first[1] == vertex) | (of_first[2] == vertex);
    }
    pairs &= ~(float4::bits(shared < Int4{}) << (4 * j));
  }
  return pairs;
}

/// Lets groups of four of `size` pairs be whole, by repeating the last one. There must be room for
/// three more.
ADAPTIVE_BVH_INLINE void padToFour(LeafPair* pairs, int size) {
  for (int i = size; i % 4; ++i) pairs[i] = pairs[size - 1];
}

}  // namespace adaptive_bvh
