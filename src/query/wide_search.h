#pragma once

#include <type_traits>
#include <utility>
#include <vector>

#include "boxes/wide_tree.h"
#include "geometry/scratch.h"
#include "threads/task_pool.h"

namespace adaptive_bvh {

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

/// Whether a visitor leaves flat nodes out.
template <typename Visitor, typename = void>
struct SkipsFlatNodes : std::false_type {};
template <typename Visitor>
struct SkipsFlatNodes<Visitor, std::void_t<decltype(std::declval<Visitor&>().isFlat(0))>>
    : std::true_type {};

/// A node of each of two four-wide trees; of one tree with itself a node twice, too.
struct NodePair {
  int first, second;
};
/// Some, one after the other.
struct NodePairs {
  const NodePair *begin, *end;
};

/// All pairs of triangles whose boxes overlap, of two four-wide trees or of one with itself, from
/// the roots or other pairs of nodes down, depth first. Where only one of two nodes is a leaf, its
/// triangles are tested against the boxes of the other.
///
///   Visitor::foundLeaves(a, b, pairs), foundLeaf(a, pairs)
///                          two leaves with such triangles, or one with itself; bit 4 j + i of
///                          `pairs` for triangle i of `a` and j of `b`
///   Visitor::isDone()      whether the answer is found
///   Visitor::isFlat(node)  where it has this: of an inner node of one tree, whether nothing below
///                          it need be found
///   frame(boxes)           boxes of the second tree in the coordinates of the first
///   Frame::kIsIdentity     whether that leaves them as they are
template <typename Frame, bool kIsSelf, typename Visitor>
class WideSearch {
 public:
  WideSearch(const WideNode* first, const WideNode* second, const Frame& frame, Visitor& visitor)
      : first_(first), second_(second), frame_(frame), visitor_(visitor) {}

  /// `depth`: of both trees, added.
  void run(const NodePairs& from, int depth) {
    packs::hasAvx2() ? runWithAvx2(from, depth) : runAnywhere(from, depth);
  }
  /// The same code, compiled for every processor, and for those with AVX2: there it takes 2 to 5 %
  /// less time. The results are the same.
  void runAnywhere(const NodePairs& from, int depth) { walk(from, depth); }
  ADAPTIVE_BVH_WITH_AVX2 void runWithAvx2(const NodePairs& from, int depth) { walk(from, depth); }

  /// Puts the pairs below in the place of each pair, level by level, until there are `enough` of
  /// them, or no more. To run from each, in their order, is to run from those that there were. The
  /// visitor's isFlat is called on all threads.
  void split(std::vector<NodePair>& pairs, std::size_t enough, const TaskPool& pool) {
    std::vector<NodePair> lower;
    for (bool changed = true; changed && pairs.size() < enough; pairs.swap(lower)) {
      changed = false;
      lower.clear();
      const std::vector<std::uint8_t> flat = areFlat(pairs, pool);
      for (std::size_t i = 0; i < pairs.size(); ++i) {
        const NodePair pair = pairs[i];
        if (first_[pair.first].isLeaf() && second_[pair.second].isLeaf()) {
          lower.push_back(pair);
          continue;
        }
        NodePair below[kMostBelow];
        top_ = below;
        if (isTwice(pair))
          testNode(pair.first, flat[i]);
        else
          testPair(pair);
        while (top_ != below) lower.push_back(*--top_);
        changed = true;
      }
    }
  }

  long boxTests() const { return box_tests_; }

 private:
  static constexpr int kMostBelow = 16;

  ADAPTIVE_BVH_INLINE void walk(const NodePairs& from, int depth) {
    // A pair that is left makes room for sixteen below it at most.
    Scratch<NodePair> open(static_cast<std::size_t>(from.end - from.begin + kMostBelow * depth));
    top_ = open.data();
    for (const NodePair* pair = from.end; pair-- != from.begin;) push(pair->first, pair->second);
    while (top_ != open.data() && !visitor_.isDone()) {
      const NodePair pair = *--top_;
      test(pair);
    }
  }
  static bool isTwice(const NodePair& pair) { return kIsSelf && pair.first == pair.second; }
  ADAPTIVE_BVH_INLINE void test(const NodePair& pair) {
    if (isTwice(pair))
      testNode(pair.first, isFlat(pair.first));
    else
      testPair(pair);
  }
  ADAPTIVE_BVH_INLINE void push(int first, int second) {
    *top_++ = {first, second};
    prefetch(first_[first]);
    prefetch(second_[second]);
  }

  /// Both cache lines.
  ADAPTIVE_BVH_INLINE static void prefetch(const WideNode& node) {
    __builtin_prefetch(&node);
    __builtin_prefetch(node.below);
  }

  ADAPTIVE_BVH_INLINE void testPair(const NodePair& pair) {
    const WideNode &a = first_[pair.first], &b = second_[pair.second];
    const unsigned bits = overlaps(a.boxes, inFirst(pair.second));
    box_tests_ += a.count * b.count;
    if (!bits) return;
    if (a.isLeaf() && b.isLeaf())
      visitor_.foundLeaves(a, b, bits);
    else if (a.isLeaf())
      forEach(anyOfSecond(bits), [&](int j, int) { push(pair.first, b.below[j]); });
    else if (b.isLeaf())
      forEach(anyOfFirst(bits), [&](int i, int) { push(a.below[i], pair.second); });
    else
      forEach(bits, [&](int i, int j) { push(a.below[i], b.below[j]); });
  }

  /// The boxes of a node of the second tree. Pairs that follow each other often share it.
  ADAPTIVE_BVH_INLINE const Boxes4& inFirst(int node) {
    if constexpr (Frame::kIsIdentity) return second_[node].boxes;
    if (node != turned_node_) turned_ = frame_(second_[node].boxes);
    turned_node_ = node;
    return turned_;
  }

  /// A node of one tree against itself: every pair below once; none where it is flat.
  void testNode(int number, bool is_flat) {
    const WideNode& node = first_[number];
    if (is_flat) return;
    constexpr unsigned kUpper = 0x7310;  // i < j
    const unsigned bits = overlaps(node.boxes, inFirst(number)) & kUpper;
    box_tests_ += node.count * (node.count - 1) / 2;
    if (node.isLeaf()) return visitor_.foundLeaf(node, bits);
    forEach(bits, [&](int i, int j) { push(node.below[i], node.below[j]); });
    for (int i = node.count; i-- > 0;) push(node.below[i], node.below[i]);
  }

  /// Never of a leaf.
  ADAPTIVE_BVH_INLINE bool isFlat(int node) {
    if constexpr (SkipsFlatNodes<Visitor>::value)
      return !first_[node].isLeaf() && visitor_.isFlat(node);
    else
      return false;
  }
  std::vector<std::uint8_t> areFlat(const std::vector<NodePair>& pairs, const TaskPool& pool) {
    std::vector<std::uint8_t> flat(pairs.size(), 0);
    if constexpr (kIsSelf && SkipsFlatNodes<Visitor>::value)
      pool.forEach(static_cast<int>(pairs.size()), [&](int i, int) {
        const NodePair& pair = pairs[static_cast<std::size_t>(i)];
        flat[static_cast<std::size_t>(i)] = isTwice(pair) && isFlat(pair.first);
      });
    return flat;
  }

  /// Of the bits of `overlaps`: which boxes of the first overlap any of the second; and of the
  /// second, any of the first.
  ADAPTIVE_BVH_INLINE static unsigned anyOfFirst(unsigned bits) {
    return (bits | bits >> 4 | bits >> 8 | bits >> 12) & 15;
  }
  ADAPTIVE_BVH_INLINE static unsigned anyOfSecond(unsigned bits) {
    unsigned any = bits | bits >> 1;
    any = (any | any >> 2) & 0x1111;
    return (any | any >> 3 | any >> 6 | any >> 9) & 15;
  }
  /// From the last to the first, which is the order to push them in: so nodes are visited as they
  /// lie in memory, and of a walk in tasks each thread mostly reads what it has refitted.
  template <typename Do>
  ADAPTIVE_BVH_INLINE static void forEach(unsigned bits, Do&& act) {
    while (bits) {
      const int bit = 31 - __builtin_clz(bits);
      bits ^= 1u << bit;
      act(bit & 3, bit >> 2);
    }
  }

  const WideNode *const first_, *const second_;
  const Frame& frame_;
  Visitor& visitor_;
  NodePair* top_ = nullptr;
  int turned_node_ = -1;
  Boxes4 turned_;
  long box_tests_ = 0;
};

}  // namespace adaptive_bvh
