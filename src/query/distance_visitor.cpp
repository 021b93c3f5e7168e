#include "query/distance_visitor.h"

#include <algorithm>
#include <cmath>

#include "geometry/mesh_of_model.h"
#include "query/nearest_points.h"

namespace adaptive_bvh {
namespace {

/// Only while volumes are not being brought up to date by a query on another thread.
template <typename BV>
VolumeSeparation<BV> separationsOf(const TriangleSeparation<typename BV::S>& placement,
                                   const PlacedMesh<BV>& first, const PlacedMesh<BV>& second,
                                   bool are_current) {
  if (!are_current) return {placement.R(), placement.T(), 0, 0};
  return {placement.R(), placement.T(), first.tree->motion.coordinateSum(),
          second.tree->motion.coordinateSum()};
}

/// FCL's distance of two triangles is off by some epsilon of what their coordinates are made of.
template <typename BV>
typename BV::S roundingOf(const TriangleSeparation<typename BV::S>& placement,
                          const PlacedMesh<BV>& first, const PlacedMesh<BV>& second) {
  using S = typename BV::S;
  const auto size = [](const BoxTree<S>& boxes) -> S {
    return boxes.middle().template lpNorm<1>() +
           S(float4::sum(boxes.root().halfSides())) * boxes.frame.unit();
  };
  return 8 * rounding::epsilon<S>() *
         (placement.T().template lpNorm<1>() + size(*first.tree->boxes) +
          size(*second.tree->boxes));
}

/// The thread's stack of pairs, whose memory stays.
template <typename Pair>
std::vector<Pair>& openPairs() {
  static thread_local std::vector<Pair> pairs;
  return pairs;
}

}  // namespace

template <typename BV>
DistanceVisitor<BV>::DistanceVisitor(const PlacedMesh<BV>& first, const PlacedMesh<BV>& second,
                                     const DistanceQuery<S>& query, double rigid_motion)
    : first_(first),
      second_(second),
      nodes1_(first.tree->boxes->nodes()),
      nodes2_(second.tree->boxes->nodes()),
      motion1_(first.tree->motion),
      motion2_(second.tree->motion),
      request_(query.request),
      result_(query.result),
      rigid_motion_(rigid_motion),
      statistics_(statisticsOf(first, second)),
      unit1_(static_cast<double>(first.tree->boxes->frame.unit())),
      unit2_(static_cast<double>(second.tree->boxes->frame.unit())),
      boxes_(*first.tree->boxes, first.tf, *second.tree->boxes, second.tf),
      triangles_(first.model->vertices, first.tf, second.model->vertices, second.tf),
      vertices_(first_, second_, triangles_.R(), triangles_.T()),
      has_volumes_(first.tree->volumesAreCurrent() && second.tree->volumesAreCurrent()),
      volumes_(separationsOf(triangles_, first, second, has_volumes_)),
      line_(first, second, triangles_.R(), triangles_.T(),
            boxes_.error() + static_cast<double>(volumes_.error())),
      rounding_(roundingOf(triangles_, first, second)),
      open_(openPairs<Pair>()) {
  open_.reserve(16 *
                (first.tree->topology.stackCapacity() + second.tree->topology.stackCapacity()));
  setLimit();
}

/// FCL goes on below a pair unless its bound c meets c >= min - abs_err and c (1 + rel_err) >= min.
template <typename BV>
void DistanceVisitor<BV>::setLimit() {
  limit_ = std::max(result_.min_distance - request_.abs_err,
                    result_.min_distance / (1 + request_.rel_err));
  limit2_ = boxes_.squaredGapFor(limit_);
  nearly2_ = boxes_.squaredGapNear(limit_);
}

template <typename BV>
void DistanceVisitor<BV>::improve(S distance, int triangle1, int triangle2, const Point& on1,
                                  const Point& on2) {
  if (request_.enable_nearest_points)
    result_.update(distance, first_.model, second_.model, triangle1, triangle2, on1, on2);
  else
    result_.update(distance, first_.model, second_.model, triangle1, triangle2);
  improved_ = true;
  setLimit();
  triangles_.lookAlong(on1, on2);
  line_.lookAlong(triangles_.direction());
}

template <typename BV>
void DistanceVisitor<BV>::addWitness(int triangle1, int triangle2) {
  if (triangle1 < 0 || triangle1 >= first_.model->num_tris || triangle2 < 0 ||
      triangle2 >= second_.model->num_tris)
    return;
  Point on1, on2;
  const S d = distanceOf(viewOf(*first_.model).verticesOf(unsigned(triangle1)),
                         viewOf(*second_.model).verticesOf(unsigned(triangle2)), on1, on2);
  ++work_.leaf_tests;
  if (d < result_.min_distance)
    improve(d, triangle1, triangle2, on1, on2);
  else
    triangles_.lookAlong(on1, on2);
}

template <typename BV>
void DistanceVisitor<BV>::search(int node1, int node2) {
  const Pair all{{node1, first_.model->getBV(node1).num_primitives},
                 {node2, second_.model->getBV(node2).num_primitives},
                 gapOf(node1, node2)};
  open_.clear();
  open_.push_back(all);
  while (!open_.empty() && !isDone()) {
    const Pair pair = open_.back();
    open_.pop_back();
    visit(pair);
  }
}

template <typename BV>
void DistanceVisitor<BV>::visit(const Pair& pair) {
  is_kept_ = stops_ && --until_kept_ == 0;
  if (is_kept_) until_kept_ = every_;
  S separation = std::numeric_limits<S>::quiet_NaN();
  if (!prune(pair, separation)) split(pair, separation);
}

template <typename BV>
float DistanceVisitor<BV>::gapOf(int node1, int node2) {
  BoxQuad a, b;
  a.setNode(nodes1_, {node1, 1});
  b.setNode(nodes2_, {node2, 1});
  Gaps4x4 gaps = BoxPair::gapsInFirst(a.boxes, boxes_.toFirst()(b.boxes));
  boxes_.raiseBySecond(boxes_.toSecond()(a.boxes), b.boxes, gaps);
  ++work_.box_tests;
  return gaps(0, 0);
}

/// Where parts lie askew in body coordinates, boxes are loose and prune late. When they nearly
/// prune a pair, FCL's volumes are tested as well, and its vertices where these may be parallel
/// flat parts. `separation` is what the volumes said, if they did not prune.
template <typename BV>
bool DistanceVisitor<BV>::prune(const Pair& pair, S& separation) {
  const int node1 = pair.first.node, node2 = pair.second.node;
  if (pair.gap >= limit2_) {
    stopAtGap(node1, node2, pair.gap);
    return true;
  }
  if (pair.gap < kNear * limit2_ || pair.first.leaves + pair.second.leaves <= kFew) return false;
  S bound = has_volumes_ ? separationOf(node1, node2) : S(0);
  if (has_volumes_ && bound < limit_) separation = bound;
  if (bound < limit_) bound = std::max(bound, S(line_(node1, node2, has_volumes_)));
  if (bound < limit_) {
    if (!mayReadVertices(pair, bound)) return false;
    const auto enough = static_cast<double>(limitWithinRounding());
    bound = S(vertices_(node1, node2, triangles_.direction(), enough));
    if (bound < limitWithinRounding()) return false;
  }
  if (is_kept_) stop(node1, node2, double(bound));
  return true;
}

/// When the volumes would prune the pair without their inflation, that counts for test D.
template <typename BV>
auto DistanceVisitor<BV>::separationOf(int node1, int node2) -> S {
  ++work_.separation_tests;
  const S separation = volumes_(first_.model->getBV(node1).bv, second_.model->getBV(node2).bv,
                                triangles_.direction(), limit_);
  if (separation >= limit_) return separation;
  const S inflation1 = S(motion1_.inflation(node1)) * S(unit1_);
  const S inflation2 = S(motion2_.inflation(node2)) * S(unit2_);
  if (separation + inflation1 + inflation2 >= limit_) statistics_.recordObstruction(node1, node2);
  return separation;
}

/// Vertices are read where exact boxes may have pruned, or the volumes fell just short of it; and
/// in proportion to the search.
template <typename BV>
bool DistanceVisitor<BV>::mayReadVertices(const Pair& pair, S separation) const {
  const long all = first_.model->num_tris + second_.model->num_tris;
  return (pair.gap >= nearly2_ || separation >= limit_ * S(kNearly)) &&
         vertices_.read() < 2 * all + 4 * work_.box_tests;
}

/// Records for test C, if the volumes of the pair were tested: the distances of what is below are
/// those of boxes, which are not inflated.
template <typename BV>
void DistanceVisitor<BV>::split(const Pair& pair, S separation) {
  setQuads(pair);
  work_.box_tests += quad1_.count * quad2_.count;
  Gaps4x4 gaps = BoxPair::gapsInFirst(quad1_.boxes, turned2_);
  unsigned open = below(gaps, limit2_);
  if (!boxes_.isAligned() && (open || is_kept_ || !std::isnan(separation))) {
    boxes_.raiseBySecond(boxes_.toSecond()(quad1_.boxes), quad2_.boxes, gaps);
    open = below(gaps, limit2_);
  }
  recordBelow(pair, open);
  if (!std::isnan(separation)) {
    const Float4 least = float4::lower(float4::lower(gaps.row[0], gaps.row[1]),
                                       float4::lower(gaps.row[2], gaps.row[3]));
    const double gap = boxes_.distanceFor(packs::smallest(least)) - double(separation);
    if (quad1_.count > 1) statistics_.side[0]->recordChildGap(pair.first.node, gap);
    if (quad2_.count > 1) statistics_.side[1]->recordChildGap(pair.second.node, gap);
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

/// Bit 4 j + i where the gap of i and j is smaller.
template <typename BV>
ADAPTIVE_BVH_INLINE unsigned DistanceVisitor<BV>::below(const Gaps4x4& gaps, float gap) const {
  unsigned bits = 0;
  for (int j = 0; j < 4; ++j) bits |= float4::bits(gaps.row[j] < float4::all(gap)) << (4 * j);
  const unsigned lanes = quad1_.lanes();
  return bits & (lanes | lanes << 4 | lanes << 8 | lanes << 12) & ((1u << (4 * quad2_.count)) - 1);
}

/// The two nodes, and those of their children that the search goes below.
template <typename BV>
void DistanceVisitor<BV>::recordBelow(const Pair& pair, unsigned open) {
  statistics_.recordVisit(pair.first.node, pair.second.node);
  const auto record = [](TraversalStatistics& side, const BoxNodes<const BoxNode>& tree, int node,
                         const BoxQuad& quad, unsigned lanes) {
    if (quad.count <= 2) return;
    const int left = tree.left(node);
    if ((lanes & quad.leftLanes()) && !tree.isLeaf(left)) side.recordVisit(left);
    if ((lanes & ~quad.leftLanes()) && !tree.isLeaf(left + 1)) side.recordVisit(left + 1);
  };
  record(*statistics_.side[0], nodes1_, pair.first.node, quad1_, firstLanes(open));
  record(*statistics_.side[1], nodes2_, pair.second.node, quad2_, secondLanes(open));
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
  unsigned pairs = is_kept_ ? 0xffff & below(gaps, std::numeric_limits<float>::infinity()) : open;
  if (whole1) {
    for (int j = 0; j < quad2_.count; ++j)
      if (pairs >> (4 * j) & 15)
        add(pair.first, quad2_.below[j], packs::smallest(gaps.row[j]), open >> (4 * j) & 15);
  } else if (whole2) {
    const Float4 least = float4::lower(float4::lower(gaps.row[0], gaps.row[1]),
                                       float4::lower(gaps.row[2], gaps.row[3]));
    for (int i = 0; i < quad1_.count; ++i)
      if (pairs >> i & 0x1111) add(quad1_.below[i], pair.second, least[i], open >> i & 0x1111);
  } else if (is_kept_ && !open) {
    const Float4 least = float4::lower(float4::lower(gaps.row[0], gaps.row[1]),
                                       float4::lower(gaps.row[2], gaps.row[3]));
    stopAtGap(pair.first.node, pair.second.node, packs::smallest(least));
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
    const auto at = triangles_.secondCorners(corners2_[j]);
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
    const auto at = triangles_.firstCorners(corners1_[i]);
    if (is_first)
      for (int k = 0; k < 4; ++k) block1_.set(k, at, origin_, 1 / unit1_);
    else
      block1_.set(i, at, origin_, 1 / unit1_);
    is_first = false;
  }
}

/// The triangles below two small nodes: lower bounds first, four pairs at a time. With a front, the
/// two nodes are where the search stops.
template <typename BV>
void DistanceVisitor<BV>::testLeaves(const Pair& pair, const Gaps4x4& gaps, unsigned open) {
  double least[4];
  for (int j = 0; j < quad2_.count; ++j) least[j] = std::numeric_limits<double>::max();
  if (open) {
    if (block2_of_ != pair.second.node) readSecond(pair.second.node);
    readFirst(firstLanes(open));
    const Point& line = triangles_.direction();
    const TriangleBlock block(
        block1_, block2_,
        {float4::all(float(line[0])), float4::all(float(line[1])), float4::all(float(line[2]))});
    Float4 bounds[4];
    if (open & 0x000f) bounds[0] = block.bounds<0>();
    if (open & 0x00f0) bounds[1] = block.bounds<1>();
    if (open & 0x0f00) bounds[2] = block.bounds<2>();
    if (open & 0xf000) bounds[3] = block.bounds<3>();
    const double slack = double(block.slack()) * unit1_ + 2 * double(rounding_);
    for (unsigned pairs = open; pairs && !isDone(); pairs &= pairs - 1) {
      const int bit = __builtin_ctz(pairs), i = bit & 3, j = bit >> 2;
      double bound = double(bounds[j][i]) * unit1_ - double(rounding_);
      statistics_.recordVisit(quad1_.below[i].node, quad2_.below[j].node);
      if (bound < double(limit_)) bound = testTriangles(i, j, bound, slack);
      least[j] = std::min(least[j], bound);
    }
  }
  if (is_kept_) stopAtLeaves(pair, gaps, open, least);
}

/// By the triangles of the second node, each with the whole first one. `least`: of the pairs that
/// were tested.
template <typename BV>
void DistanceVisitor<BV>::stopAtLeaves(const Pair& pair, const Gaps4x4& gaps, unsigned open,
                                       double* least) {
  for (unsigned rest = below(gaps, std::numeric_limits<float>::infinity()) & ~open; rest;
       rest &= rest - 1) {
    const int bit = __builtin_ctz(rest), j = bit >> 2;
    least[j] = std::min(least[j], boxes_.distanceFor(gaps(bit & 3, j)));
  }
  if (open)
    for (int j = 0; j < quad2_.count; ++j) stop(pair.first.node, quad2_.below[j].node, least[j]);
  else
    stop(pair.first.node, pair.second.node, *std::min_element(least, least + quad2_.count));
}

/// Returns a lower bound of the distance of two triangles. `bound`: one in single precision;
/// `slack`: by so much one along the same lines may be larger in double precision.
template <typename BV>
double DistanceVisitor<BV>::testTriangles(int i, int j, double bound, double slack) {
  const VertexIndices &a = corners1_[i], &b = corners2_[j];
  if (bound + slack >= double(limit_)) {
    S separation = triangles_.separation(a, b);
    if (separation < limit_)
      separation = std::max(separation, triangles_.separationNearby(a, b, limit_));
    bound = std::max(bound, double(separation));
    if (separation >= limit_) return bound;
  }
  Point on1, on2;
  const S d = distanceOf(a, b, on1, on2);
  ++work_.leaf_tests;
  if (d < result_.min_distance)
    improve(d, first_.model->getBV(quad1_.below[i].node).primitiveId(),
            second_.model->getBV(quad2_.below[j].node).primitiveId(), on1, on2);
  return bound;
}

/// As in FCL's traversal, nearest points are in the frame of the first object until the end.
template <typename BV>
bool DistanceVisitor<BV>::finish() {
  statistics_.recordQuery(work_);
  if (!improved_) return false;
  for (auto& point : result_.nearest_points) point = first_.tf * point;
  settleNearestPoints<BV>(first_, second_, {request_, result_});
  return true;
}

#define ADAPTIVE_BVH_INSTANTIATE(BV) template class DistanceVisitor<BV>;
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
