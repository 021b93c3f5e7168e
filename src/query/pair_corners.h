#pragma once

#include "boxes/wide_tree.h"
#include "query/pair_tests.h"
#include "triangles/triangle_contact.h"
#include "triangles/triangle_pairs.h"

namespace adaptive_bvh {

/// Returns a bound of the error by underflow in products of two to four lengths, in body units. It
/// covers FCL's products, which are in the model's unit (a length there, times `scale`, is in body
/// units), and those of TrianglePairs4. `longest`: upper bound of all lengths, in body units.
inline float leastProduct(double scale, double longest) {
  const auto lost = [&](double smallest, double unit) {
    const double square = unit * unit;
    return 64 * smallest * square * (square + unit * longest + longest * longest);
  };
  return static_cast<float>(lost(std::numeric_limits<double>::min(), scale) +
                            lost(double(std::numeric_limits<float>::min()), 1));
}

/// Error of a difference of coordinates along any axes, as a share of the pair's extent.
constexpr float kDifferenceError = 2 * std::numeric_limits<double>::epsilon();

/// Builds four pairs of triangles from the model's own positions, by the differences of coordinates
/// that FCL's test also uses.
class TriangleDifferences {
 public:
  /// `scale`: a power of two; factor from the lengths of the corners to those of the pairs.
  explicit TriangleDifferences(double scale) : scale_(scale) {}

  ADAPTIVE_BVH_INLINE void set(int lane, const TrianglePoints<double>& p,
                               TrianglePoints<double> q) {
    for (std::size_t c = 0; c < 3; ++c) q[c] -= p[0];
    const fcl::Vector3d p1 = p[1] - p[0], p2 = p[2] - p[0];
    set(kPEdges + 0, lane, p1);
    set(kPEdges + 1, lane, p2 - p1);
    set(kPEdges + 2, lane, -p2);
    for (std::size_t c = 0; c < 3; ++c) {
      set(kQEdges + c, lane, q[(c + 1) % 3] - q[c]);
      set(kQCorners + c, lane, q[c]);
    }
  }

  ADAPTIVE_BVH_INLINE TrianglePairs4 pairs() const {
    TrianglePairs4 pairs;
    for (std::size_t c = 0; c < 3; ++c) {
      pairs.p_edges[c] = get(kPEdges + c);
      pairs.q_edges[c] = get(kQEdges + c);
      pairs.q[c] = get(kQCorners + c);
    }
    return pairs;
  }

 private:
  static constexpr std::size_t kPEdges = 0, kQEdges = 3, kQCorners = 6;

  ADAPTIVE_BVH_INLINE void set(std::size_t which, int lane, const fcl::Vector3d& v) {
    vectors_[which][lane] =
        Float4{static_cast<float>(v[0] * scale_), static_cast<float>(v[1] * scale_),
               static_cast<float>(v[2] * scale_), 0};
  }
  ADAPTIVE_BVH_INLINE Vector4x3 get(std::size_t which) const {
    const Float4(&v)[4] = vectors_[which];
    return float4::columns(v[0], v[1], v[2], v[3]);
  }

  const double scale_;
  Float4 vectors_[9][4];
};

/// Errors of corners: of their positions alone (`coarse`), and of positions with residuals or of
/// the model's own positions (`fine`).
struct PairErrors {
  PairError coarse, fine;
};
/// `frame` as in WideSearch, with the scale of the first tree; `distance`: beyond it pairs are
/// apart.
template <typename Frame>
PairErrors pairErrors(const Frame& frame, double scale, float distance) {
  const float share = kDifferenceError, least = leastProduct(scale, frame.longest());
  return {{frame.error(), share, least, distance}, {frame.preciseError(), share, least, distance}};
}

/// Returns the corners of a pair of trees that have the same coordinates. `in`: PairInput.
template <typename Input>
PairSource sourceOf(const Input& in) {
  const auto of = [](const WideTree& tree) -> CornerSource {
    return {tree.slots().leafSlots(), tree.positions(), tree.residuals()};
  };
  return {of(in.tree1), of(in.tree2)};
}
/// Keeps the pairs that are not certainly separated along a normal, or along a direction
/// perpendicular to a normal and an edge. Returns their number.
inline int keepByNormals(const PairSource& from, LeafIndexPair* pairs, int size,
                         const PairErrors& errors) {
  size = pairTests().keepByPlanes(from, pairs, size, errors.coarse);
  return pairTests().keepByNormals(from, pairs, size, errors.fine);
}

/// Gathers the corners of a leaf's triangles. Lanes without a triangle repeat the first one.
ADAPTIVE_BVH_INLINE void gatherLeaf(const VertexSlots& slots, const Float4* positions,
                                    const WideNode& leaf, Vector4x3 (&corners)[3]) {
  std::array<unsigned, 4> triangles;
  for (int i = 0; i < 4; ++i)
    triangles[std::size_t(i)] = static_cast<unsigned>(leaf.first + (i < leaf.count ? i : 0));
  gatherCorners(slots, positions, triangles, corners);
}

/// Gathers the corners of four pairs of triangles, in the coordinates of the first tree. `in`:
/// PairInput; `frame`: SameFrame or RelativeFrame.
template <typename Input, typename Frame>
ADAPTIVE_BVH_INLINE void gatherCorners(const Input& in, const Frame& frame,
                                       const LeafIndexPair (&group)[4], Vector4x3 (&p)[3],
                                       Vector4x3 (&q)[3]) {
  gatherCorners(in.tree1.slots(), in.tree1.positions(),
                {group[0].first, group[1].first, group[2].first, group[3].first}, p);
  gatherCorners(in.tree2.slots(), in.tree2.positions(),
                {group[0].second, group[1].second, group[2].second, group[3].second}, q);
  for (Vector4x3& corner : q) corner = frame(corner);
}

/// Fills the last group of four by repeating the last pair. `pairs` needs room for three more
/// pairs.
ADAPTIVE_BVH_INLINE void padToFour(LeafIndexPair* pairs, int size) {
  for (int i = size; i % 4; ++i) pairs[i] = pairs[size - 1];
}

}  // namespace adaptive_bvh
