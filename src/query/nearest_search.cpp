#include "query/nearest_search.h"

#include <algorithm>

namespace adaptive_bvh {
namespace {

/// The boxes of a node of the second tree if single precision cannot express them: boxes that are
/// far away, or not a number, are moved so near that squares of gaps stay in range.
Boxes4 boxesInRange(const RelativeFrame& frame, const WideNode& node) {
  constexpr float kFar = 1e15f;
  const Boxes4 turned = frame(node.boxes);
  Boxes4 boxes = node.boxes;  // where there is nothing, these stay
  for (int k = 0; k < 3; ++k)
    for (int i = 0; i < int(node.count); ++i) {
      // If one argument is NaN, std::min and std::max return the first one.
      boxes.low[k][i] = std::min(kFar, std::max(-kFar, turned.low[k][i]));
      boxes.high[k][i] = std::max(-kFar, std::min(kFar, turned.high[k][i]));
    }
  return boxes;
}

/// Whether single precision cannot distinguish boxes of two bodies, so far apart they are.
template <typename S>
bool isFar(const TreePair<S>& trees) {
  return trees.frame().t().template lpNorm<1>() > (1 << 10);
}

}  // namespace

template <typename S>
NearestSearch<S>::NearestSearch(const PlacedMesh<S>& first, const PlacedMesh<S>& second,
                                NearestPair<S>& nearest, bool supports_first)
    : nearest_(nearest),
      trees_(first, second),
      nodes1_(trees_.first().nodes()),
      nodes2_(trees_.second().nodes()),
      supports_first_(supports_first || isFar(trees_)),
      is_same_(trees_.frame().isSame()),
      open_(memory_->open),
      line_(memory_->line),
      blocks_(second, trees_) {
  open_.reserve(16 * static_cast<std::size_t>(trees_.first().depth() + trees_.second().depth()));
  next_supports_ = LineSeparation::largestCost(trees_.first(), trees_.second());
  constexpr long kOften = 16;  // of a large mesh perhaps only a small part counts
  if (std::max(trees_.first().size(), trees_.second().size()) > Supports::kSmall)
    next_supports_ /= kOften;
  if (supports_first_) next_supports_ = 1;
  next_alignment_ = 8 * trees_.costOfAlignment();  // supports mostly make it needless
}

template <typename S>
void NearestSearch<S>::setLimit() {
  if (limit_ == nearest_.limit()) return;
  limit_ = nearest_.limit();
  limit2_ = BoxGaps(trees_.first().scale()).squaredGapFor(limit_);
  direction_ = trees_.first().coordinates().axes().transpose() * nearest_.triangles().direction();
  blocks_.lookAlong(vectors::all(direction_));
  if (has_supports_) line_.setLimit(nearest_.limitWithinRounding());
}

template <typename S>
void NearestSearch<S>::run() {
  open_.clear();
  open_.push_back({0, 0, 0});
  limit_ = -1;
  setLimit();
  while (!open_.empty() && !nearest_.isDone()) {
    if (box_tests_ >= next_alignment_) align();
    if (box_tests_ >= next_supports_ && direction_ != fcl::Vector3d::Zero()) {
      trySupports();
      continue;  // perhaps there is no pair left
    }
    const Pair pair = open_.back();
    open_.pop_back();
    if (pair.gap < limit2_) visit(pair);
  }
}

/// The nodes stay the same, and gaps lower bounds.
template <typename S>
void NearestSearch<S>::align() {
  next_alignment_ = std::numeric_limits<long>::max();
  trees_.align();
  nodes1_ = trees_.first().nodes();
  nodes2_ = trees_.second().nodes();
  is_same_ = trees_.frame().isSame();
  turned_node_ = -1;
  const double before = limit_;
  limit_ = -1;
  for (Pair& pair : open_) pair.gap = 0;  // in other units
  if (before >= 0) setLimit();
}

/// Returns the cost of supports of the parts of both meshes that may be nearer than the limit.
template <typename S>
long NearestSearch<S>::setSupportParts() {
  const auto near1 = [&](int node) -> unsigned {
    const unsigned pairs = squaredGaps(nodes1_[node].boxes, secondBoxes(0)).below(limit2_);
    return (pairs | pairs >> 4 | pairs >> 8 | pairs >> 12) & 15;
  };
  const auto near2 = [&](int node) -> unsigned {
    const unsigned pairs = squaredGaps(nodes1_[0].boxes, secondBoxes(node)).below(limit2_);
    unsigned lanes = 0;
    for (int j = 0; j < 4; ++j) lanes |= unsigned((pairs >> (4 * j) & 15) != 0) << j;
    return lanes;
  };
  return line_.setParts(trees_.first(), near1, trees_.second(), near2);
}

/// Computes supports if the search has taken as long; again along another line where the last one
/// separated many pairs of nodes.
template <typename S>
void NearestSearch<S>::trySupports() {
  if (has_supports_ && !supportsPaid()) {
    next_supports_ = std::numeric_limits<long>::max();
    return;
  }
  const long cost = setSupportParts();
  const auto isApart = [&](const Pair& pair) { return !line_.covers(pair.first, pair.second); };
  open_.erase(std::remove_if(open_.begin(), open_.end(), isApart), open_.end());
  if (cost > box_tests_ && !supports_first_) {
    next_supports_ = cost;
    return;
  }
  near_pairs_ = apart_pairs_ = 0;
  line_.compute(trees_.first(), trees_.second(), nearest_.triangles());
  has_supports_ = true;
  next_supports_ = 2 * (box_tests_ + cost);
  limit_ = -1;
  setLimit();
}

template <typename S>
const Boxes4& NearestSearch<S>::secondBoxes(int node) {
  if (is_same_) return nodes2_[node].boxes;
  if (node != turned_node_)
    turned_ = trees_.frame().isInRange() ? trees_.frame()(nodes2_[node].boxes)
                                         : boxesInRange(trees_.frame(), nodes2_[node]);
  turned_node_ = node;
  return turned_;
}

template <typename S>
void NearestSearch<S>::visit(const Pair& pair) {
  const WideNode &a = nodes1_[pair.first], &b = nodes2_[pair.second];
  const Gaps4x4 gaps = squaredGaps(a.boxes, secondBoxes(pair.second));
  box_tests_ += a.count * b.count;
  unsigned open = gaps.below(limit2_);
  if (has_supports_ && open) {
    open &= ~line_.apart(pair.first, pair.second);
    ++near_pairs_;
    apart_pairs_ += !open;
  }
  if (!open) return;
  if (a.isLeaf() && b.isLeaf())
    testLeaves(pair, open);
  else
    push(pair, gaps, open);
}

/// What is below the two nodes; a leaf stays whole. The nearest is next.
template <typename S>
void NearestSearch<S>::push(const Pair& pair, const Gaps4x4& gaps, unsigned pairs) {
  const WideNode &a = nodes1_[pair.first], &b = nodes2_[pair.second];
  const std::size_t begin = open_.size();
  const auto add = [&](int first, int second, float gap) {
    open_.push_back({first, second, gap});
    if (gap < open_[begin].gap) std::swap(open_[begin], open_.back());
  };
  if (a.isLeaf()) {
    for (int j = 0; j < int(b.count); ++j)
      if (pairs >> (4 * j) & 15) add(pair.first, b.below[j], packs::smallest(gaps.row[j]));
  } else if (b.isLeaf()) {
    const unsigned lanes = (pairs | pairs >> 4 | pairs >> 8 | pairs >> 12) & 15;
    const Float4 least = gaps.least();
    for (unsigned rest = lanes; rest; rest &= rest - 1) {
      const int i = __builtin_ctz(rest);
      add(a.below[i], pair.second, least[i]);
    }
  } else {
    for (; pairs; pairs &= pairs - 1) {
      const int bit = __builtin_ctz(pairs), i = bit & 3, j = bit >> 2;
      add(a.below[i], b.below[j], gaps(i, j));
    }
  }
  std::swap(open_[begin], open_.back());
}

template <typename S>
void NearestSearch<S>::testLeaves(const Pair& pair, unsigned open) {
  open = blocks_.near(pair.first, pair.second, open, limit_ * trees_.first().scale());
  if (!open) return;
  const double unit = 1 / trees_.first().scale();
  nearest_.test(open, blocks_(pair.first, pair.second), unit, blocks_.error() * unit,
                nodes1_[pair.first], nodes2_[pair.second]);
  setLimit();
}

template class LeafBlocks<float>;
template class LeafBlocks<double>;
template class NearestSearch<float>;
template class NearestSearch<double>;

}  // namespace adaptive_bvh
