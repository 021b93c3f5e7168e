#include "update/vertex_states.h"

#include <algorithm>

#include "volume/each_volume.h"

namespace adaptive_bvh {
namespace {

/// The displacement of a few vertices when they agree to a sixteenth of it: the body is carried
/// along. Else 0. Any vector is sound. Also 0 in a two-frame update, whose first frame does not
/// move.
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
  rotation_.start(target.model.vertices, target.tree.topology.slots, frame.axes(),
                  static_cast<double>(frame.scale()));
  readInPlace(target);
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
  turn(target, input.positions);
  if (target.tree.axes != frame_.axes()) frame_.turn(target.tree.axes);
  if (input.kind == StepKind::TwoFrames) previous_.resize(states_.size() - 1);
}

template <typename S>
template <typename BV>
VertexSummary<S> VertexStates<S>::read(const UpdateTarget<BV>& target, const StepInput<S>& input,
                                       int first, int last) {
  constexpr int kAhead = 8;  // the mesh's order is another
  // Locals, for the stores below could change what is read through pointers.
  const BodyFrame<S> frame = frame_;
  const Point common = common_;
  const Point* const positions = input.positions;
  const Point* const present = target.model.vertices;
  const unsigned* const vertices = target.tree.topology.slots.vertices().data();
  const int end = static_cast<int>(target.tree.topology.slots.size());
  VertexState* const states = states_.data();
  VertexSummary<S> seen;
  for (int i = first; i < last; ++i) {
    const unsigned ahead = vertices[std::min(i + kAhead, end - 1)];
    __builtin_prefetch(&positions[ahead]);
    __builtin_prefetch(&present[ahead]);
    const unsigned v = vertices[i];
    const Point to = positions[v], displacement = to - present[v];
    seen.add(to, displacement);
    float4::store3(frame.toBodyFrame(to), states[i].position);
    float4::store3(frame.displacement(displacement - common), states[i].motion);
  }
  if (input.kind == StepKind::TwoFrames)
    for (int i = first; i < last; ++i)
      float4::store(frame.toBodyFrame(present[vertices[i]]),
                    previous_[static_cast<std::size_t>(i)].data());
  return VertexSummary<S>(seen);  // a copy: `seen` itself would be the caller's, in memory
}

/// Turns the tree's axes with the body to these positions, those of all vertices.
template <typename S>
template <typename BV>
void VertexStates<S>::turn(const UpdateTarget<BV>& target, const Point* positions) {
  fcl::Matrix3d axes = target.tree.axes;
  if (rotation_.turn(positions, axes)) target.tree.axes = orthonormal(axes);
}

/// The model's positions as they stand, without motion.
template <typename S>
template <typename BV>
void VertexStates<S>::readInPlace(const UpdateTarget<BV>& target) {
  const fcl::BVHModel<BV>& model = target.model;
  const std::vector<unsigned>& vertices = target.tree.topology.slots.vertices();
  if (model.prev_vertices) previous_.resize(vertices.size());
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const unsigned v = vertices[i];
    float4::store3(frame_.toBodyFrame(model.vertices[v]), states_[i].position);
    float4::store3(float4::all(0), states_[i].motion);
    if (model.prev_vertices)
      float4::store(frame_.toBodyFrame(model.prev_vertices[v]), previous_[i].data());
  }
  all_moving_ = true;
  stale_ = false;
  common_.setZero();
}

template <typename S>
void VertexStates<S>::forgetMotion() {
  const auto stop = [](VertexState& state) { float4::store3(float4::all(0), state.motion); };
  if (all_moving_)
    for (VertexState& state : states_) stop(state);
  else
    for (unsigned slot : moving_) stop(states_[slot]);
}

template class VertexStates<float>;
template class VertexStates<double>;

#define ADAPTIVE_BVH_INSTANTIATE(BV)                                                          \
  template void VertexStates<BV::S>::start(const UpdateTarget<BV>&, const BodyFrame<BV::S>&); \
  template void VertexStates<BV::S>::begin(const UpdateTarget<BV>&, const StepInput<BV::S>&); \
  template VertexSummary<BV::S> VertexStates<BV::S>::read(const UpdateTarget<BV>&,            \
                                                          const StepInput<BV::S>&, int, int); \
  template void VertexStates<BV::S>::readInPlace(const UpdateTarget<BV>&);
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
