#include "thesis/model_state.h"

#include <algorithm>
#include <new>
#include <utility>

#include "deformable/mesh_step.h"
#include "thesis/fcl_build.h"
#include "thesis/fcl_model.h"

namespace adaptive_bvh {
namespace {

/// Applies to the mesh a step that the model has taken; `vertices` are the model's new positions.
/// `moved` has room for the positions of a step of some vertices.
template <typename S>
void stepMesh(DeformableMesh<S>& mesh, StepMemory& memory, const StepInput<S>& input,
              const fcl::Vector3<S>* vertices, std::vector<fcl::Vector3<S>>& moved) {
  auto& mesh_state = detail::MeshAccess<S>::held(mesh);
  if (!input.indices)
    return takeStep<S>(mesh_state, mesh, PositionArray<S>{vertices[0].data()},
                       input.kind == StepKind::TwoFrames, memory);
  // Not from input.positions, which the model's step may have overwritten.
  for (std::size_t i = 0; i < input.count; ++i) moved[i] = vertices[input.indices[i]];
  takeStep<S>(mesh_state, mesh, input.indices, moved.data(), input.count, memory);
}

UpdateKind stepOf(StepKind kind, bool has_indices) {
  if (has_indices) return UpdateKind::Some;
  return kind == StepKind::TwoFrames ? UpdateKind::TwoFrames : UpdateKind::All;
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
bool takeStep(fcl::BVHModel<BV>& model, ModelState<BV>& state, StepInput<typename BV::S> input) {
  using S = typename BV::S;
  const UpdateTarget<BV> target{model, state.tree};
  UpdateReport report;
  report.resynchronised = repairIfChanged(target, state.update);
  std::vector<fcl::Vector3<S>> copied_positions;
  std::optional<StepMemory> memory;  // the mesh's, allocated before anything changes
  if (state.mesh) {
    if (!state.meshIsCurrent()) {
      // Copied, because input.positions may lie in the mesh, which renewMesh replaces.
      copied_positions.assign(input.positions, input.positions + input.count);
      input.positions = copied_positions.data();
      renewMesh(model, state);
    }
    if (input.indices) state.moved.resize(input.count);
    memory.emplace(detail::MeshAccess<S>::held(*state.mesh),
                   stepOf(input.kind, input.indices != nullptr));
  }
  if (!takeStep<BV>(target, state.update, state.policy, input, report)) return false;
  state.report = report;
  if (!memory) return true;
  stepMesh<S>(*state.mesh, *memory, input, model.vertices, state.moved);
  state.mesh_resets = state.tree.resets;
  return true;
}

template <typename BV>
int beginPositions(fcl::BVHModel<BV>& model, ModelState<BV>& state, StepKind kind) {
  return codeOf([&] { return state.buffer.begin(kind, model.build_state, model.num_vertices); });
}

template <typename BV>
int addPositions(fcl::BVHModel<BV>& model, ModelState<BV>& state, StepKind kind,
                 const fcl::Vector3<typename BV::S>* positions, std::size_t count) {
  return state.buffer.add(kind, model.build_state, model.num_vertices, positions, count);
}

template <typename BV>
int endPositions(fcl::BVHModel<BV>& model, ModelState<BV>& state, StepKind kind, bool refit) {
  int code = state.buffer.end(kind, model.build_state, model.num_vertices);
  if (code != fcl::BVH_OK) return code;
  const auto& positions = state.buffer.positions();
  code = codeOf([&]() -> int {
    if (!refit) return rebuild(model, state, kind);
    takeStep(model, state, {kind, positions.data(), positions.size(), nullptr});
    return fcl::BVH_OK;
  });
  if (code != fcl::BVH_OK) state.buffer.reopen(model.build_state);
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
void renewMesh(const fcl::BVHModel<BV>& model, ModelState<BV>& state) {
  using S = typename BV::S;
  if (model.num_tris == 0) {
    state.mesh.reset();
    return;
  }
  if (state.mesh)
    *state.mesh = DeformableMesh<S>(model);
  else
    state.mesh.emplace(model);
  state.mesh->setUpdateThreads(state.update.threads);
  state.mesh_resets = state.tree.resets;
}

#define ADAPTIVE_BVH_INSTANTIATE(BV)                                                    \
  template bool takeStep(fcl::BVHModel<BV>&, ModelState<BV>&, StepInput<BV::S>);        \
  template int beginPositions(fcl::BVHModel<BV>&, ModelState<BV>&, StepKind);           \
  template int addPositions(fcl::BVHModel<BV>&, ModelState<BV>&, StepKind,              \
                            const fcl::Vector3<BV::S>*, std::size_t);                   \
  template int endPositions(fcl::BVHModel<BV>&, ModelState<BV>&, StepKind, bool);       \
  template void takeOverBuild(fcl::BVHModel<BV>&, ModelState<BV>&, fcl::BVHModel<BV>&); \
  template void renewMesh(const fcl::BVHModel<BV>&, ModelState<BV>&);
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
