#pragma once

#include <vector>

#include "base/box.h"
#include "boxes/wide_tree.h"
#include "query/pair_corners.h"
#include "query/tree_pair.h"

namespace adaptive_bvh {

/// Repeats the vector of one lane four times.
ADAPTIVE_BVH_INLINE Vector4x3 laneOf(const Vector4x3& v, int i) {
  return {float4::all(v.x[i]), float4::all(v.y[i]), float4::all(v.z[i])};
}

/// Slabs around the contents of the small boxes of a four-wide tree: between two planes across the
/// sum of the triangles' normals. On a smooth surface a slab is much thinner than a box.
class NodeSlabs {
 public:
  /// The slabs of a node's four boxes. A box without a slab has zeros.
  struct Slabs {
    Vector4x3 normal = {};          ///< of length 1 up to rounding
    Float4 middle = {}, half = {};  ///< range of the contents along the normal

    /// The slab of one box, repeated four times.
    ADAPTIVE_BVH_INLINE Slabs lane(int i) const {
      return {laneOf(normal, i), float4::all(middle[i]), float4::all(half[i])};
    }
  };

  /// Computes the slabs of a tree, in the coordinates to which `frame` maps it.
  template <typename Frame>
  void compute(const WideTree& tree, const Frame& frame);
  const Slabs& operator[](int node) const { return slabs_[static_cast<std::size_t>(node)]; }

 private:
  /// What is known of a node when its parent is reached.
  struct Subtree {
    fcl::Vector3f normal;  ///< sum of the triangles' normals, not normalized
    int end;               ///< the number after those of the nodes below
  };

  std::vector<Subtree> subtrees_;
  std::vector<Slabs> slabs_;
};

/// Lower bounds of the distances between boxes of two trees, along the normals of their slabs. The
/// contents of a box are in its slab and in the box, which together bound their extent along the
/// normal of another slab. In single precision, in the first tree's coordinates:
/// docs/bounds.md, 18.
class SlabSeparation {
 public:
  /// Computes the slabs of both trees. Requires RelativeFrame::isPrecise.
  void compute(const TreePair& trees);
  /// The cost of `compute`, in box tests.
  static long cost(const TreePair& trees) {
    return 24 * static_cast<long>(trees.first().slots().leaves() + trees.second().slots().leaves());
  }
  /// Sets the limit for `apart`, in the first tree's unit.
  void setLimit(double distance) { limit_ = static_cast<float>(distance * (1 + 0x1p-20)); }

  /// Returns which of `pairs` are certainly farther apart than the limit: bit 4 j + i for box i of
  /// node `first` and j of node `second`, of which none is a leaf. `boxes1`, `boxes2`: their boxes.
  unsigned apart(int first, const Boxes4& boxes1, int second, const Boxes4& boxes2,
                 unsigned pairs) const {
    const Slabs &a = first_[first], &b = second_[second];
    const Float4 enough = float4::all(limit_ + margin_);
    const Middles of_a(boxes1), of_b(boxes2);
    unsigned apart = 0;
    for (int j = 0; j < 4; ++j) {
      if (!(pairs >> (4 * j) & 15)) continue;
      const Slabs b_j = b.lane(j);
      const Float4 cosine = vectors::dot(b_j.normal, a.normal),
                   gap = float4::upper<Float4>(gapAlong(b_j, a, of_a, cosine),
                                               gapAlong(a, b_j, of_b.lane(j), cosine));
      apart |= float4::bits(gap > enough) << (4 * j);
    }
    return apart & pairs;
  }

 private:
  using Slabs = NodeSlabs::Slabs;

  /// The middles and half sides of four boxes.
  struct Middles {
    Vector4x3 middle, half;

    Middles(const Vector4x3& of_boxes, const Vector4x3& half_sides)
        : middle(of_boxes), half(half_sides) {}
    ADAPTIVE_BVH_INLINE explicit Middles(const Boxes4& boxes) {
      const Vector4x3 low = {boxes.low[0], boxes.low[1], boxes.low[2]},
                      high = {boxes.high[0], boxes.high[1], boxes.high[2]};
      middle = vectors::scaled(vectors::sum(low, high), float4::all(.5f));
      half = vectors::scaled(vectors::difference(high, low), float4::all(.5f));
    }
    ADAPTIVE_BVH_INLINE Middles lane(int i) const { return {laneOf(middle, i), laneOf(half, i)}; }
  };

  /// The gap between slabs `a` and what is in both slabs `b` and their boxes, along the normals of
  /// `a`. `cosine`: that of both normals.
  ADAPTIVE_BVH_INLINE static Float4 gapAlong(const Slabs& a, const Slabs& b, const Middles& boxes,
                                             const Float4& cosine) {
    using float4::absolute;
    // a.normal = cosine b.normal + across: slab b bounds the first part, the box the second one.
    const Vector4x3 across = vectors::difference(a.normal, vectors::scaled(b.normal, cosine));
    const Float4 middle = cosine * b.middle + vectors::dot(across, boxes.middle);
    const Float4 half = absolute(cosine) * b.half + absolute(across.x) * boxes.half.x +
                        absolute(across.y) * boxes.half.y + absolute(across.z) * boxes.half.z;
    return absolute(middle - a.middle) - half - a.half;
  }

  NodeSlabs first_, second_;
  float limit_ = 0;
  float margin_ = 0;  ///< bound of the error of a gap
};

}  // namespace adaptive_bvh
