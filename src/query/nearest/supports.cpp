// Extents of the nodes of a tree along a direction, computed bottom-up from the vertices.
#include "query/nearest/supports.h"

#include <algorithm>
#include <limits>

namespace adaptive_bvh {
namespace {

constexpr double kNoExtent = -std::numeric_limits<double>::infinity();

/// A range of slots (VertexSlots) that has all vertices of some leaves, and perhaps a few more.
struct SlotRange {
  std::size_t begin, end;
};
/// Returns the slots of a subtree, the nodes from `begin` to `end` - 1: from the first slot of the
/// first leaf's block to the end of the last leaf's block, where the next block begins.
SlotRange slotsOf(const WideTree& tree, int begin, int end) {
  const VertexSlots& slots = tree.slots();
  while (!tree.nodes()[begin].isLeaf()) ++begin;  // to the first leaf: depth-first order
  const WideNode& last = tree.nodes()[end - 1];   // a leaf
  // Triangles by their index in the order of the leaves; `after` is the first beyond the subtree.
  const auto first = std::size_t(tree.nodes()[begin].first),
             after = std::size_t(last.first) + last.count;
  const unsigned block = slots.blockStart(after - 1);
  const std::size_t next = after < slots.leaves() ? slots.blockStart(after) : slots.used();
  return {slots.blockStart(first),
          next != block ? next : std::min<std::size_t>(block + VertexSlots::kBlock, slots.used())};
}

}  // namespace

std::size_t Supports::setPart(const WideTree& tree, const NearLanes& near) {
  std::size_t size = 0;
  runs_.clear();
  open_.assign(1, {0, tree.size(), 15, 0, 0});
  while (!open_.empty()) {
    Run run = open_.back();
    open_.pop_back();
    if (run.end - run.begin > kSmall) {
      const WideNode& node = tree.nodes()[run.begin];
      run.lanes = near(run.begin);
      for (int i = int(node.count); i-- > 0; run.end = node.below[i])
        if (run.lanes >> i & 1) open_.push_back({node.below[i], run.end, 15, 0, 0});
      // Now run.end is the first child, so the run is this node alone.
    } else {
      const SlotRange slots = slotsOf(tree, run.begin, run.end);
      run.first_slot = slots.begin;
      run.end_slot = slots.end;
      size += slots.end - slots.begin;
    }
    runs_.push_back(run);
  }
  return size;
}

bool Supports::covers(int node) const {
  const auto after = std::upper_bound(runs_.begin(), runs_.end(), node,
                                      [](int n, const Run& run) { return n < run.begin; });
  return after != runs_.begin() && node < (after - 1)->end;
}

/// Computes the extents of a node from its vertices or children.
inline void Supports::computeNode(const WideTree& tree, int number) {
  const WideNode& node = tree.nodes()[number];
  Four& extent = extents_[static_cast<std::size_t>(number)];
  for (int i = 0; i < 4; ++i) {
    if (i >= int(node.count)) {
      extent.lane[i] = kNoExtent;
    } else if (node.isLeaf()) {
      const VertexIndices slots = tree.slots().slotsOf(std::size_t(node.first) + std::size_t(i));
      extent.lane[i] = std::max(std::max(slot_extents_[slots[0]], slot_extents_[slots[1]]),
                                slot_extents_[slots[2]]);
    } else {
      const double* const below = extents_[static_cast<std::size_t>(node.below[i])].lane;
      extent.lane[i] = std::max(std::max(below[0], below[1]), std::max(below[2], below[3]));
    }
  }
}

void Supports::compute(const WideTree& tree, const fcl::Vector3d* vertices,
                       const fcl::Vector3d& from, const fcl::Vector3d& direction) {
  const std::vector<unsigned>& vertex_of = tree.slots().vertices();
  slot_extents_.resize(vertex_of.size());
  for (const Run& run : runs_)
    for (std::size_t i = run.first_slot; i < run.end_slot; ++i)
      slot_extents_[i] = direction.dot(vertices[vertex_of[i]] - from);
  extents_.resize(static_cast<std::size_t>(tree.size()));
  // In reverse order, so that children come before their parent.
  for (auto run = runs_.rbegin(); run != runs_.rend(); ++run) {
    for (int n = run->end; n-- > run->begin;) computeNode(tree, n);
    for (int i = 0; i < 4; ++i)  // the children in these boxes are not in the part
      if (!(run->lanes >> i & 1))
        extents_[static_cast<std::size_t>(run->begin)].lane[i] = kNoExtent;
  }
}

void LineSeparation::compute(const WideTree& first, const WideTree& second,
                             const TriangleSeparation& triangles) {
  const TriangleSeparation::Line& line = triangles.line();
  first_.compute(first, triangles.vertices1(), line.from, line.along1);
  second_.compute(second, triangles.vertices2(), line.to, -line.along2);
  offset_ = line.offset;
  setLimit(std::numeric_limits<double>::infinity());
}

}  // namespace adaptive_bvh
