#include "query/nearest/supports.h"

#include <algorithm>
#include <limits>

namespace adaptive_bvh {
namespace {

constexpr double kNoExtent = -std::numeric_limits<double>::infinity();

/// The slots of the leaves in a range of nodes, and perhaps a few more.
struct SlotRange {
  std::size_t begin, end;
};
SlotRange slotsOf(const WideTree& tree, int begin, int end) {
  const VertexSlots& slots = tree.slots();
  while (!tree.nodes()[begin].isLeaf()) ++begin;  // nodes below a node follow it
  const WideNode& last = tree.nodes()[end - 1];   // a leaf
  const auto first = std::size_t(tree.nodes()[begin].first),
             behind = std::size_t(last.first) + last.count;
  const unsigned block = slots.blockStart(behind - 1);
  const std::size_t next = behind < slots.leaves() ? slots.blockStart(behind) : slots.used();
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

inline void Supports::computeNode(const WideTree& tree, int n) {
  const WideNode& node = tree.nodes()[n];
  Four& extent = extents_[static_cast<std::size_t>(n)];
  for (int i = 0; i < 4; ++i) {
    if (i >= int(node.count)) {
      extent.of[i] = kNoExtent;
    } else if (node.isLeaf()) {
      const VertexIndices at =
          tree.slots().slotsOf(static_cast<std::size_t>(node.first) + std::size_t(i));
      extent.of[i] = std::max(std::max(of_slot_[at[0]], of_slot_[at[1]]), of_slot_[at[2]]);
    } else {
      const double* const below = extents_[static_cast<std::size_t>(node.below[i])].of;
      extent.of[i] = std::max(std::max(below[0], below[1]), std::max(below[2], below[3]));
    }
  }
}

void Supports::compute(const WideTree& tree, const fcl::Vector3d* vertices,
                       const fcl::Vector3d& from, const fcl::Vector3d& direction) {
  const std::vector<unsigned>& vertex_of = tree.slots().vertices();
  of_slot_.resize(vertex_of.size());
  for (const Run& run : runs_)
    for (std::size_t i = run.first_slot; i < run.end_slot; ++i)
      of_slot_[i] = direction.dot(vertices[vertex_of[i]] - from);
  extents_.resize(static_cast<std::size_t>(tree.size()));
  for (auto run = runs_.rbegin(); run != runs_.rend(); ++run) {
    for (int n = run->end; n-- > run->begin;) computeNode(tree, n);
    for (int i = 0; i < 4; ++i)
      if (!(run->lanes >> i & 1)) extents_[static_cast<std::size_t>(run->begin)].of[i] = kNoExtent;
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
