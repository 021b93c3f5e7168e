#include "query/near_distance.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace adaptive_bvh {
namespace {

/// Than any squared gap of two boxes that are not empty.
constexpr float kFarther = 1e30f;

/// The thread's memory, which stays.
template <typename Pair>
struct Memory {
  std::vector<Pair> open;
  VisitedNodes::Memory visits[2];

  static Memory& ofThisThread() {
    static thread_local Memory memory;
    return memory;
  }
};

}  // namespace

template <typename BV>
long NearDistance<BV>::worthAfter(const PlacedMesh<BV>& first, const PlacedMesh<BV>& second) {
  const auto cost = [](const PlacedMesh<BV>& mesh) -> long {
    return mesh.tree->wide.isCurrent(*mesh.tree) ? 0 : mesh.model->num_tris / 2;
  };
  return cost(first) + cost(second);
}

template <typename BV>
NearDistance<BV>::NearDistance(const PlacedMesh<BV>& first, const PlacedMesh<BV>& second,
                               NearestPair<BV>& nearest, SearchStops<BV>& stops,
                               NodeSeparation<BV>& separation)
    : first_(first),
      second_(second),
      nearest_(nearest),
      stops_(stops),
      separation_(separation),
      trees_(wideTreesOf(first, second)),
      frame_(trees_.first, trees_.second, nearest.triangles().R(), nearest.triangles().T()),
      gaps_(trees_.first.scale()),
      nodes1_(trees_.first.nodes()),
      nodes2_(trees_.second.nodes()),
      open_(Memory<Pair>::ofThisThread().open),
      visited1_(Memory<Pair>::ofThisThread().visits[0], trees_.first.size(), first.visits()),
      visited2_(Memory<Pair>::ofThisThread().visits[1], trees_.second.size(), second.visits()) {
  open_.reserve(16 * static_cast<std::size_t>(trees_.first.depth() + trees_.second.depth()));
}

template <typename BV>
void NearDistance<BV>::setLimit() {
  if (limit_ == nearest_.limit()) return;
  limit_ = nearest_.limit();
  limit2_ = gaps_.squaredGapFor(static_cast<double>(limit_));
  nearly2_ = gaps_.squaredGapNear(static_cast<double>(limit_));
  direction_ = vectors::all(trees_.first.coordinates().axes().transpose() *
                            nearest_.triangles().direction().template cast<double>());
  block2_of_ = -1;  // what is kept of it looks along another direction
}

template <typename BV>
void NearDistance<BV>::search() {
  open_.clear();
  open_.push_back({0, 0, 0});
  setLimit();
  run();
}

/// A stop at one triangle is one of a leaf with it.
template <typename BV>
bool NearDistance<BV>::search(int node1, int node2) {
  const auto place1 = trees_.first.placeOf(node1), place2 = trees_.second.placeOf(node2);
  if (place1.node < 0 || place2.node < 0) return false;
  const bool is_whole = place1.lane < 0 && place2.lane < 0;
  if (!is_whole && !(nodes1_[place1.node].isLeaf() && nodes2_[place2.node].isLeaf())) return false;
  const unsigned of_first = place1.lane < 0 ? 0xffff : 0x1111u << place1.lane;
  const unsigned of_second = place2.lane < 0 ? 0xffff : 0xfu << (4 * place2.lane);
  open_.clear();
  setLimit();
  stops_.next();
  visit({place1.node, place2.node, 0}, of_first & of_second);
  run();
  return true;
}

template <typename BV>
void NearDistance<BV>::run() {
  while (!open_.empty() && !nearest_.isDone()) {
    const Pair pair = open_.back();
    open_.pop_back();
    stops_.next();
    if (!prune(pair)) visit(pair);
  }
}

template <typename BV>
void NearDistance<BV>::record() const {
  const TaskPool alone(1);
  visited1_.record(nodes1_, alone);
  visited2_.record(nodes2_, alone);
}

template <typename BV>
bool NearDistance<BV>::prune(const Pair& pair) {
  const WideNode &a = nodes1_[pair.first], &b = nodes2_[pair.second];
  if (pair.gap >= limit2_) {
    stopAtGap(pair);
    return true;
  }
  if (pair.gap < kNear * limit2_ || (a.isLeaf() && b.isLeaf())) return false;
  const BoxGap gap = pair.gap >= nearly2_ ? BoxGap::Nearly : BoxGap::Short;
  const bool prunes = separation_.prunes(a.binary[0], b.binary[0], gap, box_tests_);
  if (prunes && stops_.isKept()) stops_.add(a.binary[0], b.binary[0], separation_.bound());
  return prunes;
}

/// `pairs`: of which boxes. Where not of all, both nodes are leaves.
template <typename BV>
void NearDistance<BV>::visit(const Pair& pair, unsigned pairs) {
  const WideNode &a = nodes1_[pair.first], &b = nodes2_[pair.second];
  const Gaps4x4 gaps = squaredGaps(a.boxes, b.boxes);
  const unsigned open = gaps.below(limit2_) & pairs;
  box_tests_ += a.count * b.count;
  visited1_.add(pair.first, NearestPair<BV>::firstLanes(open));
  visited2_.add(pair.second, NearestPair<BV>::secondLanes(open));
  if (a.isLeaf() && b.isLeaf())
    testLeaves(pair, gaps, pairs, open);
  else if (open)
    push(pair, gaps, stops_.isKept() ? gaps.below(kFarther) : open);
  else
    stopAtGap({pair.first, pair.second, packs::smallest(gaps.least())});
}

template <typename BV>
void NearDistance<BV>::stopAtGap(const Pair& pair) {
  if (stops_.isKept())
    stops_.add(nodes1_[pair.first].binary[0], nodes2_[pair.second].binary[0],
               gaps_.distanceFor(pair.gap));
}

/// What is below the two nodes; a leaf stays whole. The nearest is next.
template <typename BV>
void NearDistance<BV>::push(const Pair& pair, const Gaps4x4& gaps, unsigned pairs) {
  const WideNode &a = nodes1_[pair.first], &b = nodes2_[pair.second];
  const std::size_t begin = open_.size();
  const auto add = [&](int first, int second, float gap) {
    if (!(gap < limit2_)) return stopAtGap({first, second, gap});
    open_.push_back({first, second, gap});
    if (gap < open_[begin].gap) std::swap(open_[begin], open_.back());
  };
  if (a.isLeaf()) {
    for (unsigned rest = NearestPair<BV>::secondLanes(pairs); rest; rest &= rest - 1) {
      const int j = __builtin_ctz(rest);
      add(pair.first, b.below[j], packs::smallest(gaps.row[j]));
    }
  } else if (b.isLeaf()) {
    const Float4 least = gaps.least();
    for (unsigned rest = NearestPair<BV>::firstLanes(pairs); rest; rest &= rest - 1) {
      const int i = __builtin_ctz(rest);
      add(a.below[i], pair.second, least[i]);
    }
  } else {
    if (stops_.isKept()) pairs &= ~stopAtRows(pair, gaps);
    for (; pairs; pairs &= pairs - 1) {
      const int bit = __builtin_ctz(pairs), i = bit & 3, j = bit >> 2;
      add(a.below[i], b.below[j], gaps(i, j));
    }
  }
  std::swap(open_[begin], open_.back());
}

/// One stop where the search ends at a part of the second node with all parts of the first. Returns
/// these pairs.
template <typename BV>
unsigned NearDistance<BV>::stopAtRows(const Pair& pair, const Gaps4x4& gaps) {
  unsigned stopped = 0;
  for (int j = 0; j < nodes2_[pair.second].count; ++j) {
    const float gap = packs::smallest(gaps.row[j]);
    if (gap < limit2_) continue;
    stopAtGap({pair.first, nodes2_[pair.second].below[j], gap});
    stopped |= 0xfu << (4 * j);
  }
  return stopped;
}

template <typename BV>
MeshTriangle NearDistance<BV>::triangle(const WideTree<S>& tree, const WideNode& leaf, int lane) {
  const auto at = static_cast<unsigned>(leaf.first + lane);
  const Int4 v = tree.vertices(at);
  return {{unsigned(v[0]), unsigned(v[1]), unsigned(v[2])}, tree.triangle(at)};
}

template <typename BV>
void NearDistance<BV>::readSecond(int leaf) {
  block2_of_ = leaf;
  const WideNode& node = nodes2_[leaf];
  origin_ = Origin4(second_.tree->topology.slots, trees_.second, node);
  block2_ = origin_.corners(second_.tree->topology.slots, trees_.second, node);
  side2_ = TriangleSides(block2_, direction_);
}

/// Where the search stops here, by all pairs of triangles. A test takes one direction after the
/// other until the pair is left out; a bound that is to outlast many steps takes all of them.
template <typename BV>
void NearDistance<BV>::testLeaves(const Pair& pair, const Gaps4x4& gaps, unsigned pairs,
                                  unsigned open) {
  const unsigned kept = stops_.isKept() ? pairs & gaps.below(kFarther) : 0;
  if (!open && !kept) return;
  const WideNode& first = nodes1_[pair.first];
  if (block2_of_ != pair.second) readSecond(pair.second);
  const Triangles4 block1 = origin_.corners(first_.tree->topology.slots, trees_.first, first);
  const TriangleSides side1(block1, direction_);
  const double unit = 1 / trees_.first.scale();
  // Along a unit vector, of a corner of either.
  const double error = 4 * double(frame_.same().preciseError()) * unit;
  double least[4];
  nearest_.test(
      open, TriangleBlock(side1, side2_), unit, error,
      [&](int i) { return triangle(trees_.first, first, i); },
      [&](int j) { return triangle(trees_.second, nodes2_[pair.second], j); }, kept,
      [&](int i, int j) { return gaps_.distanceFor(gaps(i, j)); }, least);
  if (kept) keepStops(pair, NearestPair<BV>::secondLanes(kept), least);
  setLimit();
}

/// Of the two leaves; where not all triangles of the second are meant, of each in `lanes` with the
/// whole first one. `least`: by triangle of the second.
template <typename BV>
void NearDistance<BV>::keepStops(const Pair& pair, unsigned lanes, const double (&least)[4]) {
  const WideNode &a = nodes1_[pair.first], &b = nodes2_[pair.second];
  stops_.addTests();
  if (lanes == (1u << b.count) - 1)
    return stops_.add(a.binary[0], b.binary[0], *std::min_element(least, least + b.count));
  for (unsigned rest = lanes; rest; rest &= rest - 1) {
    const int j = __builtin_ctz(rest);
    stops_.add(a.binary[0], b.below[j], least[j]);
  }
}

#define ADAPTIVE_BVH_INSTANTIATE(BV) template class NearDistance<BV>;
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
