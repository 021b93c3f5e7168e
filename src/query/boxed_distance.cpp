#include "query/boxed_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "query/nearest_points.h"

namespace adaptive_bvh {

template <typename S>
BoxedDistance<S>::BoxedDistance(const BoxedMesh<S>& first, const BoxedMesh<S>& second,
                                const fcl::DistanceRequest<S>& request,
                                fcl::DistanceResult<S>& result, const FrontSink& front)
    : first_(first),
      second_(second),
      corners1_(first.tree->topology.corners),
      corners2_(second.tree->topology.corners),
      boxes1_(*first.tree->boxes),
      boxes2_(*second.tree->boxes),
      request_(request),
      result_(result),
      front_(front),
      recorder_{{&first.tree->evidence, &second.tree->evidence}},
      unit1_(static_cast<double>(boxes1_.frame.unit())),
      unit2_(static_cast<double>(boxes2_.frame.unit())),
      relation_(boxes1_, first.tf, boxes2_, second.tf),
      triangles_(first.model->vertices, first.tf, second.model->vertices, second.tf),
      volumes_(triangles_.R(), triangles_.T(), boxes1_.reach, boxes2_.reach) {
  setLimit();
}

/// FCL goes on below a pair unless its bound c meets c >= min - abs_err and c (1 + rel_err) >= min.
template <typename S>
void BoxedDistance<S>::setLimit() {
  limit_ = std::max(result_.min_distance - request_.abs_err,
                    result_.min_distance / (1 + request_.rel_err));
  limit2_ = relation_.squaredGapFor(limit_);
}

template <typename S>
void BoxedDistance<S>::improve(S distance, int triangle1, int triangle2, const fcl::Vector3<S>& on1,
                               const fcl::Vector3<S>& on2) {
  if (request_.enable_nearest_points)
    result_.update(distance, first_.model, second_.model, triangle1, triangle2, on1, on2);
  else
    result_.update(distance, first_.model, second_.model, triangle1, triangle2);
  improved_ = true;
  setLimit();
  triangles_.lookAlong(on1, on2);
}

template <typename S>
void BoxedDistance<S>::seed(int triangle1, int triangle2) {
  if (triangle1 < 0 || triangle1 >= first_.model->num_tris || triangle2 < 0 ||
      triangle2 >= second_.model->num_tris)
    return;
  fcl::Vector3<S> on1, on2;
  const S d = triangles_.distance(viewOf(*first_.model).corners(unsigned(triangle1)),
                                  viewOf(*second_.model).corners(unsigned(triangle2)), on1, on2);
  ++work_.leaf_tests;
  if (d < result_.min_distance) improve(d, triangle1, triangle2, on1, on2);
}

template <typename S>
void BoxedDistance<S>::testLeaves(int leaf1, int leaf2) {
  const Corners &corners1 = corners1_[boxes1_[leaf1].leaf()],
                &corners2 = corners2_[boxes2_[leaf2].leaf()];
  S separation = triangles_.separation(corners1, corners2);
  if (separation < limit_)
    separation = std::max(separation, triangles_.separationNearby(corners1, corners2, limit_));
  if (separation < limit_) {
    fcl::Vector3<S> on1, on2;
    const S d = triangles_.distance(corners1, corners2, on1, on2);
    ++work_.leaf_tests;
    if (d < result_.min_distance)
      improve(d, first_.model->getBV(leaf1).primitiveId(),
              second_.model->getBV(leaf2).primitiveId(), on1, on2);
  }
  stop(leaf1, leaf2, double(separation));
}

template <typename S>
void BoxedDistance<S>::visit(int node1, int node2) {
  const CenteredBox a(boxes1_[node1]), b(boxes2_[node2]);
  ++work_.box_tests;
  settle(node1, node2, relation_.gapFromFirst(a, b, relation_.toFirst()(b), limit2_));
}

/// Boxes that stand askew prune late. Where they come near it, FCL's volumes are asked as well.
/// When those fail for nothing but their inflation, that is evidence for test D.
template <typename S>
void BoxedDistance<S>::settle(int node1, int node2, float gap) {
  if (gap >= limit2_) return stop(node1, node2, relation_.distanceFor(gap));
  S separation = std::numeric_limits<S>::quiet_NaN();  // not asked for
  const fcl::BVNode<fcl::RSS<S>>&a = first_.model->getBV(node1), &b = second_.model->getBV(node2);
  if (gap >= kNear * limit2_ && a.num_primitives + b.num_primitives > kFew) {
    ++work_.separation_tests;
    separation = volumes_(a.bv, b.bv, triangles_.direction(), limit_);
    if (separation >= limit_) return stop(node1, node2, double(separation));
    const S inflation1 = S(boxes1_.inflationOf(node1)) * S(unit1_);
    const S inflation2 = S(boxes2_.inflationOf(node2)) * S(unit2_);
    if (separation + inflation1 + inflation2 >= limit_) recorder_.addObstruction(node1, node2);
  }
  descend(node1, node2, separation);
}

template <typename S>
void BoxedDistance<S>::descend(int node1, int node2, S separation) {
  recorder_.addVisit(node1, node2);
  const bool leaf1 = boxes1_[node1].isLeaf(), leaf2 = boxes2_[node2].isLeaf();
  if (leaf1 && leaf2) return testLeaves(node1, node2);
  const auto size = [](const NodeBox& bounds) {
    const Box box = bounds.box();
    return lanes::sum(box.high - box.low);
  };
  if (leaf2 || (!leaf1 && size(boxes1_[node1]) >= relation_.ratio() * size(boxes2_[node2])))
    splitFirst(node1, node2, separation);
  else
    splitSecond(node1, node2, separation);
}

template <typename S>
void BoxedDistance<S>::splitFirst(int node1, int node2, S separation) {
  const int left = boxes1_[node1].left();
  const CenteredBox b(boxes2_[node2]), b_in_first = relation_.toFirst()(b);
  float gaps[2];
  for (int k = 0; k < 2; ++k)
    gaps[k] = relation_.gapFromFirst(CenteredBox(boxes1_[left + k]), b, b_in_first, limit2_);
  work_.box_tests += 2;
  recordChildGap(recorder_.side[0], node1, separation, gaps);
  goOn({{left, node2}, {left + 1, node2}}, gaps);
}

template <typename S>
void BoxedDistance<S>::splitSecond(int node1, int node2, S separation) {
  const int left = boxes2_[node2].left();
  const CenteredBox a(boxes1_[node1]), a_in_second = relation_.toSecond()(a);
  float gaps[2];
  for (int k = 0; k < 2; ++k)
    gaps[k] = relation_.gapFromSecond(a, CenteredBox(boxes2_[left + k]), a_in_second, limit2_);
  work_.box_tests += 2;
  recordChildGap(recorder_.side[1], node2, separation, gaps);
  goOn({{node1, left}, {node1, left + 1}}, gaps);
}

/// For test C, where the volume of the node that is split was asked and told `separation`: its
/// children lie as far off as their boxes, which hold no inflation.
template <typename S>
void BoxedDistance<S>::recordChildGap(Evidence* side, int node, S separation,
                                      const float (&gaps)[2]) const {
  if (std::isnan(separation)) return;
  side->addChildGap(node, relation_.distanceFor(std::min(gaps[0], gaps[1])) - double(separation));
}

template <typename S>
void BoxedDistance<S>::goOn(const int (&pairs)[2][2], const float (&gaps)[2]) {
  const int nearer = gaps[1] < gaps[0];
  for (int k : {nearer, 1 - nearer}) {
    if (isDone()) return;
    settle(pairs[k][0], pairs[k][1], gaps[k]);
  }
}

/// FCL's traversal leaves the nearest points in the frame of the first object until the end.
template <typename S>
void BoxedDistance<S>::finish() {
  recorder_.addQuery(work_);
  if (!improved_) return;
  for (auto& point : result_.nearest_points) point = first_.tf * point;
  settleNearestPoints(*first_.model, first_.tf, *second_.model, second_.tf, request_, result_);
}

template class BoxedDistance<float>;
template class BoxedDistance<double>;

}  // namespace adaptive_bvh
