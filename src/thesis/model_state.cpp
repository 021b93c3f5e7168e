#include "thesis/model_state.h"

#include <algorithm>
#include <new>
#include <type_traits>
#include <utility>

#include "deformable/mesh_step.h"
#include "mesh/position_errors.h"
#include "thesis/fcl_build.h"
#include "thesis/fcl_model.h"

namespace adaptive_bvh {
namespace {

UpdateKind stepOf(StepKind kind, bool has_indices) {
  if (has_indices) return UpdateKind::Some;
  return kind == StepKind::TwoFrames ? UpdateKind::TwoFrames : UpdateKind::All;
}

/// The positions in double precision: themselves, or converted to `memory`, which has their size.
const fcl::Vector3d* inDouble(const fcl::Vector3d* positions, std::vector<fcl::Vector3d>&) {
  return positions;
}

const fcl::Vector3d* inDouble(const fcl::Vector3f* positions, std::vector<fcl::Vector3d>& memory) {
  for (std::size_t i = 0; i < memory.size(); ++i) memory[i] = positions[i].cast<double>();
  return memory.data();
}

/// Whether some positions lie in a mesh. Those in single precision never do.
bool lieIn(const DeformableMesh& mesh, const fcl::Vector3d* positions, std::size_t count) {
  return overlap(positions, count, mesh.vertices().data(), mesh.vertices().size());
}
bool lieIn(const DeformableMesh&, const fcl::Vector3f*, std::size_t) { return false; }

/// Applies to the mesh a step that the model has taken.
template <typename S>
void stepMesh(DeformableMesh& mesh, StepMemory& memory, const StepInput<S>& input,
              std::vector<fcl::Vector3d>& converted) {
  MeshState& state = detail::MeshAccess::state(mesh);
  const fcl::Vector3d* const positions = inDouble(input.positions, converted);
  if (input.indices) return takeStep(state, mesh, input.indices, positions, input.count, memory);
  takeStep(state, mesh, {positions[0].data()}, input.kind == StepKind::TwoFrames, memory);
}

/// Applies the buffered step by building a new tree, as FCL does without `refit`.
template <typename BV>
int rebuild(fcl::BVHModel<BV>& model, ModelState<BV>& state, StepKind kind) {
  using Point = fcl::Vector3<typename BV::S>;
  const std::vector<Point>& positions = state.buffer.positions();
  fcl::BVHModel<BV> built(model);
  if (kind == StepKind::TwoFrames) {
    // Allocated here: FCL allocates it while two pointers refer to the current positions, which
    // would be freed twice if it threw.
    if (!built.prev_vertices) built.prev_vertices = new Point[positions.size()];
    built.beginUpdateModel();
    built.updateSubModel(positions);
    built.endUpdateModel(false, false);  // builds on the new positions, then fits both
  } else {
    built.beginReplaceModel();
    built.replaceSubModel(positions);
    built.endReplaceModel(false, false);
  }
  takeOverBuild(model, state, built);
  if (kind == StepKind::TwoFrames) return fcl::BVH_OK;
  // A replacement in FCL keeps the address of the array `vertices`, which `built` now holds.
  std::copy(positions.begin(), positions.end(), built.vertices);
  std::swap(model.vertices, built.vertices);
  return fcl::BVH_OK;
}

}  // namespace

template <typename BV>
void takeStep(fcl::BVHModel<BV>& model, ModelState<BV>& state, StepInput<typename BV::S> input) {
  using S = typename BV::S;
  const UpdateTarget<BV> target{model, state.tree};
  UpdateReport report;
  report.resynchronised = repairIfChanged(target, state.update);
  const auto overlaps = [&](const fcl::Vector3<S>* own) {
    return own && overlap(input.positions, input.count, own, std::size_t(model.num_vertices));
  };
  const bool renews_mesh = state.mesh && !state.meshIsCurrent();
  std::vector<fcl::Vector3<S>> copies;  // of positions in arrays that the step writes or frees
  if (renews_mesh || overlaps(model.vertices) || overlaps(model.prev_vertices) ||
      (state.mesh && lieIn(*state.mesh, input.positions, input.count))) {
    copies.assign(input.positions, input.positions + input.count);
    input.positions = copies.data();
  }
  if (renews_mesh) renewMesh(model, state);
  std::optional<StepMemory> memory;  // the mesh's, allocated before anything changes
  if (state.mesh) {
    memory.emplace(detail::MeshAccess::state(*state.mesh),
                   stepOf(input.kind, input.indices != nullptr));
    if (!std::is_same<S, double>::value) state.converted.resize(input.count);
  }
  if (state.buffer.isOpen(model.build_state)) target.restorePositions();
  state.buffer.abandon(model.build_state);
  if (!takeStep<BV>(target, state.update, state.policy, input, report))
    requireUsablePositions<S>(
        "AdaptiveBVHModel::update", input.positions, input.count,
        [&](std::size_t i) { return input.indices ? input.indices[i] : i; },
        "; the model stays on its last positions");
  state.report = report;
  if (!memory) return;
  stepMesh(*state.mesh, *memory, input, state.converted);
  state.mesh_resets = state.tree.resets;
}

template <typename BV>
int beginPositions(fcl::BVHModel<BV>& model, ModelState<BV>& state, StepKind kind) {
  return codeOf([&] { return state.buffer.begin(kind, model.build_state, model.num_vertices); });
}

template <typename BV>
int addPositions(fcl::BVHModel<BV>& model, ModelState<BV>& state, StepKind kind,
                 const fcl::Vector3<typename BV::S>* positions, std::size_t count) {
  const auto& last = state.tree.positions;
  return state.buffer.add(
      kind, model.build_state, model.num_vertices, positions, count,
      last.size() == static_cast<std::size_t>(model.num_vertices) ? last.data() : nullptr);
}

template <typename BV>
int endPositions(fcl::BVHModel<BV>& model, ModelState<BV>& state, StepKind kind, bool refit) {
  const int ended = state.buffer.end(kind, model.build_state, model.num_vertices);
  if (ended == fcl::BVH_ERR_BUILD_OUT_OF_SEQUENCE) return ended;
  const auto& positions = state.buffer.positions();
  const UpdateTarget<BV> target{model, state.tree};
  const int code = codeOf([&]() -> int {
    if (ended != fcl::BVH_OK || !refit) {
      repairIfChanged(target, state.update);  // then the volumes enclose the present positions
      target.restorePositions();
    }
    if (ended != fcl::BVH_OK) return ended;
    if (!refit) return rebuild(model, state, kind);
    takeStep(model, state,
             {kind, positions.data(), positions.size(), nullptr, !state.buffer.moved()});
    return fcl::BVH_OK;
  });
  if (ended == fcl::BVH_OK && code != fcl::BVH_OK) state.buffer.reopen(model.build_state);
  return code;
}

template <typename BV>
void takeOverBuild(fcl::BVHModel<BV>& model, ModelState<BV>& state, fcl::BVHModel<BV>& built) {
  state.tree.detector.invalidate();
  swapBases<BV>(model, built);
  const UpdateTarget<BV> target{model, state.tree};
  try {
    if (model.bv_fitter == sharedFitter<BV>())
      startFromBuild(target, state.update);
    else
      repairIfChanged(target, state.update);
    if (state.mesh) renewMesh(model, state);
  } catch (const std::bad_alloc&) {
    state.tree.detector.invalidate();
    swapBases<BV>(model, built);
    throw;
  }
  state.report = UpdateReport();
  state.report.nodes = model.getNumBVs();
  state.report.resynchronised = true;
}

template <typename BV>
void renewMesh(fcl::BVHModel<BV>& model, ModelState<BV>& state) {
  UpdateTarget<BV>{model, state.tree}.restorePositions();
  if (model.num_tris == 0) {
    state.mesh.reset();
    return;
  }
  if (state.mesh)
    *state.mesh = DeformableMesh(model);
  else
    state.mesh.emplace(model);
  state.mesh->setThreads(state.update.threads);
  state.mesh_resets = state.tree.resets;
}

#define ADAPTIVE_BVH_INSTANTIATE(BV)                                                    \
  template void takeStep(fcl::BVHModel<BV>&, ModelState<BV>&, StepInput<BV::S>);        \
  template int beginPositions(fcl::BVHModel<BV>&, ModelState<BV>&, StepKind);           \
  template int addPositions(fcl::BVHModel<BV>&, ModelState<BV>&, StepKind,              \
                            const fcl::Vector3<BV::S>*, std::size_t);                   \
  template int endPositions(fcl::BVHModel<BV>&, ModelState<BV>&, StepKind, bool);       \
  template void takeOverBuild(fcl::BVHModel<BV>&, ModelState<BV>&, fcl::BVHModel<BV>&); \
  template void renewMesh(fcl::BVHModel<BV>&, ModelState<BV>&);
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
