#include "update/advance.h"

#include <cmath>
#include <cstring>
#include <utility>

#include "update/box_propagation.h"
#include "update/local_bounds.h"
#include "update/parallel.h"
#include "update/propagation.h"

namespace adaptive_bvh {
namespace {

template <typename BV>
bool arePresent(const fcl::BVHModel<BV>& model, const fcl::Vector3<typename BV::S>* positions) {
  return std::memcmp(model.vertices, positions,
                     sizeof(*positions) * static_cast<std::size_t>(model.num_vertices)) == 0;
}

/// Makes `vertices` the array to write the new frame to.
template <typename BV>
void openFrame(fcl::BVHModel<BV>& model, FrameKind kind) {
  using Point = fcl::Vector3<typename BV::S>;
  if (kind == FrameKind::Replace) {
    delete[] model.prev_vertices;
    model.prev_vertices = nullptr;
    model.build_state = fcl::BVH_BUILD_STATE_PROCESSED;
  } else {
    if (!model.prev_vertices) model.prev_vertices = new Point[model.num_vertices];
    std::swap(model.vertices, model.prev_vertices);
    model.build_state = fcl::BVH_BUILD_STATE_UPDATED;
  }
}

/// Sums over frames lose digits as they grow.
template <typename BV>
void forgetLongWays(const fcl::BVHModel<BV>& model, AdaptiveTree<BV>& tree) {
  constexpr float kLongWay = 64;  // in body units: some sixty times the body's size
  if (tree.boxes && tree.boxes->travelOf(0) > kLongWay) tree.forgetTravel(model);
}

/// Seals a root that the update changed. A root that was refitted keeps equal radii.
template <typename BV>
void sealRoot(fcl::BVHModel<BV>& model, AdaptiveTree<BV>& tree) {
  BV& root = model.getBV(0).bv;
  if (tree.seal.intact(root)) return;
  const bool refitted = Volume<BV>::radius(root) == tree.originalRadius(model, 0);
  tree.seal.close(root, root);
  if (refitted) tree.refitted(model, 0);
}

/// Whether the volumes could be moved and inflated for a frame with this largest displacement. Not
/// when the old positions, written by FCL's own calls, were no numbers; nor after a jump that is
/// out of all proportion to the body. Everything is fitted anew then.
template <typename BV>
bool wasFollowed(const AdaptiveTree<BV>& tree, typename BV::S largest) {
  return tree.boxes ? tree.boxes->canFollow(largest) && tree.boxes->areInRange()
                    : std::isfinite(largest);
}

/// Fills all boxes at the model's present positions, along the axes of the root's volume.
template <typename BV>
void layBoxes(fcl::BVHModel<BV>& model, AdaptiveTree<BV>& tree, const BV& root) {
  using S = typename BV::S;
  Boxes<S>& boxes = *tree.boxes;
  boxes.frame =
      BodyFrame<S>(Volume<BV>::axes(root).template cast<double>(), root.center(), root.size() / 2);
  boxes.attitude.adopt(model, tree.topology, boxes.frame.axes(), boxes.frame.scale());
  stageInPlace(model, boxes);
  propagateByBoxes(model, tree.topology, boxes);
  tree.forgetTravel(model);
}

void enter(const Propagated& propagated, UpdateReport& report) {
  report.moved = propagated.moved;
  report.inflated = propagated.inflated;
}

/// One frame by the thesis's propagation. Returns the largest displacement; stops after measuring
/// it when that cannot be followed. So do the other two ways of `advance`.
template <typename BV>
typename BV::S byDisplacements(fcl::BVHModel<BV>& model, AdaptiveTree<BV>& tree,
                               const RefitPolicy& policy,
                               const fcl::Vector3<typename BV::S>* positions, Stopwatch& watch,
                               UpdateReport& report) {
  const auto largest = moveVertices(model, *tree.displacements, positions);
  updateLocalBounds(model);
  report.displacement_seconds = watch.lap();
  if (!std::isfinite(largest)) return largest;
  report.inflated = propagate(model, *tree.displacements, policy.leaf_radius_may_shrink);
  report.propagation_seconds = watch.lap();
  refitUnfit(model, tree, policy, report);
  report.refit_seconds = watch.lap();
  return largest;
}

template <typename BV>
typename BV::S byBoxes(fcl::BVHModel<BV>& model, AdaptiveTree<BV>& tree, const RefitPolicy& policy,
                       const fcl::Vector3<typename BV::S>* positions, Stopwatch& watch,
                       UpdateReport& report) {
  Boxes<typename BV::S>& boxes = *tree.boxes;
  beginStaging(model, boxes, positions);
  const auto staged = stageRange(model, boxes, positions, 0, model.num_vertices);
  const auto largest = finishStaging(model, boxes, staged);
  model.aabb_radius = std::sqrt(squaredRadius(model, 0, model.num_vertices));
  report.displacement_seconds = watch.lap();
  if (!boxes.canFollow(largest)) return largest;
  enter(propagateByBoxes(model, tree.topology, boxes), report);
  report.propagation_seconds = watch.lap();
  refitUnfit(model, tree, policy, report);
  report.refit_seconds = watch.lap();
  return largest;
}

}  // namespace

template <typename BV>
UpdateReport advance(fcl::BVHModel<BV>& model, AdaptiveTree<BV>& tree, const RefitPolicy& policy,
                     FrameKind kind, const fcl::Vector3<typename BV::S>* positions, int threads) {
  UpdateReport report;
  report.nodes = model.getNumBVs();
  Stopwatch watch;
  // Before the move: displacements count from the positions that the volumes hold.
  report.resynchronised = repairIfChanged(model, tree);
  if (kind == FrameKind::Replace && !model.prev_vertices && arePresent(model, positions)) {
    tree.evidence.clear();
    report.displacement_seconds = watch.lap();
    return report;
  }
  openFrame(model, kind);
  forgetLongWays(model, tree);
  const auto largest =
      !tree.boxes ? byDisplacements(model, tree, policy, positions, watch, report)
      : threads > 1 && model.getBV(0).num_primitives >= kParallelPrimitives
          ? stagePropagateRefit(model, tree, policy, positions, threads, watch, report)
          : byBoxes(model, tree, policy, positions, watch, report);
  report.largest_displacement = static_cast<double>(largest);
  if (wasFollowed(tree, largest)) {
    replaceDecayed(model, tree, policy);
    sealRoot(model, tree);
  } else {
    tree.seal.breakOpen();
    report.resynchronised = repairIfChanged(model, tree);
  }
  tree.evidence.clear();
  report.refit_seconds += watch.lap();
  return report;
}

template <typename BV>
UpdateReport advance(fcl::BVHModel<BV>& model, AdaptiveTree<BV>& tree, const RefitPolicy& policy,
                     const unsigned* indices, const fcl::Vector3<typename BV::S>* positions,
                     std::size_t count) {
  UpdateReport report;
  report.nodes = model.getNumBVs();
  Stopwatch watch;
  report.resynchronised = repairIfChanged(model, tree);
  if (tree.incidence.empty()) tree.incidence.adopt(model, tree.topology);
  forgetLongWays(model, tree);
  PartialBounds<BV> bounds(model);
  const auto largest =
      stageVertices(model, *tree.boxes, tree.incidence, bounds, indices, positions, count);
  report.largest_displacement = static_cast<double>(largest);
  report.displacement_seconds = watch.lap();

  enter(propagateByBoxes(model, tree.topology, tree.incidence, *tree.boxes), report);
  const bool followed = wasFollowed(tree, largest);
  if (followed) bounds.finish(tree.topology, *tree.boxes, tree.incidence.coversAllVertices());
  report.propagation_seconds = watch.lap();
  refitUnfitMarked(model, tree, policy, report);
  sealRoot(model, tree);
  if (!followed) {
    tree.seal.breakOpen();
    report.resynchronised = repairIfChanged(model, tree);
  }
  tree.evidence.clear();
  report.refit_seconds = watch.lap();
  return report;
}

template <typename BV>
void adoptBuild(fcl::BVHModel<BV>& model, AdaptiveTree<BV>& tree) {
  tree.adopt(model);
  updateLocalBounds(model);
  BV& root = model.getBV(0).bv;
  if (tree.boxes) layBoxes(model, tree, root);
  tree.seal.close(root, root);
  tree.refitted(model, 0);
}

template <typename BV>
bool repairIfChanged(fcl::BVHModel<BV>& model, AdaptiveTree<BV>& tree) {
  if (model.getNumBVs() == 0 || tree.seal.intact(model.getBV(0).bv)) return false;
  const std::lock_guard<std::mutex> lock(tree.repairing);
  if (tree.seal.intact(model.getBV(0).bv)) return true;  // another thread was first
  tree.adopt(model);
  updateLocalBounds(model);
  const BV root = refitAllButRoot<BV>(model, tree);
  if (tree.boxes) layBoxes(model, tree, root);
  tree.seal.close(model.getBV(0).bv, root);
  tree.refitted(model, 0);
  return true;
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                          \
  template UpdateReport advance(fcl::BVHModel<fcl::RSS<S>>&, AdaptiveTree<fcl::RSS<S>>&,     \
                                const RefitPolicy&, FrameKind, const fcl::Vector3<S>*, int); \
  template UpdateReport advance(fcl::BVHModel<fcl::RSS<S>>&, AdaptiveTree<fcl::RSS<S>>&,     \
                                const RefitPolicy&, const unsigned*, const fcl::Vector3<S>*, \
                                std::size_t);                                                \
  template void adoptBuild(fcl::BVHModel<fcl::RSS<S>>&, AdaptiveTree<fcl::RSS<S>>&);         \
  template bool repairIfChanged(fcl::BVHModel<fcl::RSS<S>>&, AdaptiveTree<fcl::RSS<S>>&);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
