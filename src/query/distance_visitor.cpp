#include "query/distance_visitor.h"

#include <algorithm>
#include <cmath>

#include "geometry/mesh_of_model.h"
#include "query/nearest_points.h"
#include "query/search.h"

namespace adaptive_bvh {
namespace {

/// Only while volumes are not being brought up to date by a query on another thread.
template <typename BV>
VolumeSeparation<BV> separationOf(const TriangleSeparation<typename BV::S>& placement,
                                  const PlacedMesh<BV>& first, const PlacedMesh<BV>& second,
                                  bool are_current) {
  if (!are_current) return {placement.R(), placement.T(), 0, 0};
  return {placement.R(), placement.T(), first.tree->motion.coordinateSum(),
          second.tree->motion.coordinateSum()};
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
      has_volumes_(first.tree->volumesAreCurrent() && second.tree->volumesAreCurrent()),
      volumes_(separationOf(triangles_, first, second, has_volumes_)) {
  setLimit();
}

/// FCL goes on below a pair unless its bound c meets c >= min - abs_err and c (1 + rel_err) >= min.
template <typename BV>
void DistanceVisitor<BV>::setLimit() {
  limit_ = std::max(result_.min_distance - request_.abs_err,
                    result_.min_distance / (1 + request_.rel_err));
  limit2_ = boxes_.squaredGapFor(limit_);
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
  Pair pair = pairOf(node1, node2);
  searchPairs(*this, pair);
}

template <typename BV>
auto DistanceVisitor<BV>::pairOf(int node1, int node2) -> Pair {
  const CenteredBox a(nodes1_.box(node1)), b(nodes2_.box(node2));
  ++work_.box_tests;
  return {node1, node2, boxes_.gapFromFirst(a, b, boxes_.toFirst()(b), limit2_)};
}

/// Where parts lie askew in body coordinates, boxes are loose and prune late. When they nearly
/// prune a pair, FCL's volumes are tested as well. When these would prune it without their
/// inflation, that counts for test D.
template <typename BV>
bool DistanceVisitor<BV>::prune(Pair& pair) {
  if (pair.gap >= limit2_) {
    stop(pair, [&] { return boxes_.distanceFor(pair.gap); });
    return true;
  }
  const fcl::BVNode<BV>&a = first_.model->getBV(pair.node1), &b = second_.model->getBV(pair.node2);
  if (has_volumes_ && pair.gap >= kNear * limit2_ && a.num_primitives + b.num_primitives > kFew) {
    ++work_.separation_tests;
    pair.separation = volumes_(a.bv, b.bv, triangles_.direction(), limit_);
    if (pair.separation >= limit_) {
      stop(pair, [&] { return pair.separation; });
      return true;
    }
    const S inflation1 = S(motion1_.inflation(pair.node1)) * S(unit1_);
    const S inflation2 = S(motion2_.inflation(pair.node2)) * S(unit2_);
    if (pair.separation + inflation1 + inflation2 >= limit_)
      statistics_.recordObstruction(pair.node1, pair.node2);
  }
  statistics_.recordVisit(pair.node1, pair.node2);
  return false;
}

template <typename BV>
void DistanceVisitor<BV>::testLeaves(const Pair& pair) {
  const auto index1 = static_cast<std::size_t>(nodes1_.leafIndex(pair.node1)),
             index2 = static_cast<std::size_t>(nodes2_.leafIndex(pair.node2));
  const VertexIndices a = first_.tree->topology.slots.verticesOf(index1),
                      b = second_.tree->topology.slots.verticesOf(index2);
  S separation = triangles_.separation(a, b);
  if (separation < limit_)
    separation = std::max(separation, triangles_.separationNearby(a, b, limit_));
  if (separation < limit_) {
    Point on1, on2;
    const S d = triangles_.distance(a, b, on1, on2);
    ++work_.leaf_tests;
    if (d < result_.min_distance)
      improve(d, first_.model->getBV(pair.node1).primitiveId(),
              second_.model->getBV(pair.node2).primitiveId(), on1, on2);
  }
  stop(pair, [&] { return separation; });
}

/// The larger box is split.
template <typename BV>
auto DistanceVisitor<BV>::split(const Pair& pair) -> std::array<Pair, 2> {
  const auto size = [](const Box& box) { return float4::sum(box.high - box.low); };
  const bool leaf1 = nodes1_.isLeaf(pair.node1), leaf2 = nodes2_.isLeaf(pair.node2);
  const bool first = leaf2 || (!leaf1 && size(nodes1_.box(pair.node1)) >=
                                             boxes_.ratio() * size(nodes2_.box(pair.node2)));
  return first ? splitFirst(pair) : splitSecond(pair);
}

template <typename BV>
auto DistanceVisitor<BV>::splitFirst(const Pair& pair) -> std::array<Pair, 2> {
  const int left = nodes1_.left(pair.node1);
  const CenteredBox b(nodes2_.box(pair.node2)), b_in_first = boxes_.toFirst()(b);
  const auto below = [&](int node) -> Pair {
    const CenteredBox a(nodes1_.box(node));
    return {node, pair.node2, boxes_.gapFromFirst(a, b, b_in_first, limit2_)};
  };
  return nearestFirst(pair, statistics_.side[0], pair.node1, below(left), below(left + 1));
}

template <typename BV>
auto DistanceVisitor<BV>::splitSecond(const Pair& pair) -> std::array<Pair, 2> {
  const int left = nodes2_.left(pair.node2);
  const CenteredBox a(nodes1_.box(pair.node1)), a_in_second = boxes_.toSecond()(a);
  const auto below = [&](int node) -> Pair {
    const CenteredBox b(nodes2_.box(node));
    return {pair.node1, node, boxes_.gapFromSecond(a, b, a_in_second, limit2_)};
  };
  return nearestFirst(pair, statistics_.side[1], pair.node2, below(left), below(left + 1));
}

/// Records for test C, if the volumes of the pair were tested: the distances of the children are
/// those of their boxes, which are not inflated.
template <typename BV>
ADAPTIVE_BVH_INLINE auto DistanceVisitor<BV>::nearestFirst(const Pair& parent,
                                                           TraversalStatistics* split_side,
                                                           int split_node, const Pair& a,
                                                           const Pair& b) -> std::array<Pair, 2> {
  work_.box_tests += 2;
  if (!std::isnan(parent.separation))
    split_side->recordChildGap(
        split_node, boxes_.distanceFor(std::min(a.gap, b.gap)) - double(parent.separation));
  if (b.gap < a.gap) return {b, a};
  return {a, b};
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
