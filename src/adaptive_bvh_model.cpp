#include "adaptive_bvh/adaptive_bvh_model.h"

#include <cmath>
#include <functional>
#include <stdexcept>
#include <utility>

#include "hierarchy/splitter.h"
#include "model_state.h"
#include "tree/check.h"
#include "update/advance.h"
#include "update/local_bounds.h"
#include "volume/fcl_fitter.h"

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

/// Every triangle names vertices that are there, and every vertex is where a volume can be fitted.
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
    : Base((other.resynchronise(), other)), state_(std::make_unique<State>(*other.state_)) {}

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

/// Tracking starts at the tree FCL just built. Its volumes are sound when our fitter made them.
template <typename BV>
void AdaptiveBVHModel<BV>::takeOverBuild() {
  State& state = *state_;
  state.tree.seal.breakOpen();
  if (this->bv_fitter == sharedFitter<BV>())
    adoptBuild<BV>(*this, state.tree);
  else
    repairIfChanged<BV>(*this, state.tree);
  state.report = UpdateReport();
  state.report.nodes = this->getNumBVs();
  state.report.resynchronised = true;
}

// ---- a new frame --------------------------------------------------------------------------------

template <typename BV>
int AdaptiveBVHModel<BV>::beginReplaceModel() {
  return state_->frame.begin(FrameKind::Replace, this->build_state, this->num_vertices);
}

template <typename BV>
int AdaptiveBVHModel<BV>::replaceVertex(const Point& p) {
  return state_->stage(*this, FrameKind::Replace, &p, 1);
}

template <typename BV>
int AdaptiveBVHModel<BV>::replaceTriangle(const Point& p1, const Point& p2, const Point& p3) {
  const Point corners[3] = {p1, p2, p3};
  return state_->stage(*this, FrameKind::Replace, corners, 3);
}

template <typename BV>
int AdaptiveBVHModel<BV>::replaceSubModel(const std::vector<Point>& ps) {
  return state_->stage(*this, FrameKind::Replace, ps.data(), ps.size());
}

template <typename BV>
int AdaptiveBVHModel<BV>::endReplaceModel(bool refit, bool) {
  const int code = state_->endFrame(*this, FrameKind::Replace, refit);
  if (code != fcl::BVH_OK || refit) return code;
  Base::beginReplaceModel();
  Base::replaceSubModel(state_->frame.positions());
  Base::endReplaceModel(false, false);
  takeOverBuild();
  return code;
}

template <typename BV>
int AdaptiveBVHModel<BV>::beginUpdateModel() {
  return state_->frame.begin(FrameKind::Update, this->build_state, this->num_vertices);
}

template <typename BV>
int AdaptiveBVHModel<BV>::updateVertex(const Point& p) {
  return state_->stage(*this, FrameKind::Update, &p, 1);
}

template <typename BV>
int AdaptiveBVHModel<BV>::updateTriangle(const Point& p1, const Point& p2, const Point& p3) {
  const Point corners[3] = {p1, p2, p3};
  return state_->stage(*this, FrameKind::Update, corners, 3);
}

template <typename BV>
int AdaptiveBVHModel<BV>::updateSubModel(const std::vector<Point>& ps) {
  return state_->stage(*this, FrameKind::Update, ps.data(), ps.size());
}

template <typename BV>
int AdaptiveBVHModel<BV>::endUpdateModel(bool refit, bool) {
  const int code = state_->endFrame(*this, FrameKind::Update, refit);
  if (code != fcl::BVH_OK || refit) return code;
  Base::beginUpdateModel();
  Base::updateSubModel(state_->frame.positions());
  Base::endUpdateModel(false, false);  // builds on the new frame, then fits both
  takeOverBuild();
  return code;
}

template <typename BV>
const UpdateReport& AdaptiveBVHModel<BV>::update(const Point* positions, std::size_t count) {
  const auto expected = static_cast<std::size_t>(this->num_vertices);
  requireBuilt();
  if (count != expected)
    throw std::invalid_argument("AdaptiveBVHModel::update: " + std::to_string(count) +
                                " positions given for " + std::to_string(expected) + " vertices");
  if (positions == this->vertices)
    throw std::invalid_argument(
        "AdaptiveBVHModel::update: the positions are the model's own vertices; keep the new frame "
        "in an array of its own");
  requireUsable(positions, count, nullptr);
  std::vector<Point> aside;
  return state_->take(*this, FrameKind::Replace, outsideOwnArrays(positions, count, aside));
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
  const std::string shape = std::to_string(rows) + " x " + std::to_string(columns);
  throw std::invalid_argument(
      "AdaptiveBVHModel::update: the positions are a " + shape + " matrix; " +
      (rows == 3
           ? "whether its rows or its columns are the vertices only its type can tell: pass "
             "an Eigen::Matrix<S, 3, Eigen::Dynamic> or an Eigen::Matrix<S, Eigen::Dynamic, 3>"
           : "3 x N or N x 3 is needed, for " + std::to_string(this->num_vertices) + " vertices"));
}

template <typename BV>
const UpdateReport& AdaptiveBVHModel<BV>::update(const unsigned* indices, const Point* positions,
                                                 std::size_t count) {
  requireBuilt();
  for (std::size_t i = 0; i < count; ++i)
    if (indices[i] >= static_cast<std::size_t>(this->num_vertices))
      throw std::invalid_argument("AdaptiveBVHModel::update: index " + std::to_string(indices[i]) +
                                  " given for " + std::to_string(this->num_vertices) + " vertices");
  requireUsable(positions, count, indices);
  if (state_->tree.boxes && !this->prev_vertices) {
    std::vector<Point> aside;
    state_->report = advance<BV>(*this, state_->tree, state_->policy, indices,
                                 outsideOwnArrays(positions, count, aside), count);
    return state_->report;
  }
  std::vector<Point> all(this->vertices, this->vertices + this->num_vertices);
  for (std::size_t i = 0; i < count; ++i) all[indices[i]] = positions[i];
  return update(all);
}

template <typename BV>
const UpdateReport& AdaptiveBVHModel<BV>::update(const std::vector<unsigned>& indices,
                                                 const std::vector<Point>& positions) {
  if (indices.size() != positions.size())
    throw std::invalid_argument("AdaptiveBVHModel::update: " + std::to_string(positions.size()) +
                                " positions given for " + std::to_string(indices.size()) +
                                " indices");
  return update(indices.data(), positions.data(), indices.size());
}

/// A frame that was begun is abandoned.
template <typename BV>
void AdaptiveBVHModel<BV>::requireBuilt() {
  state_->frame.abandon(this->build_state);
  if (!isBuilt(*this))
    throw std::logic_error("AdaptiveBVHModel::update: the model is not built; call endModel first");
}

/// positions[i] is vertex indices[i]'s, or vertex i's without indices.
template <typename BV>
void AdaptiveBVHModel<BV>::requireUsable(const Point* positions, std::size_t count,
                                         const unsigned* indices) const {
  if (usablePositions<S>(positions, count)) return;
  std::size_t i = 0;
  while (usablePositions<S>(positions + i, 1)) ++i;
  const Point& p = positions[i];
  int k = 0;
  while (std::abs(p[k]) <= rounding::largestCoordinate<S>()) ++k;
  throw std::invalid_argument("AdaptiveBVHModel::update: coordinate " + std::string(1, "xyz"[k]) +
                              " of vertex " + std::to_string(indices ? indices[i] : i) + " is " +
                              std::to_string(p[k]) + (std::isfinite(p[k]) ? ", too large" : "") +
                              "; the model stays on its last frame");
}

/// The positions; copied `aside` where some lie in the arrays that the update writes or frees.
template <typename BV>
auto AdaptiveBVHModel<BV>::outsideOwnArrays(const Point* positions, std::size_t count,
                                            std::vector<Point>& aside) const -> const Point* {
  const std::less<const Point*> before;
  for (const Point* own : {this->vertices, this->prev_vertices})
    if (own && before(positions, own + this->num_vertices) && before(own, positions + count))
      aside.assign(positions, positions + count);
  return aside.empty() ? positions : aside.data();
}

// ---- hooks that FCL calls -----------------------------------------------------------------------

/// Logically const: the model answers as it should have all along.
template <typename BV>
void AdaptiveBVHModel<BV>::resynchronise() const {
  repairIfChanged<BV>(const_cast<AdaptiveBVHModel&>(*this), state_->tree);
}

template <typename BV>
fcl::NODE_TYPE AdaptiveBVHModel<BV>::getNodeType() const {
  resynchronise();
  return this->getModelType() == fcl::BVH_MODEL_TRIANGLES ? Base::getNodeType() : fcl::BV_UNKNOWN;
}

template <typename BV>
void AdaptiveBVHModel<BV>::computeLocalAABB() {
  resynchronise();
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
  if (state_->tree.propagation == policy.propagation) return;
  state_->tree.propagation = policy.propagation;
  state_->tree.seal.breakOpen();  // what the other propagation keeps was not kept
  resynchronise();
}

template <typename BV>
void AdaptiveBVHModel<BV>::setUpdateThreads(int threads) {
  if (threads < 1)
    throw std::invalid_argument("AdaptiveBVHModel::setUpdateThreads: " + std::to_string(threads) +
                                " threads; at least 1 is needed");
  state_->threads = threads;
}

template <typename BV>
auto AdaptiveBVHModel<BV>::originalRadius(int node) const -> S {
  resynchronise();
  return state_->tree.originalRadius(*this, node);
}

template <typename BV>
auto AdaptiveBVHModel<BV>::latestDisplacement(int triangle) const -> S {
  resynchronise();
  const auto& tracking = state_->tree.displacements;
  return tracking ? tracking->latest[static_cast<std::size_t>(triangle)] : 0;
}

template <typename BV>
auto AdaptiveBVHModel<BV>::overallDisplacement(int triangle) const -> S {
  resynchronise();
  const auto& tracking = state_->tree.displacements;
  return tracking ? tracking->overall[static_cast<std::size_t>(triangle)] : 0;
}

template <typename BV>
QueryWork AdaptiveBVHModel<BV>::recordedWork() const {
  return state_->tree.evidence.work();
}

template <typename BV>
bool AdaptiveBVHModel<BV>::traversed(int node) const {
  resynchronise();
  return state_->tree.evidence.visited(node);
}

template <typename BV>
std::size_t AdaptiveBVHModel<BV>::trackingBytes() const {
  return sizeof(State) + state_->tree.bytes() + state_->frame.bytes();
}

template <typename BV>
bool AdaptiveBVHModel<BV>::validate(std::string* reason) const {
  return checkTree<BV>(*this, reason);
}

template class AdaptiveBVHModel<fcl::RSS<float>>;
template class AdaptiveBVHModel<fcl::RSS<double>>;

}  // namespace adaptive_bvh
