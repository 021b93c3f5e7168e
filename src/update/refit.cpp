#include "update/refit.h"

#include <limits>

#include "update/fitness.h"

namespace adaptive_bvh {
namespace {

template <typename BV>
BV fitNode(const fcl::BVNode<BV>& node, const MeshView<typename BV::S>& mesh,
           const Tracking<BV>& tracking) {
  return Volume<BV>::fit(mesh, &tracking.order[node.first_primitive], node.num_primitives);
}

template <typename BV>
void refitNode(fcl::BVHModel<BV>& model, int i, const MeshView<typename BV::S>& mesh,
               Tracking<BV>& tracking) {
  fcl::BVNode<BV>& node = model.getBV(i);
  node.bv = fitNode(node, mesh, tracking);
  tracking.original_radius[i] = Volume<BV>::radius(node.bv);
  if (node.isLeaf()) tracking.resetPrimitive(mesh, static_cast<unsigned>(node.primitiveId()));
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
  fitness.visited = true;
  fitness.child_gap = -std::numeric_limits<double>::infinity();
  return fitness;
}

}  // namespace

template <typename BV>
void refitUnfit(fcl::BVHModel<BV>& model, Tracking<BV>& tracking,
                const Evidence<typename BV::S>& evidence, const RefitPolicy& policy,
                UpdateReport& report) {
  const MeshView<typename BV::S> mesh = viewOf(model);
  const bool has_evidence = evidence.work().queries > 0;
  for (int i = 0; i < model.getNumBVs(); ++i) {
    const fcl::BVNode<BV>& node = model.getBV(i);
    NodeFitness fitness = fitnessOf(node, tracking.original_radius[i], policy);
    if (has_evidence) {
      fitness.visited = evidence.visited(i);
      fitness.child_gap = static_cast<double>(evidence.childGap(i));
    }
    if (!isUnfit(fitness, policy)) continue;

    refitNode(model, i, mesh, tracking);
    ++(node.isLeaf() ? report.refitted_leaves : report.refitted_inner);
    report.refitted_primitives += node.num_primitives;
  }
}

template <typename BV>
BV refitAllButRoot(fcl::BVHModel<BV>& model, Tracking<BV>& tracking) {
  tracking.adopt(model);
  const MeshView<typename BV::S> mesh = viewOf(model);
  for (int i = 1; i < model.getNumBVs(); ++i) refitNode(model, i, mesh, tracking);
  const BV root = fitNode(model.getBV(0), mesh, tracking);
  tracking.original_radius[0] = Volume<BV>::radius(root);
  return root;
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                \
  template void refitUnfit(fcl::BVHModel<fcl::RSS<S>>&, Tracking<fcl::RSS<S>>&,    \
                           const Evidence<S>&, const RefitPolicy&, UpdateReport&); \
  template fcl::RSS<S> refitAllButRoot(fcl::BVHModel<fcl::RSS<S>>&, Tracking<fcl::RSS<S>>&);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
