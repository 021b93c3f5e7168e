#include "tree/wide_tree.h"

#include <algorithm>
#include <cmath>

#include "geometry/scratch.h"
#include "threads/prefetch.h"
#include "volume/each_volume.h"

namespace adaptive_bvh {
namespace {

constexpr float kNowhere = 1e30f;  // stays finite when it is turned and scaled

const Boxes4 kEmpty = {{float4::all(kNowhere), float4::all(kNowhere), float4::all(kNowhere)},
                       {float4::all(-kNowhere), float4::all(-kNowhere), float4::all(-kNowhere)}};

/// FCL's nodes, read without calls into its library.
template <typename BV>
class BinaryNodes {
 public:
  explicit BinaryNodes(const fcl::BVHModel<BV>& model) : nodes_(&model.getBV(0)) {}

  bool isLeaf(int node) const { return nodes_[node].first_child < 0; }
  int left(int node) const { return nodes_[node].first_child; }
  int right(int node) const { return left(node) + 1; }
  int triangle(int leaf) const { return -(nodes_[leaf].first_child + 1); }
  /// How many are at or below it, and its first one, in the order of the leaves.
  int triangles(int node) const { return nodes_[node].num_primitives; }
  int firstTriangle(int node) const { return nodes_[node].first_primitive; }

 private:
  const fcl::BVNode<BV>* nodes_;
};

/// Some of these that make up one wide node.
template <typename BV>
class Collapse {
 public:
  Collapse(const BinaryNodes<BV>& nodes, int root) : nodes_(nodes) {
    binary[inner++] = root;
    add(root, 0);
    const bool is_leaf = nodes.triangles(root) <= 4;
    for (int open; count < 4 && (open = largest(is_leaf)) >= 0;) {
      binary[inner++] = below[open];
      add(below[open], open);
    }
  }

  int below[4], count = 1;
  int binary[3] = {-1, -1, -1}, inner = 0;

 private:
  /// In place of `lane` come the two children of a node; the order of the leaves is kept.
  void add(int node, int lane) {
    if (nodes_.isLeaf(node)) {
      below[lane] = node;
      return;
    }
    for (int i = count; i > lane + 1; --i) below[i] = below[i - 1];
    below[lane] = nodes_.left(node);
    below[lane + 1] = nodes_.right(node);
    ++count;
  }
  /// The lane with the most triangles; a wide leaf is opened down to single ones, another node only
  /// where nodes below it would hold fewer than a leaf could.
  int largest(bool is_leaf) const {
    int most = is_leaf ? 1 : 4, found = -1;
    for (int i = 0; i < count; ++i)
      if (nodes_.triangles(below[i]) > most) {
        most = nodes_.triangles(below[i]);
        found = i;
      }
    return found;
  }

  const BinaryNodes<BV>& nodes_;
};

}  // namespace

template <typename S>
template <typename BV>
void WideTree<S>::adopt(const fcl::BVHModel<BV>& model, const VertexSlots& slots) {
  struct Open {
    int node, parent, lane, depth;
  };
  const BinaryNodes<BV> binary(model);
  const auto triangles = static_cast<std::size_t>(binary.triangles(0));
  nodes_.clear();
  // Most leaves hold three or four, so there is mostly room; to grow means to copy.
  nodes_.reserve(triangles * 2 / 5 + 1);
  depth_ = 0;
  vertices_.resize(triangles);
  triangles_.resize(triangles);
  places_.assign(static_cast<std::size_t>(model.getNumBVs()), -1);
  Scratch<Open> open(1, Open{0, -1, 0, 1});
  while (!open.empty()) {
    const Open at = open.back();
    open.pop_back();
    const int number = size();
    if (at.parent >= 0) nodes_[static_cast<std::size_t>(at.parent)].below[at.lane] = number;
    depth_ = std::max(depth_, at.depth);
    const Collapse<BV> part(binary, at.node);
    WideNode node{kEmpty, {-1, -1, -1, -1}, -1, unsigned(part.count), {-1, -1, -1}};
    std::copy(part.binary, part.binary + 3, node.binary);
    if (binary.triangles(at.node) <= 4) {
      node.first = binary.firstTriangle(at.node);
      for (int i = 0; i < part.count; ++i) {
        node.below[i] = part.below[i];
        const auto at = static_cast<std::size_t>(node.first) + std::size_t(i);
        triangles_[at] = binary.triangle(part.below[i]);
        places_[static_cast<std::size_t>(part.below[i])] = 8 * number + i + 1;
        const VertexIndices v = slots.verticesOf(at);
        vertices_[at] = Int4{int(v[0]), int(v[1]), int(v[2]), part.below[i]};
      }
    } else {
      for (int i = part.count; i-- > 0;) open.push_back({part.below[i], number, i, at.depth + 1});
    }
    places_[static_cast<std::size_t>(at.node)] = 8 * number;
    nodes_.push_back(node);
  }
}

template <typename S>
template <typename BV>
void WideTree<S>::refit(const fcl::BVHModel<BV>& model, const VertexSlots& slots,
                        const BodyCoordinates& coordinates, const TaskPool& pool) {
  coordinates_ = coordinates;
  positions_.resize(slots.size());
  residuals_.resize(slots.size());
  const int parts = pool.parts();
  later_.resize(static_cast<std::size_t>(parts));
  // Parts begin at blocks of slots, so none waits for the positions of another. What a thread
  // writes here, others read in the last query.
  const bool is_shared = pool.size() > 1;
  pool.forEach(parts, [&](int part, int) {
    const int begin = blockBegin(slots, partBegin(size(), parts, part)),
              end = blockBegin(slots, partBegin(size(), parts, part + 1));
    readPositions(model, slots, firstSlot(slots, begin), firstSlot(slots, end), is_shared);
    refitNodes(slots, begin, end, is_shared, later_[static_cast<std::size_t>(part)]);
  });
  for (std::size_t part = later_.size(); part-- > 0;)
    for (const int node : later_[part]) refitInner(nodes_[static_cast<std::size_t>(node)]);
}

/// The root, or at or behind a node the first leaf with slots of a block that no leaf before it
/// has: behind the last node where there is none.
template <typename S>
int WideTree<S>::blockBegin(const VertexSlots& slots, int node) const {
  if (node == 0) return 0;
  const auto beginsBlock = [&](const WideNode& leaf) {
    const auto first = static_cast<std::size_t>(leaf.first);
    return first == 0 || slots.block(first) != slots.block(first - 1);
  };
  const auto from = nodes_.begin() + node;
  return static_cast<int>(
      std::find_if(from, nodes_.end(),
                   [&](const WideNode& at) { return at.isLeaf() && beginsBlock(at); }) -
      nodes_.begin());
}

/// Of a blockBegin: those before it belong to leaves before it.
template <typename S>
std::size_t WideTree<S>::firstSlot(const VertexSlots& slots, int node) const {
  if (node == 0) return 0;
  if (node == size()) return slots.size();
  return slots.block(static_cast<std::size_t>(nodes_[static_cast<std::size_t>(node)].first));
}

template <typename S>
template <typename BV>
void WideTree<S>::readPositions(const fcl::BVHModel<BV>& model, const VertexSlots& slots,
                                std::size_t begin, std::size_t end, bool is_shared) {
  constexpr std::size_t kAhead = 32, kInALine = 4;
  const std::vector<unsigned>& vertices = slots.vertices();
  const RoundedCoordinates coordinates(coordinates_);
  for (std::size_t i = begin; i < end; ++i) {
    if (is_shared && i % kInALine == 0 && i + kAhead < end) {
      prefetchToWrite(&positions_[i + kAhead]);
      prefetchToWrite(&residuals_[i + kAhead]);
    }
    coordinates(model.vertices[vertices[i]].template cast<double>(), positions_[i], residuals_[i]);
  }
}

/// Of a part of the nodes, from the last to the first. `later` are those with nodes of another part
/// below: one above the other, so the last one is all to look at.
template <typename S>
void WideTree<S>::refitNodes(const VertexSlots& slots, int begin, int end, bool is_shared,
                             std::vector<int>& later) {
  constexpr int kAhead = 12;
  later.clear();
  const auto isLate = [&](int node) {
    return node >= end || (!later.empty() && node == later.back());
  };
  for (int i = end; i-- > begin;) {
    WideNode& node = nodes_[static_cast<std::size_t>(i)];
    if (is_shared && i - kAhead >= begin) {  // boxes reach into both cache lines
      const WideNode& ahead = nodes_[static_cast<std::size_t>(i - kAhead)];
      prefetchToWrite(&ahead);
      prefetchToWrite(ahead.below);
    }
    if (node.isLeaf())
      refitLeaf(node, slots);
    else if (isLate(node.below[node.count - 1]))
      later.push_back(i);
    else
      refitInner(node);
  }
}

template <typename S>
void WideTree<S>::refitLeaf(WideNode& node, const VertexSlots& slots) const {
  Float4 low[4] = {float4::all(kNowhere), float4::all(kNowhere), float4::all(kNowhere),
                   float4::all(kNowhere)};
  Float4 high[4] = {-low[0], -low[0], -low[0], -low[0]};
  const Float4 margin = float4::all(kBoxMargin);
  for (int i = 0; i < node.count; ++i) {
    const VertexIndices corners =
        slots.slotsOf(static_cast<std::size_t>(node.first) + std::size_t(i));
    const Float4 &a = positions_[corners[0]], &b = positions_[corners[1]],
                 &c = positions_[corners[2]];
    low[i] = float4::lower<Float4>(float4::lower(a, b), c) - margin;
    high[i] = float4::upper<Float4>(float4::upper(a, b), c) + margin;
  }
  const float4::Columns lows = float4::columns(low[0], low[1], low[2], low[3]);
  const float4::Columns highs = float4::columns(high[0], high[1], high[2], high[3]);
  node.boxes = {{lows.x, lows.y, lows.z}, {highs.x, highs.y, highs.z}};
}

template <typename S>
void WideTree<S>::refitInner(WideNode& node) const {
  const Boxes4* below[4];
  for (int i = 0; i < 4; ++i)
    below[i] = i < node.count ? &nodes_[static_cast<std::size_t>(node.below[i])].boxes : &kEmpty;
  for (int k = 0; k < 3; ++k) {
    using float4::lower;
    using float4::transposed;
    using float4::upper;
    const auto low =
        transposed(below[0]->low[k], below[1]->low[k], below[2]->low[k], below[3]->low[k]);
    const auto high =
        transposed(below[0]->high[k], below[1]->high[k], below[2]->high[k], below[3]->high[k]);
    node.boxes.low[k] = lower(lower(low.x, low.y), lower(low.z, low.w));
    node.boxes.high[k] = upper(upper(high.x, high.y), upper(high.z, high.w));
  }
}

template class WideTree<float>;
template class WideTree<double>;
#define ADAPTIVE_BVH_INSTANTIATE(BV)                                                  \
  template void WideTree<BV::S>::adopt(const fcl::BVHModel<BV>&, const VertexSlots&); \
  template void WideTree<BV::S>::refit(const fcl::BVHModel<BV>&, const VertexSlots&,  \
                                       const BodyCoordinates&, const TaskPool&);
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
