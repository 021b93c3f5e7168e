#pragma once

#include <type_traits>
#include <vector>

#include "base/frame_change.h"
#include "base/task_pool.h"
#include "boxes/wide_tree.h"

namespace adaptive_bvh {

class FlatPatches;

/// Which pairs of four and four boxes overlap: bit 4 j + i for box i of `a` and box j of `b`.
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

/// A node of each of two four-wide trees; of one tree with itself a node twice, too.
struct NodePair {
  int first, second;
};
/// Some, one after the other.
struct NodePairs {
  const NodePair *begin, *end;
};

/// How boxes of the second tree are compared with the first's.
class BoxFrame {
 public:
  /// `change`: into the first's coordinates, or null where both have the same. `distance`: boxes
  /// reach farther by it, in the first tree's units: so boxes of triangles that are at most so far
  /// apart overlap. Of empty boxes nothing comes of it.
  BoxFrame(const FrameChange* change, double distance)
      : change_(change),
        is_grown_(distance > 0),
        by_(float4::all(static_cast<float>((distance < kMost ? distance : kMost) * kUp))) {}

  bool isIdentity() const { return !change_ && !is_grown_; }
  ADAPTIVE_BVH_INLINE Boxes4 operator()(const Boxes4& boxes) const {
    Boxes4 placed = change_ ? (*change_)(boxes) : boxes;
    for (int k = 0; k < 3; ++k) {
      placed.low[k] -= by_;
      placed.high[k] += by_;
    }
    return placed;
  }

 private:
  static constexpr double kMost = 1e20;              // far less than what an empty box lacks
  static constexpr double kUp = 1 + 1. / (1 << 20);  // more than the rounding of d and two sums

  const FrameChange* change_;
  bool is_grown_;
  Float4 by_;
};

/// What is searched: two trees, or one with itself.
struct WideTrees {
  const WideNode *first, *second;  ///< the roots
  int depth;                       ///< of both, added
  BoxFrame frame;
  bool is_self = false;
  /// For one tree: inner nodes below which nothing has to be found; or null.
  const FlatPatches* flat = nullptr;
};

/// Two leaves with triangles whose boxes overlap, or one with itself: bit 4 j + i of `pairs` for
/// triangle i of the first and j of the second.
struct LeavesFound {
  const WideNode *first, *second;
  unsigned pairs;
};

/// Takes what a WideSearch finds, some at a time.
class LeafSink {
 public:
  /// Returns whether that is enough.
  virtual bool take(const LeavesFound* found, int count) = 0;

 protected:
  ~LeafSink() = default;
};

/// All pairs of triangles whose boxes overlap, of two four-wide trees or of one with itself, from
/// the roots or other pairs of nodes down, depth first. Where only one of two nodes is a leaf, its
/// triangles are tested against the boxes of the other.
class WideSearch {
 public:
  explicit WideSearch(const WideTrees& trees) : trees_(trees) {}

  /// Lets the sink take all that is found, until it has enough.
  void run(const NodePairs& from, LeafSink& sink);
  /// The same code, compiled for every processor, and for those with AVX2: there it takes 2 to 5 %
  /// less time. The results are the same.
  void runAnywhere(const NodePairs& from, LeafSink& sink);
  void runWithAvx2(const NodePairs& from, LeafSink& sink);

  /// Whether more than `than` pairs of nodes below the roots overlap.
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
