#include "adaptive_bvh/adaptive_bvh_model.h"

#include <stdexcept>

#include "hierarchy/fcl_hooks.h"
#include "model_state.h"
#include "tree/check.h"
#include "update/advance.h"

namespace adaptive_bvh {
namespace {

bool isBuilt(fcl::BVHBuildState state) {
  return state == fcl::BVH_BUILD_STATE_PROCESSED || state == fcl::BVH_BUILD_STATE_UPDATED;
}

}  // namespace

// ---- construction -------------------------------------------------------------------------------

template <typename BV>
AdaptiveBVHModel<BV>::AdaptiveBVHModel(const RefitPolicy& policy)
    : state_(std::make_unique<State>()) {
  setRefitPolicy(policy);
  this->bv_fitter = sharedFitter<BV>();
  this->bv_splitter = sharedSplitter<BV>();
}

template <typename BV>
AdaptiveBVHModel<BV>::AdaptiveBVHModel(const AdaptiveBVHModel& other)
    : Base(synchronised(other)), state_(std::make_unique<State>(*other.state_)) {}

template <typename BV>
AdaptiveBVHModel<BV>::AdaptiveBVHModel(const Base& plain, const RefitPolicy& policy)
    : Base(plain), state_(std::make_unique<State>()) {
  setRefitPolicy(policy);
  this->bv_fitter = sharedFitter<BV>();
  this->bv_splitter = sharedSplitter<BV>();
  if (isBuilt(this->build_state)) computeLocalAABB();
}

template <typename BV>
AdaptiveBVHModel<BV>::~AdaptiveBVHModel() = default;

template <typename BV>
const fcl::BVHModel<BV>& AdaptiveBVHModel<BV>::synchronised(const AdaptiveBVHModel& other) {
  other.resynchronise();
  return other;
}

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
  if (this->build_state != fcl::BVH_BUILD_STATE_BEGUN) return fcl::BVH_ERR_BUILD_OUT_OF_SEQUENCE;
  return Base::addVertex(p);
}

template <typename BV>
int AdaptiveBVHModel<BV>::addTriangle(const Point& p1, const Point& p2, const Point& p3) {
  if (this->build_state != fcl::BVH_BUILD_STATE_BEGUN) return fcl::BVH_ERR_BUILD_OUT_OF_SEQUENCE;
  return Base::addTriangle(p1, p2, p3);
}

template <typename BV>
int AdaptiveBVHModel<BV>::addSubModel(const std::vector<Point>& ps,
                                      const std::vector<fcl::Triangle>& ts) {
  if (this->build_state != fcl::BVH_BUILD_STATE_BEGUN) return fcl::BVH_ERR_BUILD_OUT_OF_SEQUENCE;
  return Base::addSubModel(ps, ts);
}

template <typename BV>
int AdaptiveBVHModel<BV>::addSubModel(const std::vector<Point>& ps) {
  if (this->build_state != fcl::BVH_BUILD_STATE_BEGUN) return fcl::BVH_ERR_BUILD_OUT_OF_SEQUENCE;
  return Base::addSubModel(ps);
}

template <typename BV>
bool AdaptiveBVHModel<BV>::usableBuild() const {
  const auto count = static_cast<std::size_t>(this->num_vertices);
  for (int t = 0; t < this->num_tris; ++t)
    for (int k = 0; k < 3; ++k)
      if (this->tri_indices[t][k] >= count) return false;
  return usablePositions<S>(this->vertices, count);
}

template <typename BV>
int AdaptiveBVHModel<BV>::endModel() {
  if (this->build_state != fcl::BVH_BUILD_STATE_BEGUN) return fcl::BVH_ERR_BUILD_OUT_OF_SEQUENCE;
  if (this->num_tris == 0 && this->num_vertices == 0) return fcl::BVH_ERR_BUILD_EMPTY_MODEL;
  if (!usableBuild()) return fcl::BVH_ERR_INCORRECT_DATA;
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
  updateLocalAABB(*this);
  state.frame.reserve(this->num_vertices);
  state.report = UpdateReport();
  state.report.nodes = this->getNumBVs();
  state.report.resynchronised = true;
}

// ---- a new frame --------------------------------------------------------------------------------

template <typename BV>
int AdaptiveBVHModel<BV>::beginReplaceModel() {
  return state_->frame.begin(FrameKind::Replace, this->build_state);
}

template <typename BV>
int AdaptiveBVHModel<BV>::replaceVertex(const Point& p) {
  return state_->frame.add(FrameKind::Replace, this->build_state, this->num_vertices, &p, 1);
}

template <typename BV>
int AdaptiveBVHModel<BV>::replaceTriangle(const Point& p1, const Point& p2, const Point& p3) {
  const Point corners[3] = {p1, p2, p3};
  return state_->frame.add(FrameKind::Replace, this->build_state, this->num_vertices, corners, 3);
}

template <typename BV>
int AdaptiveBVHModel<BV>::replaceSubModel(const std::vector<Point>& ps) {
  return state_->frame.add(FrameKind::Replace, this->build_state, this->num_vertices, ps.data(),
                           ps.size());
}

template <typename BV>
int AdaptiveBVHModel<BV>::endReplaceModel(bool refit, bool) {
  const std::vector<Point>& positions = state_->frame.positions();
  const int code = state_->frame.end(FrameKind::Replace, this->build_state, this->num_vertices);
  if (code != fcl::BVH_OK) return code;
  if (refit) {
    take(FrameKind::Replace, positions.data());
  } else {
    Base::beginReplaceModel();
    for (const Point& p : positions) Base::replaceVertex(p);
    Base::endReplaceModel(false, false);
    takeOverBuild();
  }
  return code;
}

template <typename BV>
int AdaptiveBVHModel<BV>::beginUpdateModel() {
  return state_->frame.begin(FrameKind::Update, this->build_state);
}

template <typename BV>
int AdaptiveBVHModel<BV>::updateVertex(const Point& p) {
  return state_->frame.add(FrameKind::Update, this->build_state, this->num_vertices, &p, 1);
}

template <typename BV>
int AdaptiveBVHModel<BV>::updateTriangle(const Point& p1, const Point& p2, const Point& p3) {
  const Point corners[3] = {p1, p2, p3};
  return state_->frame.add(FrameKind::Update, this->build_state, this->num_vertices, corners, 3);
}

template <typename BV>
int AdaptiveBVHModel<BV>::updateSubModel(const std::vector<Point>& ps) {
  return state_->frame.add(FrameKind::Update, this->build_state, this->num_vertices, ps.data(),
                           ps.size());
}

template <typename BV>
int AdaptiveBVHModel<BV>::endUpdateModel(bool refit, bool) {
  const std::vector<Point>& positions = state_->frame.positions();
  const int code = state_->frame.end(FrameKind::Update, this->build_state, this->num_vertices);
  if (code != fcl::BVH_OK) return code;
  if (refit) {
    take(FrameKind::Update, positions.data());
  } else {
    Base::beginUpdateModel();
    for (const Point& p : positions) Base::updateVertex(p);
    Base::endUpdateModel(false, false);  // builds on the new frame, then fits both
    takeOverBuild();
  }
  return code;
}

template <typename BV>
const UpdateReport& AdaptiveBVHModel<BV>::update(const Point* positions, std::size_t count) {
  const auto expected = static_cast<std::size_t>(this->num_vertices);
  state_->frame.abandon(this->build_state);
  if (!isBuilt(this->build_state))
    throw std::logic_error("AdaptiveBVHModel::update: the model is not built; call endModel first");
  if (count != expected)
    throw std::invalid_argument("AdaptiveBVHModel::update: " + std::to_string(count) +
                                " positions given for " + std::to_string(expected) + " vertices");
  if (positions == this->vertices)
    throw std::invalid_argument(
        "AdaptiveBVHModel::update: the positions are the model's own vertices; keep the new frame "
        "in an array of its own");
  if (!usablePositions<S>(positions, count))
    throw std::invalid_argument(
        "AdaptiveBVHModel::update: a coordinate is NaN, infinite or too large; the model stays on "
        "its last frame");
  take(FrameKind::Replace, positions);
  return state_->report;
}

template <typename BV>
const UpdateReport& AdaptiveBVHModel<BV>::update(const std::vector<Point>& positions) {
  return update(positions.data(), positions.size());
}

template <typename BV>
void AdaptiveBVHModel<BV>::take(FrameKind kind, const Point* positions) {
  state_->report = advance<BV>(*this, state_->tree, state_->policy, kind, positions);
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
  updateLocalAABB(*this);
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
}

template <typename BV>
typename BV::S AdaptiveBVHModel<BV>::originalRadius(int node) const {
  resynchronise();
  return state_->tree.tracking.original_radius[static_cast<std::size_t>(node)];
}

template <typename BV>
typename BV::S AdaptiveBVHModel<BV>::latestDisplacement(int triangle) const {
  resynchronise();
  return state_->tree.tracking.latest[static_cast<std::size_t>(triangle)];
}

template <typename BV>
typename BV::S AdaptiveBVHModel<BV>::overallDisplacement(int triangle) const {
  resynchronise();
  return state_->tree.tracking.overall[static_cast<std::size_t>(triangle)];
}

template <typename BV>
int AdaptiveBVHModel<BV>::recordedQueries() const {
  return state_->tree.evidence.queries();
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
