#include "adaptive_bvh/adaptive_bvh_model.h"

#include <mutex>
#include <new>
#include <utility>

#include "thesis/fcl_build.h"
#include "thesis/fcl_model.h"
#include "thesis/model_state.h"

// AdaptiveBVHModel: construction, updates in one call, the mesh of our queries, and inspection.
// FCL's functions that build and update a model are in fcl_calls.cpp.
namespace adaptive_bvh {
namespace {

[[noreturn]] void refuseUpdate(const std::string& what) {
  throw std::invalid_argument("AdaptiveBVHModel::update: " + what);
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

/// Resets to the state of the default constructor. Allocates nothing: a move must not throw.
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

// ---- new positions in one call ------------------------------------------------------------------

/// Applies a step of all vertices, or of those in `indices` if it is not null. Throws
/// std::invalid_argument if a coordinate is not finite or too large.
template <typename BV>
const UpdateReport& AdaptiveBVHModel<BV>::take(const Point* positions, std::size_t count,
                                               const unsigned* indices) {
  takeStep(*this, *state_, {StepKind::Replace, positions, count, indices});
  return state_->report;
}

template <typename BV>
const UpdateReport& AdaptiveBVHModel<BV>::update(const Point* positions, std::size_t count) {
  requireBuilt();
  if (count != static_cast<std::size_t>(this->num_vertices))
    refuseUpdate(std::to_string(count) + " positions given for " +
                 std::to_string(this->num_vertices) + " vertices");
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
const UpdateReport& AdaptiveBVHModel<BV>::update(const unsigned* indices, const Point* positions,
                                                 std::size_t count) {
  requireBuilt();
  for (std::size_t i = 0; i < count; ++i)
    if (indices[i] >= static_cast<std::size_t>(this->num_vertices))
      refuseUpdate("index " + std::to_string(indices[i]) + " given for " +
                   std::to_string(this->num_vertices) + " vertices");
  // An empty list may be a null pointer, which `take` would read as every vertex.
  static constexpr unsigned kUnread = 0;
  return take(positions, count, indices ? indices : &kUnread);
}

template <typename BV>
const UpdateReport& AdaptiveBVHModel<BV>::update(const std::vector<unsigned>& indices,
                                                 const std::vector<Point>& positions) {
  if (indices.size() != positions.size())
    refuseUpdate(std::to_string(positions.size()) + " positions given for " +
                 std::to_string(indices.size()) + " indices");
  return update(indices.data(), positions.data(), indices.size());
}

/// Throws unless the model is built.
template <typename BV>
void AdaptiveBVHModel<BV>::requireBuilt() const {
  if (!isBuilt(*this) && !state_->buffer.isOpen(this->build_state))
    throw std::logic_error("AdaptiveBVHModel::update: the model is not built; call endModel first");
}

// ---- the mesh of our queries --------------------------------------------------------------------

template <typename BV>
auto AdaptiveBVHModel<BV>::mesh() -> const DeformableMesh& {
  if (!isBuilt(*this) || this->num_tris == 0)
    throw std::logic_error("AdaptiveBVHModel::mesh: the model is not built of triangles");
  repair();
  if (!state_->meshIsCurrent()) renewMesh(*this, *state_);
  return *state_->mesh;
}

template <typename BV>
auto AdaptiveBVHModel<BV>::mesh() const -> const DeformableMesh& {
  repair();
  if (!state_->meshIsCurrent())
    throw std::logic_error(
        "AdaptiveBVHModel::mesh: the mesh of a const model was not made, or the model was changed "
        "through a fcl::BVHModel since; call mesh() once on the model itself");
  return *state_->mesh;
}

template <typename BV>
bool AdaptiveBVHModel<BV>::hasMesh() const {
  return state_->mesh.has_value();
}

// ---- hooks that FCL calls -----------------------------------------------------------------------

/// Repairs a tree that was changed through a fcl::BVHModel&, whose mutators are not virtual. Every
/// call that reads the tree begins with this. These calls are const in FCL; the repair only
/// restores the invariant that volumes enclose their triangles. Thread-safe.
template <typename BV>
void AdaptiveBVHModel<BV>::repair() const {
  repairIfChanged<BV>({const_cast<AdaptiveBVHModel&>(*this), state_->tree}, state_->update);
}

/// FCL calls this first in every query. For BV_UNKNOWN, that is a point cloud, it has no query.
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

// ---- inspection ---------------------------------------------------------------------------------

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
  state_->tree.detector.invalidate();  // the new propagation has no data yet
  try {
    repair();
  } catch (const std::bad_alloc&) {  // the old propagation's data is lost: the next reader repairs
    state_->policy = before;
    state_->update.setPropagation(before.propagation);
    throw;
  }
}

template <typename BV>
void AdaptiveBVHModel<BV>::setThreads(int threads) {
  if (threads < 1)
    throw std::invalid_argument("AdaptiveBVHModel::setThreads: " + std::to_string(threads) +
                                " threads; at least 1 is needed");
  state_->update.threads = threads;
  if (state_->mesh) state_->mesh->setThreads(threads);
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
         (state.mesh ? state.mesh->bytes() - sizeof(*state.mesh) : 0);
}

template <typename BV>
bool AdaptiveBVHModel<BV>::validate(std::string* reason) const {
  if (state_->tree.detector.isInvalidated()) repair();  // an update ran out of memory
  // Another thread's query may be repairing the tree.
  const std::lock_guard<std::mutex> lock(state_->tree.repairing);
  if (!checkTree<BV>(*this, reason)) return false;
  return !state_->meshIsCurrent() || state_->mesh->validate(reason);
}

#define ADAPTIVE_BVH_INSTANTIATE(BV) template class AdaptiveBVHModel<BV>;
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
