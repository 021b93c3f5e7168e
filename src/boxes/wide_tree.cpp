#include "boxes/wide_tree.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/scratch.h"

namespace adaptive_bvh {
namespace {

/// Prefetches the cache line of an address for writing. If another processor has read the line, a
/// write would stall until the line is exclusive; an ordinary prefetch does not request that.
[[gnu::always_inline]] inline void prefetchToWrite(const void* address) {
#if defined(__x86_64__)
  // As assembly, because GCC emits the instruction only for newer processors. All 64-bit processors
  // execute or ignore it.
  asm volatile("prefetchw %0" : : "m"(*static_cast<const char*>(address)));
#else
  __builtin_prefetch(address, 1);
#endif
}

/// Chooses the lanes of the wide node that replaces the binary node `root`: up to four binary nodes
/// below it, in the order of the leaves. Starts with the children of `root`, and replaces the
/// largest lane by its children while there are fewer than four.
class ChildLanes {
 public:
  ChildLanes(const Scratch<OrderedTree::Node>& nodes, int root) : nodes_(nodes) {
    expand(root, 0);
    const bool is_leaf = binary(root).count <= 4;
    for (int lane; count < 4 && (lane = largest(is_leaf)) >= 0;) expand(node[lane], lane);
  }

  int node[4], count = 1;  ///< the binary node of each lane; number of lanes

 private:
  const OrderedTree::Node& binary(int i) const { return nodes_[static_cast<std::size_t>(i)]; }
  /// Sets `lane` to the two children of a binary node, moving later lanes up, or to the node itself
  /// if it has none.
  void expand(int i, int lane) {
    if (binary(i).isLeaf()) {
      node[lane] = i;
      return;
    }
    for (int k = count; k > lane + 1; --k) node[k] = node[k - 1];
    node[lane] = binary(i).left;
    node[lane + 1] = binary(i).right;
    ++count;
  }
  /// The lane to replace by its children: the one with the most triangles, or -1. In a wide leaf,
  /// lanes are replaced down to single triangles; in an inner node, only lanes with more triangles
  /// than fit in a leaf.
  int largest(bool is_leaf) const {
    unsigned most = is_leaf ? 1 : 4;
    int found = -1;
    for (int i = 0; i < count; ++i)
      if (binary(node[i]).count > most) {
        most = binary(node[i]).count;
        found = i;
      }
    return found;
  }

  const Scratch<OrderedTree::Node>& nodes_;
};

}  // namespace

WideTree::WideTree(const OrderedTree& binary, std::shared_ptr<const LeafTriangles> triangles)
    : triangles_(std::move(triangles)) {
  // A binary node to be replaced by a wide one, and the wide parent and lane that get its number.
  struct Open {
    int root, parent, lane, depth;
  };
  // Most leaves have three or four triangles, so this is usually enough; growing would copy.
  nodes_.reserve(binary.primitives.size() * 2 / 5 + 1);
  std::int32_t leaves = 0;
  Scratch<Open> open(1, Open{0, -1, 0, 1});
  while (!open.empty()) {
    const auto [root, parent, lane, depth] = open.back();
    open.pop_back();
    const int number = size();
    if (parent >= 0) nodes_[static_cast<std::size_t>(parent)].below[lane] = number;
    depth_ = std::max(depth_, depth);
    const ChildLanes lanes(binary.nodes, root);
    const OrderedTree::Node& top = binary.nodes[static_cast<std::size_t>(root)];
    WideNode node{kEmptyBoxes, {-1, -1, -1, -1}, -1, unsigned(lanes.count), -1};
    if (top.count <= 4) {
      node.first = static_cast<std::int32_t>(top.first);
      node.leaf = leaves++;
    } else {
      for (int i = lanes.count; i-- > 0;) open.push_back({lanes.node[i], number, i, depth + 1});
    }
    nodes_.push_back(node);
  }
  nodes_.shrink_to_fit();
}

void WideTree::assignTopology(const WideTree& other) {
  if (triangles_ == other.triangles_) return;  // already copied
  nodes_ = other.nodes_;                       // first, as it may throw
  triangles_ = other.triangles_;
  depth_ = other.depth_;
}

void WideTree::reserve(const TaskPool& pool) {
  positions_.resize(slots().size());
  residuals_.resize(slots().size());
  postponed_.resize(std::size_t(pool.parts()) * (std::size_t(depth_) + 1));
}

void WideTree::reserve(const WideTree& other) {
  nodes_.reserve(other.nodes_.size());
  positions_.reserve(other.positions_.size());
  residuals_.reserve(other.residuals_.size());
  postponed_.reserve(other.postponed_.size());
}

void WideTree::refit(const fcl::Vector3d* vertices, const BodyCoordinates& coordinates,
                     const TaskPool& pool) {
  reserve(pool);
  coordinates_ = coordinates;
  const int parts = pool.parts();
  // The number of nodes that a part postpones, followed by these nodes.
  const auto postponedBy = [&](int part) { return postponed_.data() + (depth_ + 1) * part; };
  // Other threads may have read positions and nodes in the last query (prefetchToWrite).
  const bool is_shared = pool.size() > 1;
  // Parts begin at block boundaries, so no part needs positions of another part.
  pool.forEach(parts, [&](int part, int) {
    const int begin = blockBegin(partBegin(size(), parts, part)),
              end = blockBegin(partBegin(size(), parts, part + 1));
    readPositions(vertices, firstSlot(begin), firstSlot(end), is_shared);
    *postponedBy(part) = refitNodes(begin, end, is_shared, postponedBy(part) + 1);
  });
  // The postponed nodes, from the last to the first: children before parents.
  for (int part = parts; part-- > 0;)
    for (int i = 1; i <= *postponedBy(part); ++i)
      refitInner(nodes_[static_cast<std::size_t>(postponedBy(part)[i])], nodes_.data());
}

void WideTree::refitNode(const fcl::Vector3d* vertices, int number) {
  WideNode& node = nodes_[static_cast<std::size_t>(number)];
  if (!node.isLeaf()) return refitInner(node, nodes_.data());
  const RoundedCoordinates coordinates(coordinates_);
  for (int i = 0; i < node.count; ++i)
    for (const unsigned slot : slots().slotsOf(std::size_t(node.first) + std::size_t(i)))
      coordinates(vertices[slots().vertices()[slot]], positions_[slot], residuals_[slot]);
  refitLeaf(node);
}

/// The first node at or after `node` where a part may begin: the root, or a leaf whose block of
/// slots no earlier leaf uses; size() if there is none.
int WideTree::blockBegin(int node) const {
  if (node == 0) return 0;
  const auto beginsBlock = [&](const WideNode& leaf) {
    const auto first = static_cast<std::size_t>(leaf.first);
    return first == 0 || slots().blockStart(first) != slots().blockStart(first - 1);
  };
  const auto from = nodes_.begin() + node;
  return static_cast<int>(
      std::find_if(from, nodes_.end(),
                   [&](const WideNode& next) { return next.isLeaf() && beginsBlock(next); }) -
      nodes_.begin());
}

/// The first slot of a part that begins at `node`, a result of blockBegin. Slots before it belong
/// to leaves before it.
std::size_t WideTree::firstSlot(int node) const {
  if (node == 0) return 0;
  if (node == size()) return slots().size();
  return slots().blockStart(static_cast<std::size_t>(nodes_[static_cast<std::size_t>(node)].first));
}

/// Converts the positions of a range of slots to the tree's coordinates, two at a time.
void WideTree::readPositions(const fcl::Vector3d* vertices, std::size_t begin, std::size_t end,
                             bool is_shared) {
  constexpr std::size_t kAhead = 32, kInALine = 4;  // slots to prefetch ahead; slots in a line
  const RoundedCoordinates coordinates(coordinates_);
  const std::vector<unsigned>& vertex_of = slots().vertices();
  const auto position = [&](std::size_t i) -> fcl::Vector3d { return vertices[vertex_of[i]]; };
  std::size_t i = begin;
  for (; i + 2 <= end; i += 2) {
    if (is_shared && (i - begin) % kInALine == 0 && i + kAhead < end) {
      prefetchToWrite(&positions_[i + kAhead]);
      prefetchToWrite(&residuals_[i + kAhead]);
    }
    coordinates(position(i), position(i + 1), &positions_[i], &residuals_[i]);
  }
  if (i < end) coordinates(position(i), positions_[i], residuals_[i]);
}

/// Refits a part of the nodes, from the last to the first, except for nodes with descendants from
/// `end` on. Writes these to `postponed`, and returns their number. Nodes are in depth-first order,
/// so these are ancestors of node `end`, fewer than the depth of the tree: the last child of each
/// is in a later part, or was postponed just before.
int WideTree::refitNodes(int begin, int end, bool is_shared, int* postponed) {
  constexpr int kAhead = 12;  // nodes to prefetch ahead
  int count = 0;
  const auto isPending = [&](int node) {
    return node >= end || (count > 0 && node == postponed[count - 1]);
  };
  for (int i = end; i-- > begin;) {
    WideNode& node = nodes_[static_cast<std::size_t>(i)];
    if (is_shared && i - kAhead >= begin) {  // boxes occupy parts of both cache lines
      const WideNode& ahead = nodes_[static_cast<std::size_t>(i - kAhead)];
      prefetchToWrite(&ahead);
      prefetchToWrite(ahead.below);
    }
    if (node.isLeaf())
      refitLeaf(node);
    else if (isPending(node.below[node.count - 1]))
      postponed[count++] = i;
    else
      refitInner(node, nodes_.data());
  }
  return count;
}

/// Computes four boxes without branches; missing triangles repeat the last one, and their boxes are
/// set empty. All slots of a leaf are in one block.
void WideTree::refitLeaf(WideNode& node) const {
  const int count = node.count;
  const LeafSlots* const triangles = slots().leafSlots() + node.first;
  const Float4* const block = positions_.data() + triangles->block;
  Float4 low[4], high[4];
  for (int i = 0; i < 4; ++i) {
    const auto& corners = triangles[std::min(i, count - 1)].offset;
    const Float4 &a = block[corners[0]], &b = block[corners[1]], &c = block[corners[2]];
    low[i] = float4::lower<Float4>(float4::lower<Float4>(a, b), c);
    high[i] = float4::upper<Float4>(float4::upper<Float4>(a, b), c);
  }
  const float4::Columns lows = float4::columns(low[0], low[1], low[2], low[3]);
  const float4::Columns highs = float4::columns(high[0], high[1], high[2], high[3]);
  const auto exists = Int4{0, 1, 2, 3} < Int4{count, count, count, count};
  const Float4 margin = float4::all(kBoxMargin), nowhere = float4::all(kNowhere);
  const auto set = [&](int k, const Float4& from, const Float4& to) {
    node.boxes.low[k] = exists ? from - margin : nowhere;
    node.boxes.high[k] = exists ? to + margin : -nowhere;
  };
  set(0, lows.x, highs.x);
  set(1, lows.y, highs.y);
  set(2, lows.z, highs.z);
}

}  // namespace adaptive_bvh
