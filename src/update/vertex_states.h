#pragma once

#include <array>
#include <vector>

#include "update/best_fit_rotation.h"
#include "update/step_input.h"
#include "update/update_target.h"
#include "update/vertex_summary.h"

namespace adaptive_bvh {

/// A vertex in this step: where it is, in body coordinates, and its motion beyond the common
/// translation, in the model's axes and body units.
struct alignas(32) VertexState {
  float position[4];
  float motion[4];
};

/// The vertex pass of TranslationPropagation: reads the positions of a step, once, into the states
/// that the propagation uses. Changes nothing that queries see.
template <typename S>
class VertexStates {
 public:
  using Point = fcl::Vector3<S>;

  void reset(int vertices) { states_.resize(static_cast<std::size_t>(vertices)); }
  /// Begins anew, at the model's positions without motion, in a frame.
  template <typename BV>
  void start(const UpdateTarget<BV>& target, const BodyFrame<S>& frame);

  /// Before the positions of a step are read: chooses its frame and its common translation.
  template <typename BV>
  void begin(const UpdateTarget<BV>& target, const StepInput<S>& input);
  /// Reads the positions of the vertices in [first, last), where all are given. Several threads may
  /// do so.
  VertexSummary<S> read(const Point* present, const StepInput<S>& input, int first, int last);
  /// Reads the positions of some vertices. Calls moving(vertex, position) once for each vertex
  /// named, with the last position given for it.
  template <typename BV, typename Moving>
  VertexSummary<S> readSome(const fcl::BVHModel<BV>& model, const StepInput<S>& input,
                            Moving&& moving);
  /// The step does not take place: what was read is not the model's state.
  void discard() { stale_ = true; }
  void accept() { stale_ = false; }

  /// Body coordinates of the step that is being read.
  const BodyFrame<S>& frame() const { return frame_; }
  const Point& commonTranslation() const { return common_; }
  const VertexState* data() const { return states_.data(); }
  /// By vertex, where two frames are kept: where it was in the step before, in body coordinates.
  const std::array<float, 4>* previous() const { return previous_.data(); }

  std::size_t bytes() const {
    const auto size = [](const auto& v) { return v.capacity() * sizeof(v[0]); };
    return size(states_) + size(previous_) + size(moving_) + rotation_.bytes();
  }

 private:
  template <typename BV>
  void readInPlace(const fcl::BVHModel<BV>& model);
  void forgetMotion();

  std::vector<VertexState> states_;
  std::vector<std::array<float, 4>> previous_;
  /// Which vertices may have a motion other than 0: all, or those listed.
  bool all_moving_ = true;
  std::vector<unsigned> moving_;
  /// The states are not those of the model's present positions.
  bool stale_ = false;

  BodyFrame<S> frame_;
  /// A motion of any size that most of the body shares in this step. What remains of a vertex's
  /// motion is small when the body hardly deforms, and so are its errors in single precision.
  Point common_ = Point::Zero();
  BestFitRotation<S> rotation_;
};

template <typename S>
template <typename BV, typename Moving>
VertexSummary<S> VertexStates<S>::readSome(const fcl::BVHModel<BV>& model,
                                           const StepInput<S>& input, Moving&& moving) {
  if (stale_) readInPlace(model);
  forgetMotion();
  moving_.clear();
  all_moving_ = false;
  VertexSummary<S> summary;
  for (std::size_t i = input.count; i-- > 0;) {
    const unsigned v = input.indices[i];
    VertexState& state = states_[v];
    if (state.motion[3] != 0) continue;  // was named again, later
    moving_.push_back(v);
    const Point& to = input.positions[i];
    const Point displacement = to - model.vertices[v];
    summary.add(to, displacement);
    moving(v, to);
    float4::store(frame_.toBodyFrame(to), state.position);
    float4::store(frame_.displacement(displacement), state.motion);
    state.motion[3] = 1;
  }
  return summary;
}

extern template class VertexStates<float>;
extern template class VertexStates<double>;

}  // namespace adaptive_bvh
