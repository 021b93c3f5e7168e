#include "tree/wide_tree.h"

#include <cmath>

#include "geometry/scratch.h"
#include "volume/each_volume.h"

namespace adaptive_bvh {
namespace {

constexpr float kNone = 1e30f;  // stays finite when it is turned and scaled

const Boxes4 kEmpty = {{float4::all(kNone), float4::all(kNone), float4::all(kNone)},
                       {float4::all(-kNone), float4::all(-kNone), float4::all(-kNone)}};

/// Some nodes of FCL's that make up one wide node.
template <typename BV>
class Collapse {
 public:
  Collapse(const fcl::BVHModel<BV>& model, int root) : model_(model) {
    binary[inner++] = root;
    add(root, 0);
    const bool is_leaf = model.getBV(root).num_primitives <= 4;
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
    if (model_.getBV(node).isLeaf()) {
      below[lane] = node;
      return;
    }
    for (int i = count; i > lane + 1; --i) below[i] = below[i - 1];
    below[lane] = model_.getBV(node).leftChild();
    below[lane + 1] = model_.getBV(node).rightChild();
    ++count;
  }
  /// The lane with the most triangles; a wide leaf is opened down to single ones, another node only
  /// where nodes below it would hold fewer than a leaf could.
  int largest(bool is_leaf) const {
    int most = is_leaf ? 1 : 4, found = -1;
    for (int i = 0; i < count; ++i)
      if (model_.getBV(below[i]).num_primitives > most) {
        most = model_.getBV(below[i]).num_primitives;
        found = i;
      }
    return found;
  }

  const fcl::BVHModel<BV>& model_;
};

}  // namespace

template <typename S>
template <typename BV>
void WideTree<S>::adopt(const fcl::BVHModel<BV>& model, const VertexSlots& slots) {
  struct Open {
    int node, parent, lane, depth;
  };
  nodes_.clear();
  // Most leaves hold three or four, so there is mostly room; to grow means to copy.
  nodes_.reserve(static_cast<std::size_t>(model.getBV(0).num_primitives) * 2 / 5 + 1);
  depth_ = 0;
  vertices_.resize(static_cast<std::size_t>(model.getBV(0).num_primitives));
  triangles_.resize(vertices_.size());
  places_.assign(static_cast<std::size_t>(model.getNumBVs()), -1);
  Scratch<Open> open(1, Open{0, -1, 0, 1});
  while (!open.empty()) {
    const Open at = open.back();
    open.pop_back();
    const int number = size();
    if (at.parent >= 0) nodes_[static_cast<std::size_t>(at.parent)].below[at.lane] = number;
    depth_ = std::max(depth_, at.depth);
    const Collapse<BV> part(model, at.node);
    WideNode node{kEmpty, {-1, -1, -1, -1}, -1, unsigned(part.count), {-1, -1, -1}};
    std::copy(part.binary, part.binary + 3, node.binary);
    if (model.getBV(at.node).num_primitives <= 4) {
      node.first = model.getBV(at.node).first_primitive;
      for (int i = 0; i < part.count; ++i) {
        node.below[i] = part.below[i];
        const auto at = static_cast<std::size_t>(node.first) + std::size_t(i);
        triangles_[at] = model.getBV(part.below[i]).primitiveId();
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
  pool.forEachPart(static_cast<int>(slots.size()), parts, [&](int first, int last, int) {
    readPositions(model, slots, static_cast<std::size_t>(first), static_cast<std::size_t>(last));
  });
  later_.resize(static_cast<std::size_t>(parts));
  pool.forEach(parts, [&](int part, int) {
    refitNodes(slots, partBegin(size(), parts, part), partBegin(size(), parts, part + 1),
               later_[static_cast<std::size_t>(part)]);
  });
  for (std::size_t part = later_.size(); part-- > 0;)
    for (const int node : later_[part]) refitInner(nodes_[static_cast<std::size_t>(node)]);
}

template <typename S>
template <typename BV>
void WideTree<S>::readPositions(const fcl::BVHModel<BV>& model, const VertexSlots& slots,
                                std::size_t begin, std::size_t end) {
  const std::vector<unsigned>& vertices = slots.vertices();
  const RoundedCoordinates coordinates(coordinates_);
  for (std::size_t i = begin; i < end; ++i)
    coordinates(model.vertices[vertices[i]].template cast<double>(), positions_[i], residuals_[i]);
}

/// Of a part of the nodes, from the last to the first. `later` are those with nodes of another part
/// below: one above the other, so the last one is all to look at.
template <typename S>
void WideTree<S>::refitNodes(const VertexSlots& slots, int begin, int end,
                             std::vector<int>& later) {
  later.clear();
  const auto isLate = [&](int node) {
    return node >= end || (!later.empty() && node == later.back());
  };
  for (int i = end; i-- > begin;) {
    WideNode& node = nodes_[static_cast<std::size_t>(i)];
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
  Float4 low[4] = {float4::all(kNone), float4::all(kNone), float4::all(kNone), float4::all(kNone)};
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
