#include "update/step.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "update/node_fit.h"
#include "update/refit.h"
#include "update/step_scope.h"
#include "update/stopwatch.h"
#include "volume/each_volume.h"

namespace adaptive_bvh {
namespace {

/// With fewer primitives, handing tasks to threads costs more than they gain.
constexpr int kParallelPrimitives = 50000;

/// Makes `vertices` the array to write the new positions to.
template <typename BV>
void openStep(fcl::BVHModel<BV>& model, StepKind kind) {
  using Point = fcl::Vector3<typename BV::S>;
  if (kind == StepKind::Replace) {
    delete[] model.prev_vertices;
    model.prev_vertices = nullptr;
    model.build_state = fcl::BVH_BUILD_STATE_PROCESSED;
  } else {
    if (!model.prev_vertices) model.prev_vertices = new Point[model.num_vertices];
    std::swap(model.vertices, model.prev_vertices);
    model.build_state = fcl::BVH_BUILD_STATE_UPDATED;
  }
}

/// Records a root that the step changed.
template <typename BV, typename Method>
void recordRoot(const UpdateTarget<BV>& target, Method& method, bool refitted) {
  BV& root = target.volume(0);
  if (target.tree.detector.matches(root)) return;
  target.tree.detector.record(root, root);
  if (refitted) method.refitted(target, 0);
}

/// Whether FCL's nodes wait in the step that begins. Those that wait go on doing so until somebody
/// asks for them.
template <typename BV, typename Method>
bool volumesWait(const UpdateTarget<BV>& target, const RefitPolicy& policy) {
  const AdaptiveTree<BV>& tree = target.tree;
  return Method::kHasBoxes &&
         (policy.volumes_on_demand ||
          (policy.volumes_rest && (tree.demand.volumesMayRest() || !tree.volumesAreCurrent())));
}

/// Lets the boxes follow from where they wait to the model's positions.
template <typename BV>
void followBoxes(const UpdateTarget<BV>& target, UpdateState<BV>& state,
                 const RefitPolicy& policy) {
  using S = typename BV::S;
  const auto count = static_cast<std::size_t>(target.model.num_vertices);
  const StepInput<S> input{StepKind::Replace, target.model.vertices, count, nullptr,
                           state.behind.data()};
  TaskPool alone(1);
  auto& method = std::get<TranslationPropagation<BV>>(state.method);
  method.begin(target, input);
  const VertexSummary<S> seen =
      method.read(target, input, 0, TranslationPropagation<BV>::readSize(target));
  method.accept(target, seen.largestDisplacement());
  method.propagate(target, policy, alone);
  state.behind.clear();
  target.tree.setBoxesCurrent(true);
}

/// What the boxes need of a step: they follow, or begin anew where they cannot. Returns whether
/// they followed.
template <typename BV, typename Scope>
bool moveBoxes(const UpdateTarget<BV>& target, UpdateState<BV>& state, Scope& scope,
               typename BV::S largest, UpdateReport& report) {
  if constexpr (Scope::kLeavesBoxes) {
    return scope.method().canFollowLater(target, state.way);
  } else {
    auto& method = scope.method();
    if (!method.canFollow(target, largest)) return false;
    method.accept(target, largest);
    const PropagationCounts counts = scope.propagate();
    report.moved = counts.moved;
    report.inflated = counts.inflated;
    return method.isInRange(target);
  }
}

/// One step, in the order of its phases. `Scope`: AllVertices, AllPositions or SomeVertices.
template <typename BV, typename Scope>
bool run(const UpdateTarget<BV>& target, UpdateState<BV>& state, const RefitPolicy& policy,
         Scope& scope, const StepInput<typename BV::S>& input, UpdateReport& report,
         Stopwatch& watch) {
  auto& method = scope.method();
  const bool repaired = report.resynchronised;  // and every volume recomputed
  if (scope.isAtRest()) {
    if (!repaired) target.tree.refits.clear();
    target.tree.statistics.clear();
    report.displacement_seconds = watch.lap();
    return true;
  }
  const auto seen = scope.read();
  if (!seen.isSurelyUsable() && !usablePositions(input.positions, input.count)) {
    scope.discard();
    return false;
  }
  report.largest_displacement = static_cast<double>(seen.largestDisplacement());

  if (!repaired) target.tree.refits.clear();
  target.tree.setMoved();
  openStep(target.model, input.kind);
  scope.write(seen);
  report.displacement_seconds = watch.lap();
  const bool followed = moveBoxes(target, state, scope, seen.largestDisplacement(), report);
  report.propagation_seconds = watch.lap();
  if (followed) {
    const auto refits = scope.refit();
    report.refitted_leaves = refits.leaves;
    report.refitted_inner = refits.inner;
    report.refitted_primitives = refits.primitives;
    recordRoot(target, method, refits.root);
    const bool rest = !target.tree.volumesAreCurrent() && !policy.volumes_on_demand;
    if (rest && !state.cover.follow(target, seen.largestDisplacement()))
      updateVolumes(target, state, policy);
  } else {
    target.tree.detector.invalidate();
    report.resynchronised = repairIfChanged(target, state);
  }
  target.tree.statistics.clear();
  report.refit_seconds = watch.lap();
  return true;
}

/// The positions; copied to `aside` when some lie in the arrays that a step writes or frees.
template <typename BV>
const fcl::Vector3<typename BV::S>* outsideOwnArrays(
    const fcl::BVHModel<BV>& model, const StepInput<typename BV::S>& input,
    std::vector<fcl::Vector3<typename BV::S>>& aside) {
  using Point = fcl::Vector3<typename BV::S>;
  const std::less<const Point*> before;
  const Point* const end = input.positions + input.count;
  for (const Point* own : {model.vertices, model.prev_vertices})
    if (own && before(input.positions, own + model.num_vertices) && before(own, end))
      aside.assign(input.positions, end);
  return aside.empty() ? input.positions : aside.data();
}

/// Whether the step need not renew the boxes: nobody asked for them since the last one.
template <typename BV>
bool leavesBoxes(const UpdateTarget<BV>& target, const StepInput<typename BV::S>& input) {
  return !target.tree.volumesAreCurrent() && target.tree.demand.boxTreeMayRest() &&
         input.kind == StepKind::Replace && !target.model.prev_vertices;
}

template <typename BV, typename Method>
bool stepOfAll(Method& method, const UpdateTarget<BV>& target, UpdateState<BV>& state,
               const RefitPolicy& policy, const StepInput<typename BV::S>& input,
               UpdateReport& report, Stopwatch& watch) {
  const bool parallel = target.model.getBV(0).num_primitives >= kParallelPrimitives;
  TaskPool pool(parallel ? state.threads : 1);
  AllVertices<BV, Method> all(target, method, policy, input, pool);
  if constexpr (Method::kHasBoxes) {
    if (leavesBoxes(target, input)) {
      AllPositions<BV, Method> positions(all, state);
      return run(target, state, policy, positions, input, report, watch);
    }
    updateBoxes(target, state, policy);
  }
  return run(target, state, policy, all, input, report, watch);
}

template <typename BV, typename Method>
bool stepOfSome(Method& method, const UpdateTarget<BV>& target, UpdateState<BV>& state,
                const RefitPolicy& policy, const StepInput<typename BV::S>& input,
                UpdateReport& report, Stopwatch& watch) {
  using Point = fcl::Vector3<typename BV::S>;
  // Also those that are not read, because their vertex is named again.
  if (!usablePositions(input.positions, input.count)) return false;
  if constexpr (Method::kHasBoxes) {
    if (!target.model.prev_vertices) {
      updateBoxes(target, state, policy);
      SomeVertices<BV, Method> some(target, method, policy, input, state.leaves, state.dirty);
      return run(target, state, policy, some, input, report, watch);
    }
  }
  std::vector<Point> all(target.model.vertices, target.model.vertices + target.model.num_vertices);
  for (std::size_t i = 0; i < input.count; ++i) all[input.indices[i]] = input.positions[i];
  return stepOfAll(method, target, state, policy, {input.kind, all.data(), all.size()}, report,
                   watch);
}

template <typename BV, typename Method>
bool stepOf(Method& method, const UpdateTarget<BV>& target, UpdateState<BV>& state,
            const RefitPolicy& policy, StepInput<typename BV::S> input, UpdateReport& report) {
  Stopwatch watch;
  report = UpdateReport();
  report.nodes = target.nodes();
  // Before the step: displacements count from the positions that the volumes hold.
  report.resynchronised = repairIfChanged(target, state);
  target.tree.demand.nextStep();
  target.tree.setVolumesCurrent(!volumesWait<BV, Method>(target, policy));
  std::vector<fcl::Vector3<typename BV::S>> aside;
  input.positions = outsideOwnArrays(target.model, input, aside);
  return input.indices ? stepOfSome(method, target, state, policy, input, report, watch)
                       : stepOfAll(method, target, state, policy, input, report, watch);
}

}  // namespace

template <typename BV>
void UpdateState<BV>::setPropagation(Propagation propagation) {
  if (propagation == Propagation::TranslationCompensated)
    method.template emplace<TranslationPropagation<BV>>();
  else
    method.template emplace<DisplacementPropagation<BV>>();
}

template <typename BV>
bool takeStep(const UpdateTarget<BV>& target, UpdateState<BV>& state, const RefitPolicy& policy,
              const StepInput<typename BV::S>& input, UpdateReport& report) {
  return std::visit(
      [&](auto& method) { return stepOf(method, target, state, policy, input, report); },
      state.method);
}

/// Resets all that is kept to FCL's tree as it stands; `start` is to follow.
template <typename BV>
void reset(const UpdateTarget<BV>& target, UpdateState<BV>& state) {
  target.tree.adopt(target.model);
  state.leaves.clear();
  state.cover.restart();
  state.behind.clear();
  target.tree.setBoxesCurrent(true);
  target.tree.setVolumesCurrent(true);
  updateLocalBounds(target.model);
  std::visit([&](auto& method) { method.reset(target); }, state.method);
}

/// The root is recorded last: from then on other threads may read all of it.
template <typename BV>
void start(const UpdateTarget<BV>& target, UpdateState<BV>& state, const BV& root) {
  std::visit([&](auto& method) { method.start(target, root); }, state.method);
  target.tree.detector.record(target.volume(0), root);
}

template <typename BV>
void adoptBuild(const UpdateTarget<BV>& target, UpdateState<BV>& state) {
  reset(target, state);
  start(target, state, target.volume(0));
}

template <typename BV>
bool repairIfChanged(const UpdateTarget<BV>& target, UpdateState<BV>& state) {
  AdaptiveTree<BV>& tree = target.tree;
  if (target.nodes() == 0 || tree.detector.matches(target.volume(0))) return false;
  const std::lock_guard<std::mutex> lock(tree.repairing);
  if (tree.detector.matches(target.volume(0))) return true;  // another thread was first
  reset(target, state);
  tree.refits.markAll();
  start(target, state, refitAllButRoot(target));
  return true;
}

template <typename BV>
void updateBoxes(const UpdateTarget<BV>& target, UpdateState<BV>& state,
                 const RefitPolicy& policy) {
  AdaptiveTree<BV>& tree = target.tree;
  if (tree.boxesAreCurrent()) return;
  const std::lock_guard<std::mutex> lock(tree.repairing);
  if (tree.boxesAreCurrent() || !tree.detector.matches(target.volume(0))) return;
  followBoxes(target, state, policy);
}

/// Every volume by extents; the root last, for other threads may be comparing it.
template <typename BV>
void updateVolumes(const UpdateTarget<BV>& target, UpdateState<BV>& state,
                   const RefitPolicy& policy) {
  AdaptiveTree<BV>& tree = target.tree;
  if (tree.volumesAreCurrent()) return;
  const std::lock_guard<std::mutex> lock(tree.repairing);
  if (tree.volumesAreCurrent()) return;  // another thread was first
  if (!tree.detector.matches(target.volume(0))) return;
  if (!tree.boxesAreCurrent()) followBoxes(target, state, policy);
  std::visit(
      [&](auto& method) {
        method.restore(target);
        auto fit = method.fit(target, policy);
        constexpr int kGroup = 32;
        for (int first = 1; first < target.nodes(); first += kGroup) {
          const int count = std::min(kGroup, target.nodes() - first);
          int nodes[kGroup];
          BV* volumes[kGroup];
          for (int k = 0; k < count; ++k) volumes[k] = &target.volume(nodes[k] = first + k);
          fit(nodes, volumes, count);
          for (int k = 0; k < count; ++k) {
            tree.motion.include(Volume<BV>::cornerSum(*volumes[k]));
            method.refitted(target, nodes[k]);
          }
        }
        const BV root = fit(0);
        tree.motion.include(Volume<BV>::cornerSum(root));
        tree.detector.record(target.volume(0), root);
        method.refitted(target, 0);
      },
      state.method);
  tree.refits.markAll();
  state.cover.restart();
  tree.setVolumesCurrent(true);
}

#define ADAPTIVE_BVH_INSTANTIATE(BV)                                                        \
  template struct UpdateState<BV>;                                                          \
  template bool takeStep(const UpdateTarget<BV>&, UpdateState<BV>&, const RefitPolicy&,     \
                         const StepInput<BV::S>&, UpdateReport&);                           \
  template void adoptBuild(const UpdateTarget<BV>&, UpdateState<BV>&);                      \
  template bool repairIfChanged(const UpdateTarget<BV>&, UpdateState<BV>&);                 \
  template void updateBoxes(const UpdateTarget<BV>&, UpdateState<BV>&, const RefitPolicy&); \
  template void updateVolumes(const UpdateTarget<BV>&, UpdateState<BV>&, const RefitPolicy&);
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
