#include "adaptive_bvh/adaptive_bvh_model.h"

#include "thesis/fcl_model.h"
#include "thesis/model_state.h"

// The functions of AdaptiveBVHModel that hide FCL's of the same name: they build a model and update
// its positions. Like FCL's, they return a code (BVH_OK or an error), and `end...` takes effect.
namespace adaptive_bvh {

// ---- building -----------------------------------------------------------------------------------

template <typename BV>
int AdaptiveBVHModel<BV>::beginModel(int num_tris, int num_vertices) {
  if (this->build_state == fcl::BVH_BUILD_STATE_EMPTY) {
    // After a build was begun on a model that was not empty, FCL leaves arrays here and leaks them.
    delete[] this->vertices;
    delete[] this->tri_indices;
    this->vertices = nullptr;
    this->tri_indices = nullptr;
    return codeOf([&] { return Base::beginModel(num_tris, num_vertices); });
  }
  // FCL clears a model that is not empty and returns this code, but a failing allocation in between
  // would leave it half cleared. The data of fcl::CollisionGeometry stays, as in FCL.
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
    Base built(*this);  // its capacity equals its size
    const int code = built.endModel();
    if (code == fcl::BVH_OK) takeOverBuild(*this, *state_, built);
    return code;
  });
}

// ---- new positions ------------------------------------------------------------------------------

template <typename BV>
int AdaptiveBVHModel<BV>::beginReplaceModel() {
  return beginPositions(*this, *state_, StepKind::Replace);
}

template <typename BV>
int AdaptiveBVHModel<BV>::replaceVertex(const Point& p) {
  return addPositions(*this, *state_, StepKind::Replace, &p, 1);
}

template <typename BV>
int AdaptiveBVHModel<BV>::replaceTriangle(const Point& p1, const Point& p2, const Point& p3) {
  const Point corners[3] = {p1, p2, p3};
  return addPositions(*this, *state_, StepKind::Replace, corners, 3);
}

template <typename BV>
int AdaptiveBVHModel<BV>::replaceSubModel(const std::vector<Point>& ps) {
  return addPositions(*this, *state_, StepKind::Replace, ps.data(), ps.size());
}

template <typename BV>
int AdaptiveBVHModel<BV>::endReplaceModel(bool refit, bool) {
  return endPositions(*this, *state_, StepKind::Replace, refit);
}

template <typename BV>
int AdaptiveBVHModel<BV>::beginUpdateModel() {
  return beginPositions(*this, *state_, StepKind::TwoFrames);
}

template <typename BV>
int AdaptiveBVHModel<BV>::updateVertex(const Point& p) {
  return addPositions(*this, *state_, StepKind::TwoFrames, &p, 1);
}

template <typename BV>
int AdaptiveBVHModel<BV>::updateTriangle(const Point& p1, const Point& p2, const Point& p3) {
  const Point corners[3] = {p1, p2, p3};
  return addPositions(*this, *state_, StepKind::TwoFrames, corners, 3);
}

template <typename BV>
int AdaptiveBVHModel<BV>::updateSubModel(const std::vector<Point>& ps) {
  return addPositions(*this, *state_, StepKind::TwoFrames, ps.data(), ps.size());
}

template <typename BV>
int AdaptiveBVHModel<BV>::endUpdateModel(bool refit, bool) {
  return endPositions(*this, *state_, StepKind::TwoFrames, refit);
}

// The other members are instantiated with the class, in adaptive_bvh_model.cpp.
#define ADAPTIVE_BVH_INSTANTIATE(BV)                                                            \
  template int AdaptiveBVHModel<BV>::beginModel(int, int);                                      \
  template int AdaptiveBVHModel<BV>::addVertex(const Point&);                                   \
  template int AdaptiveBVHModel<BV>::addTriangle(const Point&, const Point&, const Point&);     \
  template int AdaptiveBVHModel<BV>::addSubModel(const std::vector<Point>&,                     \
                                                 const std::vector<fcl::Triangle>&);            \
  template int AdaptiveBVHModel<BV>::addSubModel(const std::vector<Point>&);                    \
  template int AdaptiveBVHModel<BV>::endModel();                                                \
  template int AdaptiveBVHModel<BV>::beginReplaceModel();                                       \
  template int AdaptiveBVHModel<BV>::replaceVertex(const Point&);                               \
  template int AdaptiveBVHModel<BV>::replaceTriangle(const Point&, const Point&, const Point&); \
  template int AdaptiveBVHModel<BV>::replaceSubModel(const std::vector<Point>&);                \
  template int AdaptiveBVHModel<BV>::endReplaceModel(bool, bool);                               \
  template int AdaptiveBVHModel<BV>::beginUpdateModel();                                        \
  template int AdaptiveBVHModel<BV>::updateVertex(const Point&);                                \
  template int AdaptiveBVHModel<BV>::updateTriangle(const Point&, const Point&, const Point&);  \
  template int AdaptiveBVHModel<BV>::updateSubModel(const std::vector<Point>&);                 \
  template int AdaptiveBVHModel<BV>::endUpdateModel(bool, bool);
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
