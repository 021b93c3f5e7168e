#include "thesis/vertex_states.h"

namespace adaptive_bvh {
namespace {

/// The displacement of the first sample vertex if those of all samples agree with it to within a
/// sixteenth of its size, so that the body moves mainly by a translation; otherwise 0. The samples
/// need not be representative: any result is valid. Also 0 in a two-frame update, whose volumes
/// must still enclose the previous positions. `present` are the model's positions before the step.
template <typename S>
fcl::Vector3<S> commonTranslation(const fcl::Vector3<S>* present, const StepInput<S>& input,
                                  const VertexSlots::Samples& samples) {
  using Point = fcl::Vector3<S>;
  if (input.kind == StepKind::TwoFrames || input.indices || samples.size() == 0)
    return Point::Zero();
  const auto motion = [&](unsigned v) -> Point { return input.positions[v] - present[v]; };
  const Point common = motion(samples[0]);
  const S allowed = common.cwiseAbs().maxCoeff() / 16;
  for (Eigen::Index i = 0; i < samples.size(); ++i)
    if (!((motion(samples[i]) - common).cwiseAbs().maxCoeff() <= allowed))
      return Point::Zero();  // NaN positions are refused elsewhere
  return common;
}

}  // namespace

template <typename S>
template <typename BV>
void VertexStates<S>::start(const UpdateTarget<BV>& target, const ScaledFrame<S>& frame) {
  frame_ = frame;
  samples_ = target.tree.topology.slots.samples();
  readInPlace(target);
}

template <typename S>
template <typename BV>
void VertexStates<S>::begin(const UpdateTarget<BV>& target, const StepInput<S>& input) {
  common_ = adaptive_bvh::commonTranslation(target.tree.positions.data(), input, samples_);
  if (input.indices) return;  // the frame stays, since most states are not read again
  all_moving_ = true;
  const Float4 middle = body_.center();
  frame_.moveOrigin(frame_.back(middle));
  body_ = {body_.low - middle, body_.high - middle};
  if (input.kind == StepKind::TwoFrames) previous_.resize(states_.size() - 1);
}

template <typename S>
template <typename BV>
StepSummary<S> VertexStates<S>::read(const UpdateTarget<BV>& target, const StepInput<S>& input,
                                     int first, int last) {
  constexpr int kAhead = 8;  // slots to prefetch ahead: their vertices are scattered in the mesh
  // Local copies, because the stores below might change data behind pointers, for the compiler.
  const ScaledFrame<S> frame = frame_;
  const Point common = common_;
  const Point* const positions = input.positions;
  const Point* const present = target.tree.positions.data();
  const VertexSlots& slots = target.tree.topology.slots;
  const unsigned* const vertices = slots.vertices().data();
  const int end = static_cast<int>(slots.size()), used = static_cast<int>(slots.used());
  VertexState* const states = states_.data();
  StepSummary<S> summary;
  for (int i = first; i < last; ++i) {
    const unsigned ahead = vertices[std::min(i + kAhead, end - 1)];
    __builtin_prefetch(&positions[ahead]);
    __builtin_prefetch(&present[ahead]);
    const unsigned v = vertices[i];
    const Point to = positions[v], displacement = to - present[v];
    summary.add(to, displacement);
    const Float4 position = frame(to);
    if (i < used) summary.body.add(position);
    float4::store3(position, states[i].position);
    float4::store3(frame.displacement(displacement - common), states[i].motion);
  }
  if (input.kind == StepKind::TwoFrames)
    for (int i = first; i < last; ++i) {
      const Float4 position = frame(present[vertices[i]]);
      if (i < used) summary.body.add(position);
      float4::store(position, previous_[static_cast<std::size_t>(i)].data());
    }
  return StepSummary<S>(summary);  // a copy, so that `summary` stays in registers
}

template <typename S>
template <typename BV>
void VertexStates<S>::readInPlace(const UpdateTarget<BV>& target) {
  const fcl::BVHModel<BV>& model = target.model;
  const VertexSlots& slots = target.tree.topology.slots;
  const std::vector<unsigned>& vertices = slots.vertices();
  if (model.prev_vertices) previous_.resize(vertices.size());
  body_ = StepSummary<S>().body;
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const unsigned v = vertices[i];
    const Float4 position = frame_(target.tree.positions[v]);
    if (i < slots.used()) body_.add(position);
    float4::store3(position, states_[i].position);
    float4::store3(float4::all(0), states_[i].motion);
    if (!model.prev_vertices) continue;
    const Float4 before = frame_(model.prev_vertices[v]);
    if (i < slots.used()) body_.add(before);
    float4::store(before, previous_[i].data());
  }
  all_moving_ = true;
  stale_ = false;
  common_.setZero();
}

template <typename S>
void VertexStates<S>::clearMotions() {
  const auto stop = [](VertexState& state) { float4::store3(float4::all(0), state.motion); };
  if (all_moving_)
    for (VertexState& state : states_) stop(state);
  else
    for (unsigned slot : moving_slots_) stop(states_[slot]);
}

template class VertexStates<float>;
template class VertexStates<double>;

#define ADAPTIVE_BVH_INSTANTIATE(BV)                                                            \
  template void VertexStates<BV::S>::start(const UpdateTarget<BV>&, const ScaledFrame<BV::S>&); \
  template void VertexStates<BV::S>::begin(const UpdateTarget<BV>&, const StepInput<BV::S>&);   \
  template StepSummary<BV::S> VertexStates<BV::S>::read(const UpdateTarget<BV>&,                \
                                                        const StepInput<BV::S>&, int, int);     \
  template void VertexStates<BV::S>::readInPlace(const UpdateTarget<BV>&);
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
