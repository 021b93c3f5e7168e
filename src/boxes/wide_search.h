#pragma once

#include <cstdint>
#include <type_traits>
#include <vector>

#include "base/frame_change.h"
#include "base/task_pool.h"
#include "boxes/wide_tree.h"

namespace adaptive_bvh {

class FlatPatches;

/// The overlapping pairs of boxes: bit 4 j + i for box i of `a` and box j of `b`.
ADAPTIVE_BVH_INLINE unsigned overlaps(const Boxes4& a, const Boxes4& b) {
  unsigned bits = 0;
  const auto test = [&](auto lane) __attribute__((always_inline)) {
    constexpr int j = decltype(lane)::value;
    using float4::broadcast;
    bits |=
        float4::bits((a.low[0] <= broadcast<j>(b.high[0])) & (broadcast<j>(b.low[0]) <= a.high[0]) &
                     (a.low[1] <= broadcast<j>(b.high[1])) & (broadcast<j>(b.low[1]) <= a.high[1]) &
                     (a.low[2] <= broadcast<j>(b.high[2])) & (broadcast<j>(b.low[2]) <= a.high[2]))
        << (4 * j);
  };
  test(std::integral_constant<int, 0>());
  test(std::integral_constant<int, 1>());
  test(std::integral_constant<int, 2>());
  test(std::integral_constant<int, 3>());
  return bits;
}

/// A pair of nodes of two four-wide trees, or of one tree with itself, where both may be the same
/// node.
struct NodePair {
  int first, second;
};
/// A range of node pairs.
struct NodePairs {
  const NodePair *begin, *end;
};

/// Transforms boxes of the second tree for comparison with the first tree's boxes.
class BoxFrame {
 public:
  /// `change` maps to the first tree's coordinates; null if both trees have the same coordinates.
  /// Boxes are enlarged by `distance`, in the first tree's units, so that the boxes of triangles
  /// within that distance overlap. Empty boxes still overlap nothing.
  BoxFrame(const FrameChange* change, double distance)
      : change_(change),
        grows_(distance > 0),
        growth_(float4::all(static_cast<float>((distance < kMost ? distance : kMost) * kUp))) {}

  bool isIdentity() const { return !change_ && !grows_; }
  ADAPTIVE_BVH_INLINE Boxes4 operator()(const Boxes4& boxes) const {
    Boxes4 transformed = change_ ? (*change_)(boxes) : boxes;
    for (int k = 0; k < 3; ++k) {
      transformed.low[k] -= growth_;
      transformed.high[k] += growth_;
    }
    return transformed;
  }

 private:
  static constexpr double kMost = 1e20;  // far less than the coordinates of an empty box
  /// Exceeds the rounding errors of the distance and of two sums.
  static constexpr double kUp = 1 + 1. / (1 << 20);

  const FrameChange* change_;
  bool grows_;
  Float4 growth_;
};

/// Upper bound of the squared difference of two points, one of each box; NaN if it overflows.
ADAPTIVE_BVH_INLINE float largestSquare(const Box& a, const Box& b) {
  const Float4 apart = float4::upper<Float4>(a.high - b.low, b.high - a.low);
  return float4::dot(apart, apart);
}

/// For the nodes of two trees, by number: a box around the displacements of the points below, in
/// units of a limit. Only pairs of nodes are searched below which two points may have moved by more
/// than the limit, one relative to the other. Null for all pairs.
struct MovedNodes {
  const Box *first = nullptr, *second = nullptr;

  ADAPTIVE_BVH_INLINE bool contain(const NodePair& pair) const {
    return !(largestSquare(first[pair.first], second[pair.second]) <= 1);
  }
};

/// The input of a search: two trees, or one tree with itself.
struct WideTrees {
  const WideNode *first, *second;  ///< the roots
  int depth;                       ///< sum of both depths
  BoxFrame frame;
  bool is_self = false;
  /// For one tree with itself: inner nodes below which no pairs need to be found; or null.
  const FlatPatches* flat = nullptr;
  /// The pairs of nodes to search, if not all. A node's box encloses those of its children.
  MovedNodes moved = {};
};

/// Two leaves with triangles whose boxes overlap, or a leaf with itself: bit 4 j + i of `pairs` for
/// triangle i of the first and triangle j of the second.
struct LeavesFound {
  const WideNode *first, *second;
  unsigned pairs;
};

/// Receives the leaf pairs that a WideSearch finds, in batches.
class LeafSink {
 public:
  /// Returns true to stop the search.
  virtual bool take(const LeavesFound* found, int count) = 0;

 protected:
  ~LeafSink() = default;
};

/// Finds all pairs of triangles whose boxes overlap, of two four-wide trees or of one with itself,
/// depth first from the roots or from given pairs of nodes. If only one of two nodes is a leaf, its
/// triangles are tested against the boxes of the other node.
class WideSearch {
 public:
  explicit WideSearch(const WideTrees& trees) : trees_(trees) {}

  /// Passes all leaf pairs to the sink until it stops the search.
  void run(const NodePairs& from, LeafSink& sink);
  /// Variants of `run` compiled for every processor and for AVX2, which takes 2 to 5 % less time.
  /// The results are equal.
  void runAnywhere(const NodePairs& from, LeafSink& sink);
  void runWithAvx2(const NodePairs& from, LeafSink& sink);

  /// Whether more than `than` pairs of nodes overlap, not counting the roots.
  bool hasMorePairs(int than);

  /// Replaces pairs by the pairs of their children, level by level, until there are `enough` pairs
  /// or only leaves. Expanding pairs preserves the traversal order. Tests on all threads whether
  /// nodes are flat.
  void split(std::vector<NodePair>& pairs, std::size_t enough, const TaskPool& pool);

 private:
  class Walk;

  const WideTrees trees_;
};

}  // namespace adaptive_bvh
