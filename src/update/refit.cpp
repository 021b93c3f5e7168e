#include "update/refit.h"

#include <algorithm>
#include <limits>

#include "update/fitness.h"

namespace adaptive_bvh {
namespace {

template <typename BV>
BV fitNode(const fcl::BVNode<BV>& node, const MeshView<typename BV::S>& mesh,
           const Topology& topology) {
  return Volume<BV>::fit(mesh, &topology.corners[static_cast<std::size_t>(node.first_primitive)],
                         node.num_primitives);
}

template <typename BV>
void refitNode(fcl::BVHModel<BV>& model, int i, const MeshView<typename BV::S>& mesh,
               AdaptiveTree<BV>& tree) {
  fcl::BVNode<BV>& node = model.getBV(i);
  node.bv = fitNode(node, mesh, tree.topology);
  tree.refitted(model, i);
}

template <typename BV>
NodeFitness fitnessOf(const fcl::BVNode<BV>& node, typename BV::S original_radius,
                      const RefitPolicy& policy) {
  NodeFitness fitness;
  fitness.original_radius = original_radius;
  fitness.current_radius = Volume<BV>::radius(node.bv);
  fitness.reference = policy.reference == InflationReference::OriginalRadius
                          ? original_radius
                          : Volume<BV>::size(node.bv, original_radius);
  fitness.child_gap = -std::numeric_limits<double>::infinity();
  return fitness;
}

/// In how many updates `replaceDecayed` comes to every node.
constexpr int kDecayRound = 16;

/// Holds all that the box holds, exactly: a box is within half its shortest side of the rectangle
/// in its middle. The radius also covers what the box may be off (BodyFrame::kError in each of
/// three coordinates) and what is rounded here, a few epsilon of each term.
template <typename S>
fcl::RSS<S> volumeAround(const Box& box, const Boxes<S>& boxes) {
  const Lanes sides = box.high - box.low;
  int order[3] = {0, 1, 2};
  std::sort(order, order + 3, [&](int a, int b) { return sides[a] > sides[b]; });
  const S unit = boxes.frame.unit();
  fcl::Vector3<double> corner(double(box.low[0]), double(box.low[1]), double(box.low[2]));
  corner[order[2]] += double(sides[order[2]]) / 2;
  const fcl::Matrix3<S> axes = boxes.frame.axes().template cast<S>();

  fcl::RSS<S> bv;
  for (int k = 0; k < 2; ++k) {
    bv.axis.col(k) = axes.col(order[k]);
    bv.l[k] = S(sides[order[k]]) * unit;
  }
  bv.axis.col(2) = bv.axis.col(0).cross(bv.axis.col(1));
  bv.To = boxes.frame.origin() + (boxes.frame.axes() * corner).template cast<S>() * unit;
  const S extent = S(boxes[0].box().reach()) * unit;
  bv.r = S(sides[order[2]]) / 2 * unit + 2 * S(BodyFrame<S>::kError) * extent +
         16 * rounding::epsilon<S>() *
             (bv.To.template lpNorm<1>() + boxes.frame.origin().template lpNorm<1>() + bv.l[0] +
              bv.l[1] + extent) +
         rounding::tiny<S>();
  return bv;
}

template <typename BV>
void replaceIfDecayed(fcl::BVHModel<BV>& model, AdaptiveTree<BV>& tree, int i) {
  Boxes<typename BV::S>& boxes = *tree.boxes;
  const Lanes sides = boxes[i].box().high - boxes[i].box().low;
  float& inflation = boxes.inflationOf(i);
  if (16 * inflation * inflation <= lanes::sum(sides * sides)) return;
  const BV around = volumeAround(boxes[i].box(), boxes);
  BV& bv = model.getBV(i).bv;
  if (Volume<BV>::radius(around) >= Volume<BV>::radius(bv)) return;  // too small for the boxes
  bv = around;
  tree.widenReach(Volume<BV>::reach(bv));
  // A rectangle that has grown until it held the box: test A sees how loose that is.
  inflation = static_cast<float>(Volume<BV>::radius(bv) * boxes.frame.scale());
}

/// Judges nodes one by one, and refits the unfit.
template <typename BV>
class Refitter {
 public:
  Refitter(fcl::BVHModel<BV>& model, AdaptiveTree<BV>& tree, const RefitPolicy& policy,
           UpdateReport& report)
      : model_(model),
        tree_(tree),
        policy_(policy),
        report_(report),
        mesh_(viewOf(model)),
        has_evidence_(tree.evidence.work().queries > 0),
        only_visited_(has_evidence_ && needsVisit(policy.criterion)) {}

  void judge(int i) {
    const bool visited = !has_evidence_ || tree_.evidence.visited(i);
    if (only_visited_ && !visited) return;
    const fcl::BVNode<BV>& node = model_.getBV(i);
    NodeFitness fitness = fitnessOf(node, tree_.originalRadius(model_, i), policy_);
    fitness.visited = visited;
    fitness.obstructing = !has_evidence_ || tree_.evidence.obstructing(i);
    if (has_evidence_) fitness.child_gap = static_cast<double>(tree_.evidence.childGap(i));
    if (!isUnfit(fitness, policy_)) return;

    refitNode(model_, i, mesh_, tree_);
    reach_ = std::max(reach_, Volume<BV>::reach(node.bv));
    ++(node.isLeaf() ? report_.refitted_leaves : report_.refitted_inner);
    report_.refitted_primitives += node.num_primitives;
  }

  /// The largest of the volumes that were refitted.
  typename BV::S reach() const { return reach_; }

 private:
  fcl::BVHModel<BV>& model_;
  AdaptiveTree<BV>& tree_;
  const RefitPolicy& policy_;
  UpdateReport& report_;
  const MeshView<typename BV::S> mesh_;
  const bool has_evidence_, only_visited_;
  typename BV::S reach_ = 0;
};

}  // namespace

template <typename BV>
typename BV::S refitUnfit(fcl::BVHModel<BV>& model, AdaptiveTree<BV>& tree,
                          const RefitPolicy& policy, int begin, int end, UpdateReport& report) {
  if (policy.criterion == FitnessCriterion::RefitNone) return 0;
  Refitter<BV> refitter(model, tree, policy, report);
  for (int i = begin; i < end; ++i) refitter.judge(i);
  return refitter.reach();
}

template <typename BV>
void refitUnfit(fcl::BVHModel<BV>& model, AdaptiveTree<BV>& tree, const RefitPolicy& policy,
                UpdateReport& report) {
  tree.widenReach(refitUnfit(model, tree, policy, 0, model.getNumBVs(), report));
}

template <typename BV>
void refitUnfitMarked(fcl::BVHModel<BV>& model, AdaptiveTree<BV>& tree, const RefitPolicy& policy,
                      UpdateReport& report) {
  Refitter<BV> refitter(model, tree, policy, report);
  const bool may_refit = policy.criterion != FitnessCriterion::RefitNone;
  const auto settle = [&](int node) {
    if (may_refit) {
      refitter.judge(node);
      replaceIfDecayed(model, tree, node);
    }
  };
  for (int left = model.getNumBVs(); (left = tree.incidence.markedBefore(left)) > 0;) {
    settle(left);
    settle(left + 1);
    tree.incidence.unmark(left);
  }
  settle(0);
  tree.widenReach(refitter.reach());
}

template <typename BV>
void replaceDecayed(fcl::BVHModel<BV>& model, AdaptiveTree<BV>& tree, const RefitPolicy& policy) {
  if (!tree.boxes || policy.criterion == FitnessCriterion::RefitNone) return;
  const int nodes = model.getNumBVs();
  int& next = tree.boxes->next_decayed;
  for (int count = nodes / kDecayRound + 1; count > 0; --count) {
    if (next >= nodes) next = 0;
    replaceIfDecayed(model, tree, next++);
  }
}

template <typename BV>
BV refitAllButRoot(fcl::BVHModel<BV>& model, AdaptiveTree<BV>& tree) {
  const MeshView<typename BV::S> mesh = viewOf(model);
  for (int i = 1; i < model.getNumBVs(); ++i) refitNode(model, i, mesh, tree);
  return fitNode(model.getBV(0), mesh, tree.topology);
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                       \
  template void refitUnfit(fcl::BVHModel<fcl::RSS<S>>&, AdaptiveTree<fcl::RSS<S>>&,       \
                           const RefitPolicy&, UpdateReport&);                            \
  template S refitUnfit(fcl::BVHModel<fcl::RSS<S>>&, AdaptiveTree<fcl::RSS<S>>&,          \
                        const RefitPolicy&, int, int, UpdateReport&);                     \
  template void refitUnfitMarked(fcl::BVHModel<fcl::RSS<S>>&, AdaptiveTree<fcl::RSS<S>>&, \
                                 const RefitPolicy&, UpdateReport&);                      \
  template void replaceDecayed(fcl::BVHModel<fcl::RSS<S>>&, AdaptiveTree<fcl::RSS<S>>&,   \
                               const RefitPolicy&);                                       \
  template fcl::RSS<S> refitAllButRoot(fcl::BVHModel<fcl::RSS<S>>&, AdaptiveTree<fcl::RSS<S>>&);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
