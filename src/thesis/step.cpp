#include "thesis/step.h"

#include <algorithm>
#include <memory>
#include <new>
#include <utility>

#include "base/stopwatch.h"
#include "thesis/step_scope.h"

namespace adaptive_bvh {
namespace {

/// With fewer primitives, distributing tasks to threads costs more than it gains.
constexpr int kParallelPrimitives = 50000;

/// The new array that openStep needs for the first two-frame update; null for other steps.
template <typename BV>
std::unique_ptr<fcl::Vector3<typename BV::S>[]> newFrame(const fcl::BVHModel<BV>& model,
                                                         StepKind kind) {
  using Point = fcl::Vector3<typename BV::S>;
  if (kind == StepKind::Replace || model.prev_vertices) return nullptr;
  return std::unique_ptr<Point[]>(new Point[static_cast<std::size_t>(model.num_vertices)]);
}

/// Makes `vertices` the array for the new positions, and sets FCL's build state. In a two-frame
/// update `prev_vertices` becomes the current positions; its first array is `new_frame`.
template <typename BV, typename Frame>
void openStep(const UpdateTarget<BV>& target, StepKind kind, Frame new_frame) {
  fcl::BVHModel<BV>& model = target.model;
  if (kind == StepKind::Replace) {
    delete[] model.prev_vertices;
    model.prev_vertices = nullptr;
    model.build_state = fcl::BVH_BUILD_STATE_PROCESSED;
  } else {
    target.restorePositions();
    if (!model.prev_vertices) model.prev_vertices = new_frame.release();
    std::swap(model.vertices, model.prev_vertices);
    model.build_state = fcl::BVH_BUILD_STATE_UPDATED;
  }
}

/// Records the root in the change detector if the step changed it. If the step refitted the root,
/// the propagation stores its new radius, which `record` has raised.
template <typename BV, typename Method>
void recordRoot(const UpdateTarget<BV>& target, Method& method, bool refitted) {
  BV& root = target.volume(0);
  if (target.tree.detector.matches(root)) return;
  target.tree.detector.record(root, root);
  if (refitted) method.refitted(target, 0);
}

/// Moves and inflates all volumes. Returns false if single precision cannot express the motion or
/// the body; then the update's state must be reset.
template <typename BV, typename Scope>
bool moveVolumes(const UpdateTarget<BV>& target, Scope& scope,
                 const typename Scope::Summary& summary, UpdateReport& report) {
  auto& method = scope.method();
  if (!method.canFollow(summary.largestDisplacement())) return false;
  method.accept(target, summary);
  const PropagationCounts counts = scope.propagate();
  report.moved = counts.moved;
  report.inflated = counts.inflated;
  return method.isInRange();
}

/// Moves all volumes, then refits unfit ones. Returns false like moveVolumes. In a step at rest no
/// volume moves, but other volumes may have become unfit, because queries have visited them.
template <typename BV, typename Scope>
bool followPositions(const UpdateTarget<BV>& target, Scope& scope, bool is_at_rest,
                     const typename Scope::Summary& summary, UpdateReport& report,
                     Stopwatch& watch) {
  if (is_at_rest)
    scope.rest();
  else if (!moveVolumes(target, scope, summary, report))
    return false;
  if (is_at_rest && !scope.judgesAtRest()) return true;
  report.propagation_seconds = watch.lap();
  const auto refits = scope.refit();
  report.refitted_leaves = refits.leaves;
  report.refitted_inner = refits.inner;
  report.refitted_primitives = refits.primitives;
  recordRoot(target, scope.method(), refits.root);
  report.refit_seconds = watch.lap();
  return true;
}

/// Refits all volumes and resets the update's state at the current positions. If there is no memory
/// for that, the change detector stays invalidated, and the next reader of the tree does it.
template <typename BV>
void beginAnew(const UpdateTarget<BV>& target, UpdateState<BV>& state) {
  target.tree.detector.invalidate();
  try {
    repairIfChanged(target, state);
  } catch (const std::bad_alloc&) {
  }
}

/// Reads the new positions into `summary` and writes them to the model. Returns false if a position
/// is not usable.
template <typename BV, typename Scope>
bool readAndWrite(const UpdateTarget<BV>& target, Scope& scope,
                  const StepInput<typename BV::S>& input, typename Scope::Summary& summary) {
  auto new_frame = newFrame(target.model, input.kind);
  try {
    summary = scope.read();
  } catch (const std::bad_alloc&) {
    scope.discard();
    throw;
  }
  if (!summary.isSurelyUsable() && !usablePositions(input.positions, input.count)) {
    scope.discard();
    return false;
  }
  openStep(target, input.kind, std::move(new_frame));
  scope.write(summary);
  return true;
}

/// Runs a step of AllVertices or SomeVertices. Returns false if a position is not usable.
template <typename BV, typename Scope>
bool run(const UpdateTarget<BV>& target, UpdateState<BV>& state, Scope& scope,
         const StepInput<typename BV::S>& input, UpdateReport& report, Stopwatch& watch) {
  const bool repaired = report.resynchronised;  // then the marks of refits are those of the repair
  const bool is_at_rest = scope.isAtRest();
  typename Scope::Summary summary;
  if (!is_at_rest && !readAndWrite(target, scope, input, summary)) return false;
  report.largest_displacement = static_cast<double>(summary.largestDisplacement());
  if (!repaired) target.tree.refits.clear();
  report.displacement_seconds = watch.lap();
  bool followed = false;
  try {
    followed = followPositions(target, scope, is_at_rest, summary, report, watch);
  } catch (const std::bad_alloc&) {  // during a refit; the positions are already written
  }
  if (!followed) {
    beginAnew(target, state);
    report.resynchronised = true;
    report.refit_seconds = watch.lap();
  }
  target.tree.statistics.clear();
  return true;
}

// The steps of one propagation method, for takeStep.

template <typename BV, typename Method>
bool stepOfAll(Method& method, const UpdateTarget<BV>& target, UpdateState<BV>& state,
               const RefitPolicy& policy, const StepInput<typename BV::S>& input,
               UpdateReport& report, Stopwatch& watch) {
  const bool parallel = target.model.getBV(0).num_primitives >= kParallelPrimitives;
  TaskPool pool(parallel ? state.threads : 1);
  AllVertices<BV, Method> all(target, method, policy, input, pool);
  return run(target, state, all, input, report, watch);
}

template <typename BV, typename Method>
bool stepOfSome(Method& method, const UpdateTarget<BV>& target, UpdateState<BV>& state,
                const RefitPolicy& policy, const StepInput<typename BV::S>& input,
                UpdateReport& report, Stopwatch& watch) {
  using Point = fcl::Vector3<typename BV::S>;
  // Checks all positions, also those that are not used because their vertex is listed again.
  if (!usablePositions(input.positions, input.count)) return false;
  if constexpr (Method::kTakesSomeVertices) {
    if (!target.model.prev_vertices) {
      SomeVertices<BV, Method> some(target, method, policy, input, state.moved);
      return run(target, state, some, input, report, watch);
    }
  }
  std::vector<Point> all(target.tree.positions);
  for (std::size_t i = 0; i < input.count; ++i) all[input.indices[i]] = input.positions[i];
  return stepOfAll(method, target, state, policy, {input.kind, all.data(), all.size()}, report,
                   watch);
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
  Stopwatch watch;
  report.nodes = target.nodes();
  const auto step = [&](auto& method) {
    return input.indices ? stepOfSome(method, target, state, policy, input, report, watch)
                         : stepOfAll(method, target, state, policy, input, report, watch);
  };
  const bool is_taken = std::visit(step, state.method);
  if (!is_taken) target.restorePositions();
  return is_taken;
}

template <typename BV>
void updateLocalBounds(fcl::BVHModel<BV>& model) {
  using S = typename BV::S;
  VertexSummary<S> summary;
  summary.add(model.vertices, model.vertices, static_cast<std::size_t>(model.num_vertices));
  setLocalBox(model, summary.low, summary.high);
  S squared = 0;
  for (int v = 0; v < model.num_vertices; ++v) {
    const fcl::Vector3<S> d = model.vertices[v] - model.aabb_center;
    squared = std::max(squared, d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
  }
  setLocalRadius(model, squared);
}

/// Resets the update's state to FCL's current tree; `start` must follow.
template <typename BV>
void reset(const UpdateTarget<BV>& target, UpdateState<BV>& state) {
  target.tree.assign(target.model);
  state.moved = DirtyNodes();
  updateLocalBounds(target.model);
  std::visit([&](auto& method) { method.reset(target); }, state.method);
}

/// Starts from volumes fitted to the current positions; `root` becomes the root's volume. Records
/// the root last, because other threads may read the whole tree from then on.
template <typename BV>
void start(const UpdateTarget<BV>& target, UpdateState<BV>& state, const BV& root) {
  std::visit([&](auto& method) { method.start(target, root); }, state.method);
  target.tree.detector.record(target.volume(0), root);
}

template <typename BV>
void startFromBuild(const UpdateTarget<BV>& target, UpdateState<BV>& state) {
  reset(target, state);
  start(target, state, target.volume(0));
}

/// Refits every volume except the root's in place. Returns the root's new volume, which the change
/// detector writes last, because other threads' queries may be reading the root.
template <typename BV>
BV refitAllButRoot(const UpdateTarget<BV>& target) {
  for (int i = 1; i < target.nodes(); ++i) target.volume(i) = target.fitted(i);
  return target.fitted(0);
}

template <typename BV>
bool repairIfChanged(const UpdateTarget<BV>& target, UpdateState<BV>& state) {
  AdaptiveTree<BV>& tree = target.tree;
  if (target.nodes() == 0 || tree.detector.matches(target.volume(0))) return false;
  const std::lock_guard<std::mutex> lock(tree.repairing);
  if (tree.detector.matches(target.volume(0))) return true;  // another thread has repaired it
  reset(target, state);
  tree.refits.markAll();
  start(target, state, refitAllButRoot(target));
  return true;
}

#define ADAPTIVE_BVH_INSTANTIATE(BV)                                                    \
  template struct UpdateState<BV>;                                                      \
  template bool takeStep(const UpdateTarget<BV>&, UpdateState<BV>&, const RefitPolicy&, \
                         const StepInput<BV::S>&, UpdateReport&);                       \
  template void updateLocalBounds(fcl::BVHModel<BV>&);                                  \
  template void startFromBuild(const UpdateTarget<BV>&, UpdateState<BV>&);              \
  template bool repairIfChanged(const UpdateTarget<BV>&, UpdateState<BV>&);
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
