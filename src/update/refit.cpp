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
  const auto settle = [&](int node) {
    refitter.judge(node);
    tree.evidence.clear(node);
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
  template fcl::RSS<S> refitAllButRoot(fcl::BVHModel<fcl::RSS<S>>&, AdaptiveTree<fcl::RSS<S>>&);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
