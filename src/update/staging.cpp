#include "update/staging.h"

#include <algorithm>
#include <cmath>

#include "update/local_bounds.h"

namespace adaptive_bvh {
namespace {

template <typename S>
void forgetMotion(Boxes<S>& boxes) {
  const auto stop = [](StagedVertex& staged) { lanes::store(lanes::all(0), staged.motion); };
  if (boxes.all_moving)
    for (StagedVertex& staged : boxes.staged) stop(staged);
  else
    for (unsigned v : boxes.moving) stop(boxes.staged[v]);
}

template <typename S>
S letMove(Boxes<S>& boxes, const StagedRange<S>& range) {
  const S largest = range.largestDisplacement();
  boxes.extendReach(largest);
  return largest;
}

/// A few vertices' displacement where they agree to a sixteenth of it: the body is carried along.
/// Else 0, for what a volume moves beyond it is bounded by both lengths. Any vector is sound. None
/// where two frames are kept, for the frame before did not move.
template <typename BV>
fcl::Vector3<typename BV::S> commonMotion(const fcl::BVHModel<BV>& model,
                                          const std::vector<unsigned>& samples,
                                          const fcl::Vector3<typename BV::S>* positions) {
  using Point = fcl::Vector3<typename BV::S>;
  if (model.prev_vertices || samples.empty()) return Point::Zero();
  const Point common = positions[samples[0]] - model.vertices[samples[0]];
  const auto allowed = common.cwiseAbs().maxCoeff() / 16;
  for (unsigned v : samples)
    if (!((positions[v] - model.vertices[v] - common).cwiseAbs().maxCoeff() <= allowed))
      return Point::Zero();  // so do positions that are no numbers
  return common;
}

}  // namespace

template <typename BV>
StagedRange<typename BV::S> stageRange(fcl::BVHModel<BV>& model, Boxes<typename BV::S>& boxes,
                                       const fcl::Vector3<typename BV::S>* positions, int begin,
                                       int end) {
  using S = typename BV::S;
  using Point = fcl::Vector3<S>;
  // Measured from where the volumes last held the vertex: the frame before, also in swept mode.
  const Point* from = model.prev_vertices ? model.prev_vertices : model.vertices;
  const BodyFrame<S> frame = boxes.frame;
  const Point common = boxes.common;
  StagedRange<S> range;
  for (int v = begin; v < end; ++v) {
    const Point to = positions[v], d = to - from[v];
    range.add(to, d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    StagedVertex& staged = boxes.staged[static_cast<std::size_t>(v)];
    lanes::store(frame.place(to), staged.at);
    lanes::store(frame.displacement(d - common), staged.motion);
    model.vertices[v] = to;
  }
  if (model.prev_vertices)
    for (int v = begin; v < end; ++v)
      lanes::store(frame.place(model.prev_vertices[v]),
                   boxes.before[static_cast<std::size_t>(v)].data());
  return range;
}

template <typename BV>
void beginStaging(const fcl::BVHModel<BV>& model, Boxes<typename BV::S>& boxes,
                  const fcl::Vector3<typename BV::S>* positions) {
  boxes.all_moving = true;
  boxes.common = commonMotion(model, boxes.attitude.samples(), positions);
  // A body far from the origin of its boxes would lose digits in them.
  boxes.frame.moveOrigin(boxes.middle());
  fcl::Matrix3d axes = boxes.frame.axes();
  if (boxes.attitude.follow(model, axes)) boxes.frame.turn(axes);
  if (model.prev_vertices) boxes.before.resize(static_cast<std::size_t>(model.num_vertices));
}

template <typename BV>
typename BV::S finishStaging(fcl::BVHModel<BV>& model, Boxes<typename BV::S>& boxes,
                             const StagedRange<typename BV::S>& all) {
  setLocalBox(model, all.low, all.high);
  return letMove(boxes, all);
}

template <typename BV>
typename BV::S stageVertices(fcl::BVHModel<BV>& model, Boxes<typename BV::S>& boxes,
                             Incidence& incidence, PartialBounds<BV>& bounds,
                             const unsigned* indices, const fcl::Vector3<typename BV::S>* positions,
                             std::size_t count) {
  using S = typename BV::S;
  forgetMotion(boxes);
  boxes.common.setZero();
  boxes.moving.clear();
  StagedRange<S> range;
  for (std::size_t i = count; i-- > 0;) {
    const unsigned v = indices[i];
    StagedVertex& staged = boxes.staged[v];
    if (staged.motion[3] != 0) continue;  // was named again, later
    staged.motion[3] = 1;
    boxes.moving.push_back(v);

    fcl::Vector3<S>& at = model.vertices[v];
    const fcl::Vector3<S> d = positions[i] - at;
    range.add(positions[i], d.squaredNorm());
    bounds.move(at, positions[i]);
    at = positions[i];
    lanes::store(boxes.frame.place(at), staged.at);
    const Lanes motion = boxes.frame.displacement(d);
    for (int k = 0; k < 3; ++k) staged.motion[k] = motion[k];
    incidence.mark(v);
  }
  boxes.all_moving = false;
  return letMove(boxes, range);
}

template <typename BV>
void stageInPlace(const fcl::BVHModel<BV>& model, Boxes<typename BV::S>& boxes) {
  for (int v = 0; v < model.num_vertices; ++v) {
    StagedVertex& staged = boxes.staged[static_cast<std::size_t>(v)];
    lanes::store(boxes.frame.place(model.vertices[v]), staged.at);
    lanes::store(lanes::all(0), staged.motion);
  }
  boxes.all_moving = true;
  boxes.common.setZero();
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                              \
  template StagedRange<S> stageRange(fcl::BVHModel<fcl::RSS<S>>&, Boxes<S>&,                     \
                                     const fcl::Vector3<S>*, int, int);                          \
  template void beginStaging(const fcl::BVHModel<fcl::RSS<S>>&, Boxes<S>&,                       \
                             const fcl::Vector3<S>*);                                            \
  template S finishStaging(fcl::BVHModel<fcl::RSS<S>>&, Boxes<S>&, const StagedRange<S>&);       \
  template S stageVertices(fcl::BVHModel<fcl::RSS<S>>&, Boxes<S>&, Incidence&,                   \
                           PartialBounds<fcl::RSS<S>>&, const unsigned*, const fcl::Vector3<S>*, \
                           std::size_t);                                                         \
  template void stageInPlace(const fcl::BVHModel<fcl::RSS<S>>&, Boxes<S>&);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
