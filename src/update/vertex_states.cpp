#include "update/vertex_states.h"

#include "volume/each_volume.h"

namespace adaptive_bvh {
namespace {

/// The displacement of a few vertices when they agree to a sixteenth of it: the body is carried
/// along. Else 0. Any vector is sound, but accumulated motion grows by its length and by that of
/// the remaining motion. Also 0 in a two-frame update, whose first frame does not move.
template <typename S>
fcl::Vector3<S> commonTranslation(const fcl::Vector3<S>* present, const StepInput<S>& input,
                                  const std::vector<unsigned>& samples) {
  using Point = fcl::Vector3<S>;
  if (input.kind == StepKind::TwoFrames || input.indices || samples.empty()) return Point::Zero();
  const auto motion = [&](unsigned v) -> Point { return input.positions[v] - present[v]; };
  const Point common = motion(samples[0]);
  const S allowed = common.cwiseAbs().maxCoeff() / 16;
  for (unsigned v : samples)
    if (!((motion(v) - common).cwiseAbs().maxCoeff() <= allowed))
      return Point::Zero();  // (positions that are not numbers are refused)
  return common;
}

}  // namespace

template <typename S>
template <typename BV>
void VertexStates<S>::start(const UpdateTarget<BV>& target, const BodyFrame<S>& frame) {
  frame_ = frame;
  rotation_.start(target.model, target.tree.topology, frame.axes(), frame.scale());
  readInPlace(target.model);
}

template <typename S>
template <typename BV>
void VertexStates<S>::begin(const UpdateTarget<BV>& target, const StepInput<S>& input) {
  const BoxTree<S>& boxes = *target.tree.boxes;
  frame_ = boxes.frame;
  common_ = adaptive_bvh::commonTranslation(target.model.vertices, input, rotation_.samples());
  if (input.indices) return;
  all_moving_ = true;
  // Far from the origin of its boxes a body would lose digits.
  frame_.moveOrigin(boxes.middle());
  fcl::Matrix3d axes = boxes.frame.axes();
  if (rotation_.turn(target.model, axes)) frame_.turn(axes);
  if (input.kind == StepKind::TwoFrames) previous_.resize(states_.size());
}

template <typename S>
VertexSummary<S> VertexStates<S>::read(const Point* present, const StepInput<S>& input, int first,
                                       int last) {
  // Locals, for the stores below could change what is read through pointers.
  const BodyFrame<S> frame = frame_;
  const Point common = common_;
  const Point* const positions = input.positions;
  VertexState* const states = states_.data();
  VertexSummary<S> seen;
  for (int v = first; v < last; ++v) {
    const Point to = positions[v], displacement = to - present[v];
    seen.add(to, displacement);
    float4::store(frame.toBodyFrame(to), states[v].position);
    float4::store(frame.displacement(displacement - common), states[v].motion);
  }
  if (input.kind == StepKind::TwoFrames)
    for (int v = first; v < last; ++v)
      float4::store(frame.toBodyFrame(present[v]), previous_[static_cast<std::size_t>(v)].data());
  return VertexSummary<S>(seen);  // a copy: `seen` itself would be the caller's, in memory
}

/// The model's positions as they stand, without motion.
template <typename S>
template <typename BV>
void VertexStates<S>::readInPlace(const fcl::BVHModel<BV>& model) {
  if (model.prev_vertices) previous_.resize(states_.size());
  for (std::size_t v = 0; v < states_.size(); ++v) {
    float4::store(frame_.toBodyFrame(model.vertices[v]), states_[v].position);
    float4::store(float4::all(0), states_[v].motion);
    if (model.prev_vertices)
      float4::store(frame_.toBodyFrame(model.prev_vertices[v]), previous_[v].data());
  }
  all_moving_ = true;
  stale_ = false;
  common_.setZero();
}

template <typename S>
void VertexStates<S>::forgetMotion() {
  const auto stop = [](VertexState& state) { float4::store(float4::all(0), state.motion); };
  if (all_moving_)
    for (VertexState& state : states_) stop(state);
  else
    for (unsigned v : moving_) stop(states_[v]);
}

template class VertexStates<float>;
template class VertexStates<double>;

#define ADAPTIVE_BVH_INSTANTIATE(BV)                                                          \
  template void VertexStates<BV::S>::start(const UpdateTarget<BV>&, const BodyFrame<BV::S>&); \
  template void VertexStates<BV::S>::begin(const UpdateTarget<BV>&, const StepInput<BV::S>&); \
  template void VertexStates<BV::S>::readInPlace(const fcl::BVHModel<BV>&);
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
