#include "adaptive_bvh/adaptive_bvh_model.h"

#include <algorithm>
#include <mutex>
#include <new>
#include <optional>
#include <stdexcept>
#include <utility>

#include "deformable/mesh_step.h"
#include "thesis/fcl_build.h"
#include "thesis/model_state.h"
#include "thesis/position_errors.h"

namespace adaptive_bvh {
namespace {

template <typename BV>
bool isBegun(const fcl::BVHModel<BV>& model) {
  return model.build_state == fcl::BVH_BUILD_STATE_BEGUN;
}

template <typename BV>
bool isBuilt(const fcl::BVHModel<BV>& model) {
  return model.build_state == fcl::BVH_BUILD_STATE_PROCESSED ||
         model.build_state == fcl::BVH_BUILD_STATE_UPDATED;
}

StepKind kindOf(bool two_frames) { return two_frames ? StepKind::TwoFrames : StepKind::Replace; }

/// Every index of a triangle names a vertex, and every coordinate is finite and not too large.
template <typename BV>
bool isUsable(const fcl::BVHModel<BV>& model) {
  const auto count = static_cast<std::size_t>(model.num_vertices);
  for (int t = 0; t < model.num_tris; ++t)
    for (int k = 0; k < 3; ++k)
      if (model.tri_indices[t][k] >= count) return false;
  return usablePositions<typename BV::S>(model.vertices, count);
}

/// Calls call(), which returns one of FCL's codes; that for no memory if there is none.
template <typename Call>
int codeOf(const Call& call) {
  try {
    return call();
  } catch (const std::bad_alloc&) {
    return fcl::BVH_ERR_MODEL_OUT_OF_MEMORY;
  }
}

/// Calls add(), one of FCL's, on a model that is being built. All is added or nothing.
template <typename BV, typename Add>
int addTo(fcl::BVHModel<BV>& model, const Add& add) {
  if (!isBegun(model)) return fcl::BVH_ERR_BUILD_OUT_OF_SEQUENCE;
  const int vertices = model.num_vertices, triangles = model.num_tris;
  const int code = codeOf(add);
  if (code == fcl::BVH_OK) return code;
  model.num_vertices = vertices;
  model.num_tris = triangles;
  return code;
}

/// A copy of it allocates nothing.
template <typename BV>
const fcl::BVHModel<BV>& emptyBase() {
  static const fcl::BVHModel<BV> empty;
  return empty;
}

/// Exchanges all that FCL's part of two models holds. Allocates nothing. FCL's model has no move,
/// but a shallow assignment.
template <typename BV>
void swapBases(fcl::BVHModel<BV>& a, fcl::BVHModel<BV>& b) {
  fcl::BVHModel<BV> between(emptyBase<BV>());
  between = a;
  a = b;
  b = between;
  between = emptyBase<BV>();
}

}  // namespace

// ---- construction -------------------------------------------------------------------------------

template <typename BV>
AdaptiveBVHModel<BV>::AdaptiveBVHModel(const RefitPolicy& policy, HierarchyStrategy strategy)
    : state_(std::make_unique<State>()) {
  setRefitPolicy(policy);
  this->bv_fitter = sharedFitter<BV>();
  this->bv_splitter = sharedSplitter<BV>(strategy);
}

template <typename BV>
AdaptiveBVHModel<BV>::AdaptiveBVHModel(HierarchyStrategy strategy)
    : AdaptiveBVHModel(RefitPolicy(), strategy) {}

template <typename BV>
AdaptiveBVHModel<BV>::AdaptiveBVHModel(const AdaptiveBVHModel& other)
    : Base((other.repair(), other)), state_(std::make_unique<State>(*other.state_)) {}

template <typename BV>
AdaptiveBVHModel<BV>::AdaptiveBVHModel(const Base& plain, const RefitPolicy& policy,
                                       HierarchyStrategy strategy)
    : Base(plain), state_(std::make_unique<State>()) {
  setRefitPolicy(policy);
  this->bv_fitter = sharedFitter<BV>();
  this->bv_splitter = sharedSplitter<BV>(strategy);
  if (isBuilt(*this)) computeLocalAABB();
}

template <typename BV>
AdaptiveBVHModel<BV>::AdaptiveBVHModel(AdaptiveBVHModel&& other) noexcept : AdaptiveBVHModel() {
  *this = std::move(other);
}

template <typename BV>
AdaptiveBVHModel<BV>& AdaptiveBVHModel<BV>::operator=(AdaptiveBVHModel&& other) noexcept {
  if (this == &other) return *this;
  swapBases<BV>(*this, other);
  state_.swap(other.state_);
  other.clear();
  return *this;
}

/// To the state of the default constructor. Allocates nothing.
template <typename BV>
void AdaptiveBVHModel<BV>::clear() {
  Base empty(emptyBase<BV>());
  empty.bv_fitter = sharedFitter<BV>();
  empty.bv_splitter = sharedSplitter<BV>(HierarchyStrategy::BottomUp);
  swapBases<BV>(*this, empty);
  State& state = *state_;
  state.~State();
  new (&state) State();
}

template <typename BV>
AdaptiveBVHModel<BV>::~AdaptiveBVHModel() = default;

// ---- building -----------------------------------------------------------------------------------

template <typename BV>
int AdaptiveBVHModel<BV>::beginModel(int num_tris, int num_vertices) {
  if (this->build_state == fcl::BVH_BUILD_STATE_EMPTY) {
    // FCL leaves arrays here when a build was begun on a model that was not empty, and leaks them.
    delete[] this->vertices;
    delete[] this->tri_indices;
    this->vertices = nullptr;
    this->tri_indices = nullptr;
    return codeOf([&] { return Base::beginModel(num_tris, num_vertices); });
  }
  // FCL frees the model before it allocates. What FCL leaves is an empty model, and this code.
  return codeOf([&] {
    Base empty(emptyBase<BV>());
    empty.bv_splitter = this->bv_splitter;
    empty.bv_fitter = this->bv_fitter;
    fcl::CollisionGeometry<S>& geometry = empty;
    geometry = *this;
    swapBases<BV>(*this, empty);
    return fcl::BVH_ERR_BUILD_OUT_OF_SEQUENCE;
  });
}

template <typename BV>
int AdaptiveBVHModel<BV>::addVertex(const Point& p) {
  return addTo(*this, [&] { return Base::addVertex(p); });
}

template <typename BV>
int AdaptiveBVHModel<BV>::addTriangle(const Point& p1, const Point& p2, const Point& p3) {
  return addTo(*this, [&] { return Base::addTriangle(p1, p2, p3); });
}

template <typename BV>
int AdaptiveBVHModel<BV>::addSubModel(const std::vector<Point>& ps,
                                      const std::vector<fcl::Triangle>& ts) {
  return addTo(*this, [&] { return Base::addSubModel(ps, ts); });
}

template <typename BV>
int AdaptiveBVHModel<BV>::addSubModel(const std::vector<Point>& ps) {
  return addTo(*this, [&] { return Base::addSubModel(ps); });
}

template <typename BV>
int AdaptiveBVHModel<BV>::endModel() {
  if (!isBegun(*this)) return fcl::BVH_ERR_BUILD_OUT_OF_SEQUENCE;
  if (this->num_tris == 0 && this->num_vertices == 0) return fcl::BVH_ERR_BUILD_EMPTY_MODEL;
  if (!isUsable(*this)) return fcl::BVH_ERR_INCORRECT_DATA;
  return codeOf([&] {
    Base built(*this);  // with room for no more than there is
    const int code = built.endModel();
    if (code == fcl::BVH_OK) takeOverBuild(built);
    return code;
  });
}

/// Takes over a model of FCL's that it has just built, and begins at its tree. Its volumes are
/// sound when our fitter made them. Throws std::bad_alloc; this model then is what it was.
template <typename BV>
void AdaptiveBVHModel<BV>::takeOverBuild(Base& built) {
  State& state = *state_;
  state.tree.detector.invalidate();
  swapBases<BV>(*this, built);
  const UpdateTarget<BV> target{*this, state.tree};
  try {
    if (this->bv_fitter == sharedFitter<BV>())
      adoptBuild(target, state.update);
    else
      repairIfChanged(target, state.update);
    if (state.mesh) renewMesh();
  } catch (const std::bad_alloc&) {
    state.tree.detector.invalidate();
    swapBases<BV>(*this, built);
    throw;
  }
  state.report = UpdateReport();
  state.report.nodes = this->getNumBVs();
  state.report.resynchronised = true;
}

// ---- new positions by FCL's calls ---------------------------------------------------------------

template <typename BV>
int AdaptiveBVHModel<BV>::addPositions(bool two_frames, const Point* positions, std::size_t count) {
  return state_->buffer.add(kindOf(two_frames), this->build_state, this->num_vertices, positions,
                            count);
}

/// Builds a new tree, as FCL does, for the positions of a step of its calls.
template <typename BV>
int AdaptiveBVHModel<BV>::rebuild(bool two_frames) {
  const std::vector<Point>& positions = state_->buffer.positions();
  Base built(*this);
  if (two_frames) {
    // FCL would allocate it when it has two pointers to the present ones already.
    if (!built.prev_vertices) built.prev_vertices = new Point[positions.size()];
    built.beginUpdateModel();
    built.updateSubModel(positions);
    built.endUpdateModel(false, false);  // builds on the new positions, then fits both
  } else {
    built.beginReplaceModel();
    built.replaceSubModel(positions);
    built.endReplaceModel(false, false);
  }
  takeOverBuild(built);
  if (two_frames) return fcl::BVH_OK;
  std::copy(positions.begin(), positions.end(), built.vertices);  // their address stays
  std::swap(this->vertices, built.vertices);
  return fcl::BVH_OK;
}

/// Ends a step of FCL's calls.
template <typename BV>
int AdaptiveBVHModel<BV>::endPositions(bool two_frames, bool refit) {
  State& state = *state_;
  const StepKind kind = kindOf(two_frames);
  int code = state.buffer.end(kind, this->build_state, this->num_vertices);
  if (code != fcl::BVH_OK) return code;
  const std::vector<Point>& positions = state.buffer.positions();
  code = codeOf([&]() -> int {
    if (!refit) return rebuild(two_frames);
    step(kind, positions.data(), positions.size(), nullptr);
    return fcl::BVH_OK;
  });
  if (code != fcl::BVH_OK) state.buffer.reopen(this->build_state);
  return code;
}

template <typename BV>
int AdaptiveBVHModel<BV>::beginReplaceModel() {
  return codeOf([&] {
    return state_->buffer.begin(StepKind::Replace, this->build_state, this->num_vertices);
  });
}

template <typename BV>
int AdaptiveBVHModel<BV>::replaceVertex(const Point& p) {
  return addPositions(false, &p, 1);
}

template <typename BV>
int AdaptiveBVHModel<BV>::replaceTriangle(const Point& p1, const Point& p2, const Point& p3) {
  const Point corners[3] = {p1, p2, p3};
  return addPositions(false, corners, 3);
}

template <typename BV>
int AdaptiveBVHModel<BV>::replaceSubModel(const std::vector<Point>& ps) {
  return addPositions(false, ps.data(), ps.size());
}

template <typename BV>
int AdaptiveBVHModel<BV>::endReplaceModel(bool refit, bool) {
  return endPositions(false, refit);
}

template <typename BV>
int AdaptiveBVHModel<BV>::beginUpdateModel() {
  return codeOf([&] {
    return state_->buffer.begin(StepKind::TwoFrames, this->build_state, this->num_vertices);
  });
}

template <typename BV>
int AdaptiveBVHModel<BV>::updateVertex(const Point& p) {
  return addPositions(true, &p, 1);
}

template <typename BV>
int AdaptiveBVHModel<BV>::updateTriangle(const Point& p1, const Point& p2, const Point& p3) {
  const Point corners[3] = {p1, p2, p3};
  return addPositions(true, corners, 3);
}

template <typename BV>
int AdaptiveBVHModel<BV>::updateSubModel(const std::vector<Point>& ps) {
  return addPositions(true, ps.data(), ps.size());
}

template <typename BV>
int AdaptiveBVHModel<BV>::endUpdateModel(bool refit, bool) {
  return endPositions(true, refit);
}

// ---- new positions in one call ------------------------------------------------------------------

namespace {

/// Lets the mesh follow a step that the model has taken. `moved`: room for the positions of some.
template <typename S>
void stepMesh(DeformableMesh<S>& mesh, StepMemory& memory, const StepInput<S>& input,
              const fcl::Vector3<S>* vertices, std::vector<fcl::Vector3<S>>& moved) {
  auto& held = detail::MeshAccess<S>::held(mesh);
  if (!input.indices)
    return takeStep<S>(held, mesh, PositionArray<S>{vertices[0].data()},
                       input.kind == StepKind::TwoFrames, memory);
  // The positions that were given may have lain in the model's own arrays.
  for (std::size_t i = 0; i < input.count; ++i) moved[i] = vertices[input.indices[i]];
  takeStep<S>(held, mesh, input.indices, moved.data(), input.count, memory);
}

StepOf stepOf(StepKind kind, bool is_of_some) {
  if (is_of_some) return StepOf::Some;
  return kind == StepKind::TwoFrames ? StepOf::TwoFrames : StepOf::All;
}

}  // namespace

/// A step of all vertices, or of some, and of the mesh if there is one. Returns false where a
/// position cannot be used. Then, and when it throws std::bad_alloc, nothing has changed: all that
/// the mesh needs is allocated before the model takes the step.
template <typename BV>
bool AdaptiveBVHModel<BV>::step(StepKind kind, const Point* positions, std::size_t count,
                                const unsigned* indices) {
  State& state = *state_;
  const UpdateTarget<BV> target{*this, state.tree};
  UpdateReport report;
  report.resynchronised = repairIfChanged(target, state.update);
  std::vector<Point> aside;  // of positions that may lie in the mesh
  std::optional<StepMemory> memory;
  if (state.mesh) {
    if (!meshIsCurrent()) {
      aside.assign(positions, positions + count);
      positions = aside.data();
      renewMesh();
    }
    if (indices) state.moved.resize(count);
    memory.emplace(detail::MeshAccess<S>::held(*state.mesh), stepOf(kind, indices != nullptr));
  }
  const StepInput<S> input{kind, positions, count, indices};
  if (!takeStep<BV>(target, state.update, state.policy, input, report)) return false;
  state.report = report;
  if (!memory) return true;
  stepMesh<S>(*state.mesh, *memory, input, this->vertices, state.moved);
  state.mesh_adoption = state.tree.adoptions;
  return true;
}

template <typename BV>
const UpdateReport& AdaptiveBVHModel<BV>::take(const Point* positions, std::size_t count,
                                               const unsigned* indices) {
  if (!step(StepKind::Replace, positions, count, indices)) refuseCoordinate<S>(positions, indices);
  return state_->report;
}

template <typename BV>
const UpdateReport& AdaptiveBVHModel<BV>::update(const Point* positions, std::size_t count) {
  requireBuilt();
  if (count != static_cast<std::size_t>(this->num_vertices))
    refuseUpdate(std::to_string(count) + " positions given for " +
                 std::to_string(this->num_vertices) + " vertices");
  if (positions == this->vertices)
    refuseUpdate(
        "the positions are the model's own vertices; keep the new ones in an array of their own");
  return take(positions, count, nullptr);
}

template <typename BV>
const UpdateReport& AdaptiveBVHModel<BV>::update(const std::vector<Point>& positions) {
  return update(positions.data(), positions.size());
}

template <typename BV>
const UpdateReport& AdaptiveBVHModel<BV>::updateColumns(const Columns& positions) {
  static_assert(sizeof(Point) == 3 * sizeof(S), "a column is a point");
  return update(reinterpret_cast<const Point*>(positions.data()),
                static_cast<std::size_t>(positions.cols()));
}

template <typename BV>
void AdaptiveBVHModel<BV>::refuseShape(Eigen::Index rows, Eigen::Index columns) const {
  refuseMatrix(rows, columns, this->num_vertices);
}

template <typename BV>
const UpdateReport& AdaptiveBVHModel<BV>::update(const unsigned* indices, const Point* positions,
                                                 std::size_t count) {
  requireBuilt();
  for (std::size_t i = 0; i < count; ++i)
    if (indices[i] >= static_cast<std::size_t>(this->num_vertices))
      refuseUpdate("index " + std::to_string(indices[i]) + " given for " +
                   std::to_string(this->num_vertices) + " vertices");
  static constexpr unsigned kNone = 0;  // no indices at all would mean every vertex
  return take(positions, count, indices ? indices : &kNone);
}

template <typename BV>
const UpdateReport& AdaptiveBVHModel<BV>::update(const std::vector<unsigned>& indices,
                                                 const std::vector<Point>& positions) {
  if (indices.size() != positions.size())
    refuseUpdate(std::to_string(positions.size()) + " positions given for " +
                 std::to_string(indices.size()) + " indices");
  return update(indices.data(), positions.data(), indices.size());
}

/// A step that was begun by FCL's calls is abandoned.
template <typename BV>
void AdaptiveBVHModel<BV>::requireBuilt() {
  state_->buffer.abandon(this->build_state);
  if (!isBuilt(*this))
    throw std::logic_error("AdaptiveBVHModel::update: the model is not built; call endModel first");
}

// ---- the mesh of our queries --------------------------------------------------------------------

template <typename BV>
auto AdaptiveBVHModel<BV>::mesh() -> const DeformableMesh<S>& {
  if (!isBuilt(*this) || this->num_tris == 0)
    throw std::logic_error("AdaptiveBVHModel::mesh: the model is not built of triangles");
  repair();
  if (!meshIsCurrent()) renewMesh();
  return *state_->mesh;
}

template <typename BV>
auto AdaptiveBVHModel<BV>::mesh() const -> const DeformableMesh<S>& {
  repair();
  if (!meshIsCurrent())
    throw std::logic_error(
        "AdaptiveBVHModel::mesh: the mesh of a const model was not made, or the model was changed "
        "through a fcl::BVHModel since; call mesh() once on the model itself");
  return *state_->mesh;
}

template <typename BV>
bool AdaptiveBVHModel<BV>::hasMesh() const {
  return state_->mesh.has_value();
}

template <typename BV>
bool AdaptiveBVHModel<BV>::meshIsCurrent() const {
  return state_->mesh && state_->mesh_adoption == state_->tree.adoptions;
}

/// Builds the mesh, in the object that there is if there is one.
template <typename BV>
void AdaptiveBVHModel<BV>::renewMesh() {
  State& state = *state_;
  if (this->num_tris == 0) {
    state.mesh.reset();
    return;
  }
  const Base& model = *this;
  if (state.mesh)
    *state.mesh = DeformableMesh<S>(model);
  else
    state.mesh.emplace(model);
  state.mesh->setUpdateThreads(state.update.threads);
  state.mesh_adoption = state.tree.adoptions;
}

// ---- hooks that FCL calls -----------------------------------------------------------------------

/// FCL's mutators are not virtual, so a tree may have been changed through a fcl::BVHModel&. The
/// first call that reads it repairs it. That call is const for FCL; the repair only restores the
/// invariant. Any number of threads may come here at once.
template <typename BV>
void AdaptiveBVHModel<BV>::repair() const {
  repairIfChanged<BV>({const_cast<AdaptiveBVHModel&>(*this), state_->tree}, state_->update);
}

template <typename BV>
fcl::NODE_TYPE AdaptiveBVHModel<BV>::getNodeType() const {
  repair();
  return this->getModelType() == fcl::BVH_MODEL_TRIANGLES ? Base::getNodeType() : fcl::BV_UNKNOWN;
}

template <typename BV>
void AdaptiveBVHModel<BV>::computeLocalAABB() {
  repair();
  updateLocalBounds(*this);
}

// ---- looking in ---------------------------------------------------------------------------------

template <typename BV>
const UpdateReport& AdaptiveBVHModel<BV>::lastUpdate() const {
  return state_->report;
}

template <typename BV>
const RefitPolicy& AdaptiveBVHModel<BV>::refitPolicy() const {
  return state_->policy;
}

template <typename BV>
void AdaptiveBVHModel<BV>::setRefitPolicy(const RefitPolicy& policy) {
  policy.check();
  const RefitPolicy before = state_->policy;
  state_->policy = policy;
  if (before.propagation == policy.propagation) return;
  state_->update.setPropagation(policy.propagation);
  state_->tree.detector.invalidate();  // the new propagation has kept nothing yet
  try {
    repair();
  } catch (const std::bad_alloc&) {
    state_->policy = before;
    state_->update.setPropagation(before.propagation);
    throw;
  }
}

template <typename BV>
void AdaptiveBVHModel<BV>::setUpdateThreads(int threads) {
  if (threads < 1)
    throw std::invalid_argument("AdaptiveBVHModel::setUpdateThreads: " + std::to_string(threads) +
                                " threads; at least 1 is needed");
  state_->update.threads = threads;
  if (state_->mesh) state_->mesh->setUpdateThreads(threads);
}

template <typename BV>
auto AdaptiveBVHModel<BV>::originalRadius(int node) const -> S {
  repair();
  const UpdateTarget<BV> target{const_cast<AdaptiveBVHModel&>(*this), state_->tree};
  return std::visit([&](const auto& method) { return method.originalRadius(target, node); },
                    state_->update.method);
}

template <typename BV>
auto AdaptiveBVHModel<BV>::latestDisplacement(int triangle) const -> S {
  repair();
  const auto* method = std::get_if<DisplacementPropagation<BV>>(&state_->update.method);
  return method ? method->latestDisplacement(triangle) : 0;
}

template <typename BV>
auto AdaptiveBVHModel<BV>::overallDisplacement(int triangle) const -> S {
  repair();
  const auto* method = std::get_if<DisplacementPropagation<BV>>(&state_->update.method);
  return method ? method->overallDisplacement(triangle) : 0;
}

template <typename BV>
QueryWork AdaptiveBVHModel<BV>::recordedWork() const {
  return state_->tree.statistics.work();
}

template <typename BV>
bool AdaptiveBVHModel<BV>::traversed(int node) const {
  repair();
  return state_->tree.statistics.visited(node);
}

template <typename BV>
std::vector<int> AdaptiveBVHModel<BV>::refittedNodes() const {
  repair();
  return state_->tree.refits.marked();
}

template <typename BV>
std::size_t AdaptiveBVHModel<BV>::trackingBytes() const {
  const State& state = *state_;
  return sizeof(State) + state.tree.bytes() + state.update.bytes() + state.buffer.bytes() +
         state.moved.capacity() * sizeof(Point) +
         (state.mesh ? state.mesh->bytes() - sizeof(*state.mesh) : 0);
}

template <typename BV>
bool AdaptiveBVHModel<BV>::validate(std::string* reason) const {
  if (state_->tree.detector.isInvalidated()) repair();  // an update ran out of memory
  // Another thread's query may repair the tree meanwhile.
  const std::lock_guard<std::mutex> lock(state_->tree.repairing);
  if (!checkTree<BV>(*this, reason)) return false;
  return !meshIsCurrent() || state_->mesh->validate(reason);
}

#define ADAPTIVE_BVH_INSTANTIATE(BV) template class AdaptiveBVHModel<BV>;
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
