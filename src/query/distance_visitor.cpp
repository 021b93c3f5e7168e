#include "query/distance_visitor.h"

#include <algorithm>
#include <cmath>

namespace adaptive_bvh {
namespace {

/// The thread's stack of pairs, whose memory stays.
template <typename Pair>
std::vector<Pair>& openPairs() {
  static thread_local std::vector<Pair> pairs;
  return pairs;
}

}  // namespace

template <typename BV>
DistanceVisitor<BV>::DistanceVisitor(const PlacedMesh<BV>& first, const PlacedMesh<BV>& second,
                                     NearestPair<BV>& nearest, SearchStops<BV>& stops)
    : first_(first),
      second_(second),
      nodes1_(first.tree->boxes->nodes()),
      nodes2_(second.tree->boxes->nodes()),
      nearest_(nearest),
      stops_(stops),
      visits_(visitsOf(first, second)),
      unit1_(static_cast<double>(first.tree->boxes->frame.unit())),
      boxes_(*first.tree->boxes, first.tf, *second.tree->boxes, second.tf),
      separation_(first, second, nearest, boxes_.error()),
      open_(openPairs<Pair>()) {
  open_.reserve(16 *
                (first.tree->topology.stackCapacity() + second.tree->topology.stackCapacity()));
  setLimit();
}

template <typename BV>
void DistanceVisitor<BV>::setLimit() {
  if (limit_ == nearest_.limit()) return;
  limit_ = nearest_.limit();
  limit2_ = boxes_.squaredGapFor(limit_);
  nearly2_ = boxes_.squaredGapNear(limit_);
}

template <typename BV>
bool DistanceVisitor<BV>::search(int node1, int node2, long most_box_tests) {
  setLimit();
  const Pair all{{node1, first_.model->getBV(node1).num_primitives},
                 {node2, second_.model->getBV(node2).num_primitives},
                 gapOf(node1, node2)};
  open_.clear();
  open_.push_back(all);
  return resume(most_box_tests);
}

template <typename BV>
bool DistanceVisitor<BV>::resume(long most_box_tests) {
  while (!open_.empty() && !nearest_.isDone()) {
    if (box_tests_ > most_box_tests) return false;
    const Pair pair = open_.back();
    open_.pop_back();
    visit(pair);
  }
  return true;
}

template <typename BV>
void DistanceVisitor<BV>::visit(const Pair& pair) {
  stops_.next();
  S separation = std::numeric_limits<S>::quiet_NaN();
  if (!prune(pair, separation)) split(pair, separation);
}

template <typename BV>
float DistanceVisitor<BV>::gapOf(int node1, int node2) {
  BoxQuad a, b;
  a.setNode(nodes1_, {node1, 1});
  b.setNode(nodes2_, {node2, 1});
  Gaps4x4 gaps = squaredGaps(a.boxes, boxes_.toFirst()(b.boxes));
  boxes_.raiseBySecond(boxes_.toSecond()(a.boxes), b.boxes, gaps);
  ++box_tests_;
  return gaps(0, 0);
}

/// When boxes nearly prune a pair, other bounds are tried as well. `separation` is what FCL's
/// volumes said, if they did not prune.
template <typename BV>
bool DistanceVisitor<BV>::prune(const Pair& pair, S& separation) {
  const int node1 = pair.first.node, node2 = pair.second.node;
  if (pair.gap >= limit2_) {
    stopAtGap(node1, node2, pair.gap);
    return true;
  }
  if (pair.gap < kNear * limit2_ || pair.first.leaves + pair.second.leaves <= kFew) return false;
  const BoxGap gap = pair.gap >= nearly2_ ? BoxGap::Nearly : BoxGap::Short;
  const bool prunes = separation_.prunes(node1, node2, gap, box_tests_);
  separation = separation_.volumeSeparation();
  if (prunes && stops_.isKept()) stops_.add(node1, node2, separation_.bound());
  return prunes;
}

/// Records for test C, if the volumes of the pair were tested: the distances of what is below are
/// those of boxes, which are not inflated.
template <typename BV>
void DistanceVisitor<BV>::split(const Pair& pair, S separation) {
  setQuads(pair);
  box_tests_ += quad1_.count * quad2_.count;
  Gaps4x4 gaps = squaredGaps(quad1_.boxes, turned2_);
  unsigned open = below(gaps, limit2_);
  if (!boxes_.isAligned() && (open || stops_.isKept() || !std::isnan(separation))) {
    boxes_.raiseBySecond(boxes_.toSecond()(quad1_.boxes), quad2_.boxes, gaps);
    open = below(gaps, limit2_);
  }
  recordBelow(pair, open);
  if (!std::isnan(separation) && visits_.side[0] && visits_.side[1]) {
    const double gap = boxes_.distanceFor(packs::smallest(gaps.least())) - double(separation);
    if (quad1_.count > 1) visits_.side[0]->recordChildGap(pair.first.node, gap);
    if (quad2_.count > 1) visits_.side[1]->recordChildGap(pair.second.node, gap);
  }
  if (isSmall(pair.first) && isSmall(pair.second))
    testLeaves(pair, gaps, open);
  else
    push(pair, gaps, open);
}

/// Both nodes are split, or only one: that which is much larger, or which does not become smaller
/// by it because all lies everywhere below. The second one's quad often stays.
template <typename BV>
void DistanceVisitor<BV>::setQuads(const Pair& pair) {
  const auto size = [](const Box& box) { return float4::sum(box.high - box.low); };
  const float size1 = size(nodes1_.box(pair.first.node)),
              size2 = boxes_.ratio() * size(nodes2_.box(pair.second.node));
  const bool small1 = isSmall(pair.first), small2 = isSmall(pair.second);
  const auto set = [](BoxQuad& quad, const BoxNodes<const BoxNode>& tree, const CountedNode& node,
                      bool alone) {
    if (alone || tree.isLeaf(node.node))
      quad.setNode(tree, node);
    else
      quad.setBelow(tree, node);
  };
  set(quad1_, nodes1_, pair.first, !small1 && !small2 && size2 > kMuchLarger * size1);
  const bool are_large = !small1 && !small2;
  const bool alone2 = are_large && (size1 > kMuchLarger * size2 ||
                                    (size1 >= size2 && quad1_.largest() > kNoSmaller * size1));
  if (quad2_of_ != pair.second.node || quad2_alone_ != alone2) {
    quad2_of_ = pair.second.node;
    quad2_alone_ = alone2;
    set(quad2_, nodes2_, pair.second, alone2);
    turned2_ = boxes_.toFirst()(quad2_.boxes);
  }
  if (are_large && size2 > size1 && boxes_.ratio() * quad2_.largest() > kNoSmaller * size2)
    quad1_.setNode(nodes1_, pair.first);
}

/// Of the lanes that hold nodes.
template <typename BV>
ADAPTIVE_BVH_INLINE unsigned DistanceVisitor<BV>::below(const Gaps4x4& gaps, float gap) const {
  const unsigned lanes = quad1_.lanes();
  return gaps.below(gap) & (lanes | lanes << 4 | lanes << 8 | lanes << 12) &
         ((1u << (4 * quad2_.count)) - 1);
}

/// The two nodes, and those of their children that the search goes below.
template <typename BV>
void DistanceVisitor<BV>::recordBelow(const Pair& pair, unsigned open) {
  visits_.recordVisit(pair.first.node, pair.second.node);
  const auto record = [](TraversalStatistics* side, const BoxNodes<const BoxNode>& tree, int node,
                         const BoxQuad& quad, unsigned lanes) {
    if (!side || quad.count <= 2) return;
    const int left = tree.left(node);
    if ((lanes & quad.leftLanes()) && !tree.isLeaf(left)) side->recordVisit(left);
    if ((lanes & ~quad.leftLanes()) && !tree.isLeaf(left + 1)) side->recordVisit(left + 1);
  };
  record(visits_.side[0], nodes1_, pair.first.node, quad1_, Nearest::firstLanes(open));
  record(visits_.side[1], nodes2_, pair.second.node, quad2_, Nearest::secondLanes(open));
}

/// What is below the two nodes; a small node stays whole. The nearest is next.
template <typename BV>
void DistanceVisitor<BV>::push(const Pair& pair, const Gaps4x4& gaps, unsigned open) {
  const std::size_t begin = open_.size();
  const auto add = [&](const CountedNode& a, const CountedNode& b, float gap, bool is_open) {
    if (!is_open) return stopAtGap(a.node, b.node, gap);
    open_.push_back({a, b, gap});
    if (gap < open_[begin].gap) std::swap(open_[begin], open_.back());
  };
  const bool whole1 = isSmall(pair.first), whole2 = isSmall(pair.second);
  unsigned pairs =
      stops_.isKept() ? 0xffff & below(gaps, std::numeric_limits<float>::infinity()) : open;
  if (whole1) {
    for (int j = 0; j < quad2_.count; ++j)
      if (pairs >> (4 * j) & 15)
        add(pair.first, quad2_.below[j], packs::smallest(gaps.row[j]), open >> (4 * j) & 15);
  } else if (whole2) {
    const Float4 least = gaps.least();
    for (int i = 0; i < quad1_.count; ++i)
      if (pairs >> i & 0x1111) add(quad1_.below[i], pair.second, least[i], open >> i & 0x1111);
  } else if (stops_.isKept() && !open) {
    stopAtGap(pair.first.node, pair.second.node, packs::smallest(gaps.least()));
  } else {
    for (; pairs; pairs &= pairs - 1) {
      const int bit = __builtin_ctz(pairs), i = bit & 3, j = bit >> 2;
      add(quad1_.below[i], quad2_.below[j], gaps(i, j), open >> bit & 1);
    }
  }
  if (open_.size() > begin) std::swap(open_[begin], open_.back());
}

template <typename BV>
VertexIndices DistanceVisitor<BV>::cornersOf(const PlacedMesh<BV>& mesh,
                                             const BoxNodes<const BoxNode>& nodes, int leaf) {
  return mesh.tree->topology.slots.verticesOf(static_cast<std::size_t>(nodes.leafIndex(leaf)));
}

/// The triangles of a small node of the second mesh, from an origin beside them.
template <typename BV>
void DistanceVisitor<BV>::readSecond(int node) {
  block2_of_ = node;
  for (int j = 0; j < quad2_.count; ++j) {
    corners2_[j] = cornersOf(second_, nodes2_, quad2_.below[j].node);
    const auto at = nearest_.triangles().secondCorners(corners2_[j]);
    if (j == 0) origin_ = at[0];
    for (int k = j; k < (j == 0 ? 4 : j + 1); ++k) block2_.set(k, at, origin_, 1 / unit1_);
  }
}

template <typename BV>
void DistanceVisitor<BV>::readFirst(unsigned lanes) {
  bool is_first = true;
  for (int i = 0; i < quad1_.count; ++i) {
    if (!(lanes >> i & 1)) continue;
    corners1_[i] = cornersOf(first_, nodes1_, quad1_.below[i].node);
    const auto at = nearest_.triangles().firstCorners(corners1_[i]);
    if (is_first)
      for (int k = 0; k < 4; ++k) block1_.set(k, at, origin_, 1 / unit1_);
    else
      block1_.set(i, at, origin_, 1 / unit1_);
    is_first = false;
  }
}

/// The triangles below two small nodes. With a front, the two nodes are where the search stops: see
/// NearDistance::testLeaves.
template <typename BV>
void DistanceVisitor<BV>::testLeaves(const Pair& pair, const Gaps4x4& gaps, unsigned open) {
  const unsigned kept = stops_.isKept() ? below(gaps, std::numeric_limits<float>::infinity()) : 0;
  if (!open && !kept) return;
  for (unsigned rest = open; rest; rest &= rest - 1) {
    const int bit = __builtin_ctz(rest);
    visits_.recordVisit(quad1_.below[bit & 3].node, quad2_.below[bit >> 2].node);
  }
  if (block2_of_ != pair.second.node) readSecond(pair.second.node);
  readFirst(Nearest::firstLanes(open | kept));
  const Vector4x3 line = vectors::all(nearest_.triangles().direction());
  const TriangleSides side1(block1_, line), side2(block2_, line);
  const auto triangle = [](const PlacedMesh<BV>& mesh, const BoxQuad& quad, int lane,
                           const VertexIndices& corners) -> MeshTriangle {
    return {corners, mesh.model->getBV(quad.below[lane].node).primitiveId()};
  };
  double least[4];
  nearest_.test(
      open, TriangleBlock(side1, side2), unit1_, 0,
      [&](int i) { return triangle(first_, quad1_, i, corners1_[i]); },
      [&](int j) { return triangle(second_, quad2_, j, corners2_[j]); }, kept,
      [&](int i, int j) { return boxes_.distanceFor(gaps(i, j)); }, least);
  setLimit();
  if (!kept) return;
  stops_.addTests();
  stops_.add(pair.first.node, pair.second.node, *std::min_element(least, least + quad2_.count));
}

#define ADAPTIVE_BVH_INSTANTIATE(BV) template class DistanceVisitor<BV>;
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
