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
  const auto size = [](const fcl::BVHModel<BV>& model) {
    return model.aabb_center.template lpNorm<1>() + model.aabb_radius;
  };
  return 8 * rounding::epsilon<typename BV::S>() *
         (placement.T().template lpNorm<1>() + size(*first.model) + size(*second.model));
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
      rounding_(roundingOf(triangles_, first, second)),
      open_(openPairs<Pair>()) {
  setLimit();
}

/// FCL goes on below a pair unless its bound c meets c >= min - abs_err and c (1 + rel_err) >= min.
/// What is nearer by no more than its distances of triangles are rounded is as near: so parallel
/// faces prune. Not where that would hide a touch.
template <typename BV>
void DistanceVisitor<BV>::setLimit() {
  limit_ = std::max(result_.min_distance - request_.abs_err,
                    result_.min_distance / (1 + request_.rel_err));
  if (limit_ > 4 * rounding_) limit_ -= rounding_;
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
}

template <typename BV>
void DistanceVisitor<BV>::addWitness(int triangle1, int triangle2) {
  if (triangle1 < 0 || triangle1 >= first_.model->num_tris || triangle2 < 0 ||
      triangle2 >= second_.model->num_tris)
    return;
  Point on1, on2;
  const S d = triangles_.distance(viewOf(*first_.model).verticesOf(unsigned(triangle1)),
                                  viewOf(*second_.model).verticesOf(unsigned(triangle2)), on1, on2);
  ++work_.leaf_tests;
  if (d < result_.min_distance) improve(d, triangle1, triangle2, on1, on2);
}

template <typename BV>
void DistanceVisitor<BV>::search(int node1, int node2) {
  open_.clear();
  open_.push_back({node1, node2, gapOf(node1, node2)});
  while (!open_.empty() && !isDone()) {
    const Pair pair = open_.back();
    open_.pop_back();
    S separation = std::numeric_limits<S>::quiet_NaN();
    if (prune(pair, separation)) continue;
    if (nodes1_.isLeaf(pair.node1) && nodes2_.isLeaf(pair.node2))
      testLeafPair(pair.node1, pair.node2);
    else
      split(pair, separation);
  }
}

/// A pair of leaves with which a search began.
template <typename BV>
void DistanceVisitor<BV>::testLeafPair(int node1, int node2) {
  statistics_.recordVisit(node1, node2);
  testTriangles(node1, node2, cornersOf(first_, nodes1_, node1), cornersOf(second_, nodes2_, node2),
                0, std::numeric_limits<double>::max());
}

template <typename BV>
float DistanceVisitor<BV>::gapOf(int node1, int node2) {
  quad1_.setNode(nodes1_, node1);
  quad2_.setNode(nodes2_, node2);
  Gaps4x4 gaps = BoxPair::gapsInFirst(quad1_.boxes, boxes_.toFirst()(quad2_.boxes));
  boxes_.raiseBySecond(boxes_.toSecond()(quad1_.boxes), quad2_.boxes, gaps);
  ++work_.box_tests;
  return gaps(0, 0);
}

/// Where parts lie askew in body coordinates, boxes are loose and prune late. When they nearly
/// prune a pair, FCL's volumes are tested as well, and its vertices where these may be parallel
/// flat parts. `separation` is what the volumes said, if they did not prune.
template <typename BV>
bool DistanceVisitor<BV>::prune(const Pair& pair, S& separation) {
  if (pair.gap >= limit2_) {
    stopAtGap(pair.node1, pair.node2, pair.gap);
    return true;
  }
  if (pair.gap < kNear * limit2_) return false;
  const fcl::BVNode<BV>&a = first_.model->getBV(pair.node1), &b = second_.model->getBV(pair.node2);
  if (a.num_primitives + b.num_primitives <= kFew) return false;
  S bound = has_volumes_ ? separationOf(pair, a.bv, b.bv) : S(0);
  if (has_volumes_ && bound < limit_) separation = bound;
  if (bound < limit_ && mayReadVertices(pair, bound))
    bound = S(vertices_(pair.node1, pair.node2, triangles_.direction(), double(limit_)));
  if (bound < limit_) return false;
  if (isKept()) stop(pair.node1, pair.node2, double(bound));
  return true;
}

/// When the volumes would prune the pair without their inflation, that counts for test D.
template <typename BV>
auto DistanceVisitor<BV>::separationOf(const Pair& pair, const BV& a, const BV& b) -> S {
  ++work_.separation_tests;
  const S separation = volumes_(a, b, triangles_.direction(), limit_);
  if (separation >= limit_) return separation;
  const S inflation1 = S(motion1_.inflation(pair.node1)) * S(unit1_);
  const S inflation2 = S(motion2_.inflation(pair.node2)) * S(unit2_);
  if (separation + inflation1 + inflation2 >= limit_)
    statistics_.recordObstruction(pair.node1, pair.node2);
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
  Gaps4x4 gaps = BoxPair::gapsInFirst(quad1_.boxes, boxes_.toFirst()(quad2_.boxes));
  unsigned open = below(gaps, limit2_);
  if (open || !std::isnan(separation) || stops_) {
    boxes_.raiseBySecond(boxes_.toSecond()(quad1_.boxes), quad2_.boxes, gaps);
    open = below(gaps, limit2_);
  }
  recordBelow(pair, open);
  if (!std::isnan(separation)) {
    const Float4 least = float4::lower(float4::lower(gaps.row[0], gaps.row[1]),
                                       float4::lower(gaps.row[2], gaps.row[3]));
    const double gap = boxes_.distanceFor(packs::smallest(least)) - double(separation);
    if (quad1_.count > 1) statistics_.side[0]->recordChildGap(pair.node1, gap);
    if (quad2_.count > 1) statistics_.side[1]->recordChildGap(pair.node2, gap);
  }
  if (stops_) stopBelow(pair, gaps, open);
  pushOrTest(gaps, open);
}

/// Both nodes are split, or only one that is much larger.
template <typename BV>
void DistanceVisitor<BV>::setQuads(const Pair& pair) {
  const auto size = [](const Box& box) { return float4::sum(box.high - box.low); };
  const float size1 = size(nodes1_.box(pair.node1)),
              size2 = boxes_.ratio() * size(nodes2_.box(pair.node2));
  const bool leaf1 = nodes1_.isLeaf(pair.node1), leaf2 = nodes2_.isLeaf(pair.node2);
  if (leaf1 || (!leaf2 && size2 > kMuchLarger * size1))
    quad1_.setNode(nodes1_, pair.node1);
  else
    quad1_.setBelow(nodes1_, pair.node1);
  if (leaf2 || (!leaf1 && size1 > kMuchLarger * size2))
    quad2_.setNode(nodes2_, pair.node2);
  else
    quad2_.setBelow(nodes2_, pair.node2);
}

/// Bit 4 j + i where the gap of i and j is smaller.
template <typename BV>
unsigned DistanceVisitor<BV>::below(const Gaps4x4& gaps, float gap) const {
  unsigned bits = 0;
  for (int j = 0; j < 4; ++j)
    bits |= float4::bits(gaps.row[j] < float4::all(gap)) << (4 * j);
  const unsigned lanes = quad1_.lanes();
  return bits & (lanes | lanes << 4 | lanes << 8 | lanes << 12) & ((1u << (4 * quad2_.count)) - 1);
}

/// Where all below two children are pruned, the search stops at these.
template <typename BV>
void DistanceVisitor<BV>::stopBelow(const Pair& pair, const Gaps4x4& gaps, unsigned open) {
  const int middle1 = quad1_.first_right, middle2 = quad2_.first_right;
  const auto quarter = [&](int i0, int i1, int j0, int j1) {
    if (i0 == i1 || j0 == j1) return;
    bool all = true;
    float least = std::numeric_limits<float>::max();
    for (int j = j0; j < j1; ++j)
      for (int i = i0; i < i1; ++i) {
        all = all && !(open >> (4 * j + i) & 1);
        least = std::min(least, gaps(i, j));
      }
    if (all) {
      const int node1 = quad1_.count == 1 ? pair.node1
                                          : nodes1_.left(pair.node1) + (i0 > 0);
      const int node2 = quad2_.count == 1 ? pair.node2
                                          : nodes2_.left(pair.node2) + (j0 > 0);
      return stopAtGap(node1, node2, least);
    }
    for (int j = j0; j < j1; ++j)
      for (int i = i0; i < i1; ++i)
        if (!(open >> (4 * j + i) & 1))
          stopAtGap(quad1_.nodes[i], quad2_.nodes[j], gaps(i, j));
  };
  quarter(0, middle1, 0, middle2);
  quarter(middle1, quad1_.count, 0, middle2);
  quarter(0, middle1, middle2, quad2_.count);
  quarter(middle1, quad1_.count, middle2, quad2_.count);
}

/// The two nodes, and those of their children that the search goes below.
template <typename BV>
void DistanceVisitor<BV>::recordBelow(const Pair& pair, unsigned open) {
  statistics_.recordVisit(pair.node1, pair.node2);
  const unsigned lanes1 = (open | open >> 4 | open >> 8 | open >> 12) & 15;
  const unsigned lanes2 = unsigned((open & 0x000f) != 0) | unsigned((open & 0x00f0) != 0) << 1 |
                          unsigned((open & 0x0f00) != 0) << 2 | unsigned((open & 0xf000) != 0) << 3;
  const auto record = [](TraversalStatistics& side, const BoxNodes<const BoxNode>& tree, int node,
                         const BoxQuad& quad, unsigned lanes) {
    if (quad.count == 1) return;
    const int left = tree.left(node);
    if ((lanes & quad.leftLanes()) && !tree.isLeaf(left)) side.recordVisit(left);
    if ((lanes & ~quad.leftLanes()) && !tree.isLeaf(left + 1)) side.recordVisit(left + 1);
  };
  record(*statistics_.side[0], nodes1_, pair.node1, quad1_, lanes1);
  record(*statistics_.side[1], nodes2_, pair.node2, quad2_, lanes2);
}

/// Of the pairs that are not both leaves, the nearest is next.
template <typename BV>
void DistanceVisitor<BV>::pushOrTest(const Gaps4x4& gaps, unsigned open) {
  const std::size_t begin = open_.size();
  std::size_t nearest = begin;
  unsigned leaves = 0;
  for (; open; open &= open - 1) {
    const int bit = __builtin_ctz(open), i = bit & 3, j = bit >> 2;
    const Pair pair{quad1_.nodes[i], quad2_.nodes[j], gaps(i, j)};
    if (nodes1_.isLeaf(pair.node1) && nodes2_.isLeaf(pair.node2)) {
      leaves |= 1u << bit;
      continue;
    }
    if (open_.size() > begin && pair.gap < open_[nearest].gap) nearest = open_.size();
    open_.push_back(pair);
  }
  if (open_.size() > begin) std::swap(open_[nearest], open_.back());
  if (leaves) testLeaves(leaves);
}

template <typename BV>
VertexIndices DistanceVisitor<BV>::cornersOf(const PlacedMesh<BV>& mesh,
                                             const BoxNodes<const BoxNode>& nodes, int leaf) {
  return mesh.tree->topology.slots.verticesOf(static_cast<std::size_t>(nodes.leafIndex(leaf)));
}

/// Lower bounds first, four pairs at a time.
template <typename BV>
void DistanceVisitor<BV>::testLeaves(unsigned pairs) {
  const double scale = 1 / unit1_;
  Triangles4 p, q;
  VertexIndices corners1[4], corners2[4];
  fcl::Vector3d origin;
  bool first = true;
  unsigned lanes1 = (pairs | pairs >> 4 | pairs >> 8 | pairs >> 12) & 15;
  for (int i = 0; i < 4; ++i) {
    if (!(lanes1 >> i & 1)) continue;
    corners1[i] = cornersOf(first_, nodes1_, quad1_.nodes[i]);
    const auto at = triangles_.firstCorners(corners1[i]);
    if (first) {
      origin = at[0].template cast<double>();
      for (int k = 0; k < 4; ++k) p.set(k, at, origin, scale);
      first = false;
    } else {
      p.set(i, at, origin, scale);
    }
  }
  first = true;
  for (int j = 0; j < 4; ++j) {
    if (!(pairs >> (4 * j) & 15)) continue;
    corners2[j] = cornersOf(second_, nodes2_, quad2_.nodes[j]);
    const auto at = triangles_.secondCorners(corners2[j]);
    if (first)
      for (int k = 0; k < 4; ++k) q.set(k, at, origin, scale);
    else
      q.set(j, at, origin, scale);
    first = false;
  }
  const Point& line = triangles_.direction();
  const TriangleBlock block(p, q, {float4::all(float(line[0])), float4::all(float(line[1])),
                                   float4::all(float(line[2]))});
  const Float4 bounds[4] = {block.bounds<0>(), block.bounds<1>(), block.bounds<2>(),
                            block.bounds<3>()};
  const double slack = double(block.slack()) * unit1_ + 2 * double(rounding_);
  for (; pairs && !isDone(); pairs &= pairs - 1) {
    const int bit = __builtin_ctz(pairs), i = bit & 3, j = bit >> 2;
    const double bound = double(bounds[j][i]) * unit1_ - double(rounding_);
    statistics_.recordVisit(quad1_.nodes[i], quad2_.nodes[j]);
    if (bound < double(limit_))
      testTriangles(quad1_.nodes[i], quad2_.nodes[j], corners1[i], corners2[j], bound, slack);
    else if (isKept())
      stop(quad1_.nodes[i], quad2_.nodes[j], bound);
  }
}

/// `bound`: of their distance, in single precision; `slack`: by so much a bound along the same lines
/// may be larger in double precision.
template <typename BV>
void DistanceVisitor<BV>::testTriangles(int node1, int node2, const VertexIndices& a,
                                        const VertexIndices& b, double bound, double slack) {
  S separation = S(bound);
  if (bound + slack >= double(limit_)) {
    separation = std::max(separation, triangles_.separation(a, b));
    if (separation < limit_)
      separation = std::max(separation, triangles_.separationNearby(a, b, limit_));
  }
  if (separation < limit_) {
    Point on1, on2;
    const S d = triangles_.distance(a, b, on1, on2);
    ++work_.leaf_tests;
    separation = d - rounding_;
    if (d < result_.min_distance)
      improve(d, first_.model->getBV(node1).primitiveId(),
              second_.model->getBV(node2).primitiveId(), on1, on2);
  }
  if (isKept()) stop(node1, node2, double(separation));
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
