#include "update/refit.h"

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

}  // namespace

template <typename BV>
void refitUnfit(fcl::BVHModel<BV>& model, AdaptiveTree<BV>& tree, const RefitPolicy& policy,
                UpdateReport& report) {
  if (policy.criterion == FitnessCriterion::RefitNone) return;
  const MeshView<typename BV::S> mesh = viewOf(model);
  const bool has_evidence = tree.evidence.work().queries > 0;
  const bool only_visited = has_evidence && needsVisit(policy.criterion);
  for (int i = 0; i < model.getNumBVs(); ++i) {
    const bool visited = !has_evidence || tree.evidence.visited(i);
    if (only_visited && !visited) continue;
    const fcl::BVNode<BV>& node = model.getBV(i);
    NodeFitness fitness = fitnessOf(node, tree.originalRadius(model, i), policy);
    fitness.visited = visited;
    if (has_evidence) fitness.child_gap = static_cast<double>(tree.evidence.childGap(i));
    if (!isUnfit(fitness, policy)) continue;

    refitNode(model, i, mesh, tree);
    ++(node.isLeaf() ? report.refitted_leaves : report.refitted_inner);
    report.refitted_primitives += node.num_primitives;
  }
}

template <typename BV>
BV refitAllButRoot(fcl::BVHModel<BV>& model, AdaptiveTree<BV>& tree) {
  const MeshView<typename BV::S> mesh = viewOf(model);
  for (int i = 1; i < model.getNumBVs(); ++i) refitNode(model, i, mesh, tree);
  return fitNode(model.getBV(0), mesh, tree.topology);
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                 \
  template void refitUnfit(fcl::BVHModel<fcl::RSS<S>>&, AdaptiveTree<fcl::RSS<S>>&, \
                           const RefitPolicy&, UpdateReport&);                      \
  template fcl::RSS<S> refitAllButRoot(fcl::BVHModel<fcl::RSS<S>>&, AdaptiveTree<fcl::RSS<S>>&);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
