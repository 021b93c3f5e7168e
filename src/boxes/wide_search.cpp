#include "boxes/wide_search.h"

#include <algorithm>

#include "base/scratch.h"
#include "boxes/flat_patches.h"

namespace adaptive_bvh {

/// The state of one traversal: a stack of pairs of nodes still to visit, and the leaf pairs found
/// but not yet passed to the sink.
class WideSearch::Walk {
 public:
  static constexpr int kMostBelow = 16;  ///< number of pairs of children of a pair of nodes

  /// The largest size of the stack: visiting a pair removes it and adds at most kMostBelow.
  static std::size_t stackSize(const WideTrees& trees, const NodePairs& from) {
    return static_cast<std::size_t>(from.end - from.begin + kMostBelow * trees.depth);
  }

  /// `stack` is memory for stackSize() pairs.
  ADAPTIVE_BVH_INLINE Walk(const WideTrees& trees, NodePair* stack)
      : first_(trees.first),
        second_(trees.second),
        trees_(trees),
        has_frame_(!trees.frame.isIdentity()),
        bottom_(stack),
        top_(stack) {}

  /// Traverses all pairs below the pairs `from`, until the sink stops. `Sink` is a LeafSink,
  /// possibly of a final type.
  template <typename Sink>
  ADAPTIVE_BVH_INLINE void run(const NodePairs& from, Sink& sink) {
    for (const NodePair* pair = from.end; pair != from.begin;) {
      --pair;
      push(pair->first, pair->second);
    }
    int batch = kFirstBatch;
    while (top_ != bottom_) {
      visit(*--top_);
      if (count_ < batch) continue;
      if (passTo(sink)) return;
      batch = std::min(2 * batch, kBatch);
    }
    if (count_ > 0) passTo(sink);
  }

  /// Visits one pair: pushes the pairs of its children whose boxes overlap, or adds it to the leaf
  /// pairs found.
  ADAPTIVE_BVH_INLINE void visit(const NodePair& pair) {
    if (!isWanted(pair)) return;
    if (isSelfPair(pair))
      testNode(pair.first, isFlat(pair.first));
    else
      testPair(pair);
  }

  bool isWanted(const NodePair& pair) const {
    return !trees_.moved.first || trees_.moved.contain(pair);
  }
  /// Whether a pair of nodes of one tree is a node with itself.
  bool isSelfPair(const NodePair& pair) const {
    return trees_.is_self && pair.first == pair.second;
  }
  /// Whether a node is flat; false for a leaf.
  bool isFlat(int node) const {
    return trees_.flat && !first_[node].isLeaf() && trees_.flat->contains(node);
  }

  ADAPTIVE_BVH_INLINE void testPair(const NodePair& pair) {
    const WideNode &a = first_[pair.first], &b = second_[pair.second];
    const unsigned bits = overlaps(a.boxes, boxesInFirst(pair.second));
    if (!bits) return;
    if (a.isLeaf() && b.isLeaf())
      found_[count_++] = {&a, &b, bits};
    else if (a.isLeaf())
      forEach(anyOfSecond(bits), [&](int j, int) { push(pair.first, b.below[j]); });
    else if (b.isLeaf())
      forEach(anyOfFirst(bits), [&](int i, int) { push(a.below[i], pair.second); });
    else
      forEach(bits, [&](int i, int j) { push(a.below[i], b.below[j]); });
  }

  /// Tests a node against itself: each pair of its children once, or none if it is flat.
  void testNode(int number, bool is_flat) {
    const WideNode& node = first_[number];
    if (is_flat) return;
    constexpr unsigned kEachPairOnce = 0x7310;  // the bits 4 j + i with i < j
    const unsigned bits = overlaps(node.boxes, boxesInFirst(number)) & kEachPairOnce;
    if (node.isLeaf()) {
      found_[count_++] = {&node, &node, bits};
      return;
    }
    forEach(bits, [&](int i, int j) { push(node.below[i], node.below[j]); });
    for (int i = node.count; i-- > 0;) push(node.below[i], node.below[i]);
  }

  bool isDone() const { return top_ == bottom_; }
  NodePair pop() { return *--top_; }
  /// Discards the leaf pairs found so far.
  void forgetFound() { count_ = 0; }

 private:
  // The first batches are small, for queries that need only one pair.
  static constexpr int kFirstBatch = 4, kBatch = 32;

  /// Passes the leaf pairs found to the sink. Returns whether the sink stops the search.
  template <typename Sink>
  ADAPTIVE_BVH_INLINE bool passTo(Sink& sink) {
    const int count = count_;
    count_ = 0;
    return sink.take(found_, count);
  }

  ADAPTIVE_BVH_INLINE void push(int first, int second) {
    *top_++ = {first, second};
    prefetch(first_[first]);
    prefetch(second_[second]);
  }
  /// Prefetches both cache lines.
  ADAPTIVE_BVH_INLINE static void prefetch(const WideNode& node) {
    __builtin_prefetch(&node);
    __builtin_prefetch(node.below);
  }

  /// The boxes of a node of the second tree in the first tree's coordinates. Consecutive pairs
  /// often share the node, so the last result is cached.
  ADAPTIVE_BVH_INLINE const Boxes4& boxesInFirst(int node) {
    if (!has_frame_) return second_[node].boxes;
    if (node != transformed_node_) transformed_ = trees_.frame(second_[node].boxes);
    transformed_node_ = node;
    return transformed_;
  }

  /// Given the bits of `overlaps`: a bit for each box of the first node that overlaps any box of
  /// the second, and vice versa.
  ADAPTIVE_BVH_INLINE static unsigned anyOfFirst(unsigned bits) {
    return (bits | bits >> 4 | bits >> 8 | bits >> 12) & 15;
  }
  ADAPTIVE_BVH_INLINE static unsigned anyOfSecond(unsigned bits) {
    unsigned any = bits | bits >> 1;
    any = (any | any >> 2) & 0x1111;
    return (any | any >> 3 | any >> 6 | any >> 9) & 15;
  }
  /// Calls act(i, j) for each set bit 4 j + i, from the last to the first. The last pair pushed is
  /// visited first, so nodes are visited in memory order, and in a parallel traversal each thread
  /// mostly reads nodes that it has refitted.
  template <typename Act>
  ADAPTIVE_BVH_INLINE static void forEach(unsigned bits, Act&& act) {
    while (bits) {
      const int bit = 31 - __builtin_clz(bits);
      bits ^= 1u << bit;
      act(bit & 3, bit >> 2);
    }
  }

  const WideNode *const first_, *const second_;
  const WideTrees& trees_;
  const bool has_frame_;
  NodePair *const bottom_, *top_;  ///< the stack
  int transformed_node_ = -1;      ///< the node of transformed_, the cache of boxesInFirst
  Boxes4 transformed_;
  LeavesFound found_[kBatch];
  int count_ = 0;
};

void WideSearch::run(const NodePairs& from, LeafSink& sink) {
  packs::hasAvx2() ? runWithAvx2(from, sink) : runAnywhere(from, sink);
}

void WideSearch::runAnywhere(const NodePairs& from, LeafSink& sink) {
  Scratch<NodePair> stack(Walk::stackSize(trees_, from));
  Walk(trees_, stack.data()).run(from, sink);
}

ADAPTIVE_BVH_WITH_AVX2 void WideSearch::runWithAvx2(const NodePairs& from, LeafSink& sink) {
  Scratch<NodePair> stack(Walk::stackSize(trees_, from));
  Walk(trees_, stack.data()).run(from, sink);
}

bool WideSearch::hasMorePairs(int than) {
  const NodePair roots{0, 0};
  const NodePairs from{&roots, &roots + 1};
  Scratch<NodePair> stack(Walk::stackSize(trees_, from));
  Walk walk(trees_, stack.data());
  walk.visit(roots);
  for (int visited = 1; !walk.isDone(); ++visited) {
    if (visited > than) return true;
    walk.visit(walk.pop());
    walk.forgetFound();
  }
  return false;
}

void WideSearch::split(std::vector<NodePair>& pairs, std::size_t enough, const TaskPool& pool) {
  std::vector<NodePair> lower;     // the pairs of the next level
  std::vector<std::uint8_t> flat;  // by pair: whether it is a flat node with itself
  for (bool changed = true; changed && pairs.size() < enough; pairs.swap(lower)) {
    changed = false;
    lower.clear();
    NodePair stack[Walk::kMostBelow];
    Walk walk(trees_, stack);
    flat.assign(pairs.size(), 0);
    if (trees_.flat)
      pool.forEach(static_cast<int>(pairs.size()), [&](int i, int) {
        const NodePair& pair = pairs[static_cast<std::size_t>(i)];
        flat[static_cast<std::size_t>(i)] = walk.isSelfPair(pair) && walk.isFlat(pair.first);
      });
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const NodePair pair = pairs[i];
      if (!walk.isWanted(pair)) continue;
      if (trees_.first[pair.first].isLeaf() && trees_.second[pair.second].isLeaf()) {
        lower.push_back(pair);
        continue;
      }
      if (walk.isSelfPair(pair))
        walk.testNode(pair.first, flat[i] != 0);
      else
        walk.testPair(pair);
      while (!walk.isDone()) lower.push_back(walk.pop());
      changed = true;
    }
  }
}

}  // namespace adaptive_bvh
