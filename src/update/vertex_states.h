#pragma once

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "mesh/best_fit_turn.h"
#include "mesh/vertex_summary.h"
#include "update/step_input.h"
#include "update/update_target.h"
#include "update/vertex_leaf_map.h"

namespace adaptive_bvh {

/// A vertex in this step: where it is, in body coordinates, and its motion beyond the common
/// translation, in the model's axes and body units. Loads of four numbers take one of what follows
/// in memory.
struct VertexState {
  float position[3];
  float motion[3];
};

/// The vertex pass of TranslationPropagation: reads the positions of a step into the states that
/// the propagation uses, by slot (VertexSlots). Changes nothing that queries see.
template <typename S>
class VertexStates {
 public:
  using Point = fcl::Vector3<S>;

  void reset(std::size_t slots) { states_.resize(slots + 1); }
  /// Begins anew, at the model's positions without motion, in a frame.
  template <typename BV>
  void start(const UpdateTarget<BV>& target, const BodyFrame<S>& frame);

  /// Before the positions of a step are read: chooses its frame and its common translation.
  template <typename BV>
  void begin(const UpdateTarget<BV>& target, const StepInput<S>& input);
  /// Reads the positions of the slots in [first, last), where all are given. Several threads may do
  /// so.
  template <typename BV>
  VertexSummary<S> read(const UpdateTarget<BV>& target, const StepInput<S>& input, int first,
                        int last);
  /// Reads the positions of some vertices. Calls moving(vertex, position) once for each vertex
  /// named, with the last position given for it.
  template <typename BV, typename Moving>
  VertexSummary<S> readSome(const UpdateTarget<BV>& target, const StepInput<S>& input,
                            const VertexLeafMap& leaves, Moving&& moving);
  /// The step does not take place: what was read is not the model's state.
  void discard() { stale_ = true; }
  void accept() { stale_ = false; }

  /// Body coordinates of the step that is being read.
  const BodyFrame<S>& frame() const { return frame_; }
  const Point& commonTranslation() const { return common_; }
  const VertexState* data() const { return states_.data(); }
  /// By slot, where two frames are kept: where it was in the step before, in body coordinates.
  const std::array<float, 4>* previous() const { return previous_.data(); }

  std::size_t bytes() const {
    const auto size = [](const auto& v) { return v.capacity() * sizeof(v[0]); };
    return size(states_) + size(previous_) + size(moving_) + size(named_) + rotation_.bytes();
  }

 private:
  template <typename BV>
  void turn(const UpdateTarget<BV>& target, const Point* positions);
  template <typename BV>
  void readInPlace(const UpdateTarget<BV>& target);
  void forgetMotion();

  std::vector<VertexState> states_;  ///< and one more, for loads of four numbers
  std::vector<std::array<float, 4>> previous_;
  /// Which slots may have a motion other than 0: all, or those listed.
  bool all_moving_ = true;
  std::vector<unsigned> moving_;
  std::vector<std::uint64_t> named_;  ///< a bit a vertex; none between steps
  /// The states are not those of the model's present positions.
  bool stale_ = false;

  BodyFrame<S> frame_;
  /// A motion of any size that most of the body shares in this step. What remains of a vertex's
  /// motion is small when the body hardly deforms, and so are its errors in single precision.
  Point common_ = Point::Zero();
  BestFitTurn rotation_;
};

template <typename S>
template <typename BV, typename Moving>
VertexSummary<S> VertexStates<S>::readSome(const UpdateTarget<BV>& target,
                                           const StepInput<S>& input, const VertexLeafMap& leaves,
                                           Moving&& moving) {
  if (stale_) readInPlace(target);
  forgetMotion();
  moving_.clear();
  all_moving_ = false;
  const auto nodes = std::as_const(*target.tree.boxes).nodes();
  VertexSummary<S> summary;
  named_.resize((static_cast<std::size_t>(target.model.num_vertices) + 63) / 64);
  for (std::size_t i = input.count; i-- > 0;) {
    const unsigned v = input.indices[i];
    if (named_[v / 64] >> (v % 64) & 1) continue;  // was named again, later
    named_[v / 64] |= std::uint64_t(1) << (v % 64);
    const Point& to = input.positions[i];
    const Point displacement = to - target.model.vertices[v];
    summary.add(to, displacement);
    moving(v, to);
    const Float4 position = frame_.toBodyFrame(to), motion = frame_.displacement(displacement);
    leaves.forEachSlot(v, target.tree.topology.slots, nodes, [&](unsigned slot) {
      float4::store3(position, states_[slot].position);
      float4::store3(motion, states_[slot].motion);
      moving_.push_back(slot);
    });
  }
  for (std::size_t i = 0; i < input.count; ++i) named_[input.indices[i] / 64] = 0;
  return summary;
}

extern template class VertexStates<float>;
extern template class VertexStates<double>;

}  // namespace adaptive_bvh
