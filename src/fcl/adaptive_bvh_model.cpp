#include "adaptive_bvh/adaptive_bvh_model.h"

#include <mutex>
#include <stdexcept>
#include <utility>

#include "fcl/model_state.h"
#include "fcl/position_errors.h"
#include "volumes/fcl_build.h"

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

// FCL's model has no move, but a shallow assignment, which is what a move begins with.
template <typename BV>
AdaptiveBVHModel<BV>::AdaptiveBVHModel(AdaptiveBVHModel&& other) noexcept : AdaptiveBVHModel() {
  *this = std::move(other);
}

template <typename BV>
AdaptiveBVHModel<BV>& AdaptiveBVHModel<BV>::operator=(AdaptiveBVHModel&& other) noexcept {
  if (this == &other) return *this;
  AdaptiveBVHModel old, empty;
  Base &base = *this, &source = other, &old_base = old;
  old_base = base;  // which frees it
  base = source;
  source = static_cast<const Base&>(empty);
  old.state_.swap(state_);
  state_.swap(other.state_);
  other.state_.swap(empty.state_);
  return *this;
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
  }
  return Base::beginModel(num_tris, num_vertices);
}

template <typename BV>
int AdaptiveBVHModel<BV>::addVertex(const Point& p) {
  return isBegun(*this) ? Base::addVertex(p) : fcl::BVH_ERR_BUILD_OUT_OF_SEQUENCE;
}

template <typename BV>
int AdaptiveBVHModel<BV>::addTriangle(const Point& p1, const Point& p2, const Point& p3) {
  return isBegun(*this) ? Base::addTriangle(p1, p2, p3) : fcl::BVH_ERR_BUILD_OUT_OF_SEQUENCE;
}

template <typename BV>
int AdaptiveBVHModel<BV>::addSubModel(const std::vector<Point>& ps,
                                      const std::vector<fcl::Triangle>& ts) {
  return isBegun(*this) ? Base::addSubModel(ps, ts) : fcl::BVH_ERR_BUILD_OUT_OF_SEQUENCE;
}

template <typename BV>
int AdaptiveBVHModel<BV>::addSubModel(const std::vector<Point>& ps) {
  return isBegun(*this) ? Base::addSubModel(ps) : fcl::BVH_ERR_BUILD_OUT_OF_SEQUENCE;
}

template <typename BV>
int AdaptiveBVHModel<BV>::endModel() {
  if (!isBegun(*this)) return fcl::BVH_ERR_BUILD_OUT_OF_SEQUENCE;
  if (this->num_tris == 0 && this->num_vertices == 0) return fcl::BVH_ERR_BUILD_EMPTY_MODEL;
  if (!isUsable(*this)) return fcl::BVH_ERR_INCORRECT_DATA;
  const int code = Base::endModel();
  if (code == fcl::BVH_OK) takeOverBuild();
  return code;
}

/// Begins at the tree FCL just built. Its volumes are sound when our fitter made them.
template <typename BV>
void AdaptiveBVHModel<BV>::takeOverBuild() {
  State& state = *state_;
  state.tree.detector.invalidate();
  const UpdateTarget<BV> target{*this, state.tree};
  if (this->bv_fitter == sharedFitter<BV>())
    adoptBuild(target, state.update);
  else
    repairIfChanged(target, state.update);
  state.report = UpdateReport();
  state.report.nodes = this->getNumBVs();
  state.report.resynchronised = true;
  if (state.mesh) renewMesh();
}

// ---- new positions by FCL's calls ---------------------------------------------------------------

template <typename BV>
int AdaptiveBVHModel<BV>::addPositions(bool two_frames, const Point* positions, std::size_t count) {
  return state_->buffer.add(kindOf(two_frames), this->build_state, this->num_vertices, positions,
                            count);
}

/// Ends a step of FCL's calls. Without `refit` FCL builds a new tree.
template <typename BV>
int AdaptiveBVHModel<BV>::endPositions(bool two_frames, bool refit) {
  State& state = *state_;
  const StepKind kind = kindOf(two_frames);
  const int code = state.buffer.end(kind, this->build_state, this->num_vertices);
  if (code != fcl::BVH_OK) return code;
  const std::vector<Point>& positions = state.buffer.positions();
  if (refit) {
    takeStep<BV>({*this, state.tree}, state.update, state.policy,
                 {kind, positions.data(), positions.size()}, state.report);
    stepMesh(kind, nullptr, 0);
    return code;
  }
  if (two_frames) {
    Base::beginUpdateModel();
    Base::updateSubModel(positions);
    Base::endUpdateModel(false, false);  // builds on the new positions, then fits both
  } else {
    Base::beginReplaceModel();
    Base::replaceSubModel(positions);
    Base::endReplaceModel(false, false);
  }
  takeOverBuild();
  return code;
}

template <typename BV>
int AdaptiveBVHModel<BV>::beginReplaceModel() {
  return state_->buffer.begin(StepKind::Replace, this->build_state, this->num_vertices);
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
  return state_->buffer.begin(StepKind::TwoFrames, this->build_state, this->num_vertices);
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

template <typename BV>
const UpdateReport& AdaptiveBVHModel<BV>::take(const Point* positions, std::size_t count,
                                               const unsigned* indices) {
  State& state = *state_;
  UpdateReport report;
  if (!takeStep<BV>({*this, state.tree}, state.update, state.policy,
                    {StepKind::Replace, positions, count, indices}, report))
    refuseCoordinate<S>(positions, indices);
  state.report = report;
  stepMesh(StepKind::Replace, indices, count);
  return state.report;
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

/// Lets the mesh, if there is one, follow a step that the model has taken; `indices` as in `take`.
template <typename BV>
void AdaptiveBVHModel<BV>::stepMesh(StepKind kind, const unsigned* indices, std::size_t count) {
  State& state = *state_;
  if (!state.mesh) return;
  const auto all = static_cast<std::size_t>(this->num_vertices);
  if (!meshIsCurrent()) {
    renewMesh();
  } else if (kind == StepKind::TwoFrames) {
    state.mesh->updateTwoFrames(this->vertices, all);
  } else if (!indices) {
    state.mesh->update(this->vertices, all);
  } else {
    // The positions that were given may have lain in the model's own arrays.
    state.moved.resize(count);
    for (std::size_t i = 0; i < count; ++i) state.moved[i] = this->vertices[indices[i]];
    state.mesh->update(indices, state.moved.data(), count);
  }
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
  state_->policy = policy;
  if (state_->update.propagation() == policy.propagation) return;
  state_->update.setPropagation(policy.propagation);
  state_->tree.detector.invalidate();  // the new propagation has kept nothing yet
  repair();
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
  // Another thread's query may repair the tree meanwhile.
  const std::lock_guard<std::mutex> lock(state_->tree.repairing);
  if (!checkTree<BV>(*this, reason)) return false;
  return !meshIsCurrent() || state_->mesh->validate(reason);
}

#define ADAPTIVE_BVH_INSTANTIATE(BV) template class AdaptiveBVHModel<BV>;
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
