#include "update/advance.h"

#include <chrono>
#include <cmath>
#include <utility>

#include "update/propagation.h"
#include "update/refit.h"

namespace adaptive_bvh {
namespace {

/// Seconds since the last lap.
class Stopwatch {
 public:
  double lap() {
    const Clock::time_point now = Clock::now();
    const std::chrono::duration<double> elapsed = now - last_;
    last_ = now;
    return elapsed.count();
  }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point last_ = Clock::now();
};

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

/// Seals a root that the update changed. A root that was refitted keeps equal radii.
template <typename BV>
void sealRoot(fcl::BVHModel<BV>& model, AdaptiveTree<BV>& tree) {
  BV& root = model.getBV(0).bv;
  if (tree.seal.intact(root)) return;
  auto& original = tree.tracking.original_radius[0];
  const bool refitted = Volume<BV>::radius(root) == original;
  const auto sealed = tree.seal.close(root, root);
  if (refitted) original = sealed;
}

}  // namespace

template <typename BV>
UpdateReport advance(fcl::BVHModel<BV>& model, AdaptiveTree<BV>& tree, const RefitPolicy& policy,
                     FrameKind kind, const fcl::Vector3<typename BV::S>* positions) {
  UpdateReport report;
  report.nodes = model.getNumBVs();
  Stopwatch watch;
  // Before the move: displacements count from the positions that the volumes hold.
  report.resynchronised = repairIfChanged(model, tree);
  openFrame(model, kind);
  const auto largest = moveVertices(model, tree.tracking, positions);
  updateLocalAABB(model);
  report.largest_displacement = static_cast<double>(largest);
  report.displacement_seconds = watch.lap();

  if (std::isfinite(largest)) {
    report.inflated = propagate(model, tree.tracking, policy.leaf_radius_may_shrink);
    report.propagation_seconds = watch.lap();
    refitUnfit(model, tree.tracking, tree.evidence, policy, report);
    sealRoot(model, tree);
  } else {  // the old positions, written through FCL's own calls, were not finite
    tree.seal.breakOpen();
    report.resynchronised = repairIfChanged(model, tree);
  }
  tree.evidence.clear();
  report.refit_seconds = watch.lap();
  return report;
}

template <typename BV>
void adoptBuild(fcl::BVHModel<BV>& model, AdaptiveTree<BV>& tree) {
  tree.tracking.adopt(model);
  tree.evidence.reset(model.getNumBVs());
  BV& root = model.getBV(0).bv;
  tree.tracking.original_radius[0] = tree.seal.close(root, root);
}

template <typename BV>
bool repairIfChanged(fcl::BVHModel<BV>& model, AdaptiveTree<BV>& tree) {
  if (model.getNumBVs() == 0 || tree.seal.intact(model.getBV(0).bv)) return false;
  const std::lock_guard<std::mutex> lock(tree.repairing);
  if (tree.seal.intact(model.getBV(0).bv)) return true;  // another thread was first
  const BV root = refitAllButRoot<BV>(model, tree.tracking);
  tree.evidence.reset(model.getNumBVs());
  tree.tracking.original_radius[0] = tree.seal.close(model.getBV(0).bv, root);
  return true;
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                      \
  template UpdateReport advance(fcl::BVHModel<fcl::RSS<S>>&, AdaptiveTree<fcl::RSS<S>>&, \
                                const RefitPolicy&, FrameKind, const fcl::Vector3<S>*);  \
  template void adoptBuild(fcl::BVHModel<fcl::RSS<S>>&, AdaptiveTree<fcl::RSS<S>>&);     \
  template bool repairIfChanged(fcl::BVHModel<fcl::RSS<S>>&, AdaptiveTree<fcl::RSS<S>>&);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
