#pragma once

#include "boxes/wide_tree.h"
#include "query/pair_tests.h"
#include "triangles/triangle_contact.h"
#include "triangles/triangle_pairs.h"

// Loads the corners of pairs of triangles for the tests that run several pairs at once, and bounds
// the errors of these corners. "Body units" are those of a tree's coordinates (BodyCoordinates).
namespace adaptive_bvh {

/// Returns a bound of what underflow takes off a product of two to four lengths, in body units: for
/// FCL's products, in double precision and in the model's unit, and for those of TrianglePairs4, in
/// single precision and in body units. `scale` converts a length from the model's unit to body
/// units. `longest`: upper bound of all lengths, in body units. docs/bounds.md, 13, Underflow.
inline float leastProduct(double scale, double longest) {
  const auto underflow = [&](double smallest_normal, double unit) {
    const double square = unit * unit;
    return 64 * smallest_normal * square * (square + unit * longest + longest * longest);
  };
  return static_cast<float>(underflow(std::numeric_limits<double>::min(), scale) +
                            underflow(double(std::numeric_limits<float>::min()), 1));
}

/// PairError::share: rounding error of a difference of two corners in double precision, along any
/// axes, relative to the extent of the pair.
constexpr float kDifferenceError = 2 * std::numeric_limits<double>::epsilon();

/// Builds four pairs of triangles from the model's own positions. Like FCL's test, it subtracts
/// corners in double precision; only the differences are rounded to single precision.
class TriangleDifferences {
 public:
  /// `scale`: a power of two, by which differences are multiplied (BodyCoordinates::scale).
  explicit TriangleDifferences(double scale) : scale_(scale) {}

  /// Sets the pair of one lane: triangles p and q in one frame.
  ADAPTIVE_BVH_INLINE void set(int lane, const TrianglePoints& p, TrianglePoints q) {
    for (std::size_t c = 0; c < 3; ++c) q[c] -= p[0];
    const fcl::Vector3d p1 = p[1] - p[0], p2 = p[2] - p[0];
    set(kPEdges, lane, p1);
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
  static constexpr std::size_t kPEdges = 0, kQEdges = 3, kQCorners = 6;  // first of three indices

  ADAPTIVE_BVH_INLINE void set(std::size_t index, int lane, const fcl::Vector3d& v) {
    vectors_[index][lane] =
        Float4{static_cast<float>(v[0] * scale_), static_cast<float>(v[1] * scale_),
               static_cast<float>(v[2] * scale_), 0};
  }
  ADAPTIVE_BVH_INLINE Vector4x3 get(std::size_t index) const {
    const Float4(&v)[4] = vectors_[index];
    return float4::columns(v[0], v[1], v[2], v[3]);
  }

  const double scale_;
  Float4 vectors_[9][4];  ///< by index and lane
};

/// Errors of the corners of pairs of triangles.
struct PairErrors {
  PairError coarse;  ///< for the trees' positions alone
  PairError fine;    ///< for positions with residuals, and for the model's own positions
};
/// Returns the errors of pairs of two trees. `frame`: SameFrame or RelativeFrame; `scale`: that of
/// the first tree; `distance`: pairs farther apart than this count as apart, in body units.
template <typename Frame>
PairErrors pairErrors(const Frame& frame, double scale, float distance) {
  const float least = leastProduct(scale, frame.longest());
  return {{frame.error(), kDifferenceError, least, distance},
          {frame.preciseError(), kDifferenceError, least, distance}};
}

/// Returns the corners of the two trees of `in`, a PairInput. They must have the same coordinates.
template <typename Input>
PairSource sourceOf(const Input& in) {
  const auto cornersOf = [](const WideTree& tree) -> CornerSource {
    return {tree.slots().leafSlots(), tree.positions(), tree.residuals()};
  };
  return {cornersOf(in.tree1), cornersOf(in.tree2)};
}
/// Removes the pairs that are certainly separated along a normal of a triangle, or along a
/// direction perpendicular to a normal and an edge. Returns the number of the others.
inline int keepByNormals(const PairSource& from, LeafIndexPair* pairs, int size,
                         const PairErrors& errors) {
  size = pairTests().keepByPlanes(from, pairs, size, errors.coarse);
  return pairTests().keepByNormals(from, pairs, size, errors.fine);
}

/// Sets corners[c] to corner c of a leaf's four triangles. `positions`: positions or residuals of
/// the leaf's tree, by slot. Lanes without a triangle repeat the first triangle.
ADAPTIVE_BVH_INLINE void gatherLeaf(const VertexSlots& slots, const Float4* positions,
                                    const WideNode& leaf, Vector4x3 (&corners)[3]) {
  std::array<unsigned, 4> triangles;
  for (int i = 0; i < 4; ++i)
    triangles[std::size_t(i)] = static_cast<unsigned>(leaf.first + (i < leaf.count ? i : 0));
  gatherCorners(slots, positions, triangles, corners);
}

/// Sets p[c] and q[c] to corner c of the first and of the second triangle of four pairs, in the
/// first tree's coordinates. `in`: PairInput; `frame`: SameFrame or RelativeFrame.
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

/// Appends copies of the last of `size` pairs up to a multiple of four. Needs room for three more.
ADAPTIVE_BVH_INLINE void padToFour(LeafIndexPair* pairs, int size) {
  for (int i = size; i % 4; ++i) pairs[i] = pairs[size - 1];
}

}  // namespace adaptive_bvh
