#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include <fcl/common/types.h>

#include "base/box.h"
#include "base/float4.h"
#include "hierarchy/dirty_nodes.h"
#include "mesh/vertex_summary.h"
#include "thesis/adaptive_tree.h"
#include "thesis/volumes/fit_kernels.h"

namespace adaptive_bvh {

/// The single-precision coordinates of an update: y = scale (x - origin), along the axes of the
/// mesh. The origin is near the body's centre. The scale is a power of two that brings the body's
/// size to about 1, so that neither huge nor tiny meshes leave the range of single precision. A
/// unit of these coordinates is called a *body unit*.
template <typename S>
class ScaledFrame {
 public:
  using Point = fcl::Vector3<S>;

  ScaledFrame() : ScaledFrame(Point::Zero(), S(1)) {}
  /// `size` is a typical length of the body, >= 0.
  ScaledFrame(const Point& origin, S size) : origin_(origin) {
    const int limit = std::numeric_limits<S>::max_exponent - 25;
    const int exponent = size > 0 ? std::min(std::max(std::ilogb(size), -limit), limit) : 0;
    scale_ = std::ldexp(S(1), -exponent);
    unit_ = std::ldexp(S(1), exponent);
  }

  /// The coordinates of the mesh's point x in this frame. The relative error of a component is 2u,
  /// u = 2^-24: the difference is rounded in S, then to single precision. A component below 2^-126
  /// may become 0.
  ADAPTIVE_BVH_INLINE Float4 operator()(const Point& x) const {
    return Float4{scaled(x[0] - origin_[0]), scaled(x[1] - origin_[1]), scaled(x[2] - origin_[2]),
                  0};
  }
  /// The point of the mesh with these coordinates in this frame.
  Point back(const Float4& y) const {
    return {origin_[0] + S(y[0]) * unit_, origin_[1] + S(y[1]) * unit_,
            origin_[2] + S(y[2]) * unit_};
  }

  /// The displacement d in body units. Either the relative error is 2u, or the error of each
  /// component is below 2^-59: if all components of d are below `kLeast`, but not all are 0, the
  /// first one becomes kLeast, because a zero vector would mean no motion. (A huge body may have
  /// tiny triangles.)
  ADAPTIVE_BVH_INLINE Float4 displacement(const Point& d) const {
    Float4 v{scaled(d[0]), scaled(d[1]), scaled(d[2]), 0};
    const bool is_large =
        std::abs(v[0]) >= kLeast || std::abs(v[1]) >= kLeast || std::abs(v[2]) >= kLeast;
    if (!is_large && (d[0] != 0 || d[1] != 0 || d[2] != 0)) v[0] = kLeast;
    return v;
  }
  static constexpr float kLeast = 1.f / (1ull << 60);

  const Point& origin() const { return origin_; }
  void moveOrigin(const Point& origin) { origin_ = origin; }
  /// Body units per unit of the mesh, a power of two: products with it are exact.
  S scale() const { return scale_; }
  /// The mesh's units per body unit: the exact inverse of `scale`.
  S unit() const { return unit_; }

 private:
  float scaled(S difference) const { return static_cast<float>(difference * scale_); }

  Point origin_;
  S scale_, unit_;
};

/// Statistics of a step's positions.
template <typename S>
struct StepSummary : VertexSummary<S> {
  /// Bounding box of all vertices that belong to a triangle, of both frames if two are stored; in
  /// the coordinates of the step (ScaledFrame).
  Box body{float4::all(std::numeric_limits<float>::max()),
           float4::all(std::numeric_limits<float>::lowest())};

  using VertexSummary<S>::add;
  void add(const StepSummary& other) {
    VertexSummary<S>::add(other);
    body.add(other.body);
  }
};

/// The vertex pass of TranslationPropagation: reads the positions of a step into the states that
/// the propagation uses, indexed by slot (VertexSlots). Changes nothing that queries read.
template <typename S>
class VertexStates {
 public:
  using Point = fcl::Vector3<S>;

  /// Allocates the states of this number of slots; `start` must follow.
  void reset(std::size_t slots) { states_.resize(slots + 1); }
  /// Restarts at the model's positions, without motion, in a given frame.
  template <typename BV>
  void start(const UpdateTarget<BV>& target, const ScaledFrame<S>& frame);

  /// Prepares reading a step: chooses its common translation and, for a step of all vertices, moves
  /// the frame's origin to the body's centre, because single precision loses digits far from it.
  template <typename BV>
  void begin(const UpdateTarget<BV>& target, const StepInput<S>& input);
  /// Reads the positions of the slots in [first, last) in a step of all vertices. Returns their
  /// statistics. Several threads may do this at once.
  template <typename BV>
  StepSummary<S> read(const UpdateTarget<BV>& target, const StepInput<S>& input, int first,
                      int last);
  /// Reads the positions in a step of some vertices. Returns their statistics, with the bounding
  /// box of the whole body. Calls moving(vertex, position) once per vertex, with its last position.
  template <typename BV, typename Moving>
  StepSummary<S> readSome(const UpdateTarget<BV>& target, const StepInput<S>& input,
                          DirtyNodes& nodes, Moving&& moving);
  /// Prepares refits in a step at rest.
  template <typename BV>
  void rest(const UpdateTarget<BV>& target) {
    if (stale_) readInPlace(target);
  }
  /// Discards a step: the states no longer match the model's positions.
  void discard() { stale_ = true; }
  /// Accepts a step with these statistics: its positions become the model's.
  void accept(const StepSummary<S>& summary) {
    stale_ = false;
    body_ = summary.body;
  }

  /// The coordinates of the step being read.
  const ScaledFrame<S>& frame() const { return frame_; }
  /// The largest absolute coordinate of the body in the last accepted step, in body units.
  float extent() const { return body_.largestCoordinate(); }
  /// The translation that every VertexState::motion leaves out, in the mesh's units.
  const Point& commonTranslation() const { return common_; }
  const VertexState* data() const { return states_.data(); }  ///< the states of all slots
  /// The previous position of each slot, if two frames are stored: four numbers, the last unused.
  const std::array<float, 4>* previous() const { return previous_.data(); }

  std::size_t bytes() const {
    const auto size = [](const auto& v) { return v.capacity() * sizeof(v[0]); };
    return size(states_) + size(previous_) + size(moving_slots_);
  }

 private:
  /// Reads the model's current positions, with motion 0.
  template <typename BV>
  void readInPlace(const UpdateTarget<BV>& target);
  void clearMotions();  ///< sets all motions to 0

  std::vector<VertexState> states_;  ///< plus one element, for loads of four numbers
  std::vector<std::array<float, 4>> previous_;
  /// The slots that may have a motion other than 0: all, or those listed in `moving_slots_`.
  bool all_moving_ = true;
  std::vector<unsigned> moving_slots_;
  bool stale_ = false;  ///< whether the states differ from the model's current positions

  ScaledFrame<S> frame_;
  Box body_;  ///< StepSummary::body of the last accepted step
  /// A translation, in the mesh's units, that most of the body shares in this step; VertexState::
  /// motion is what remains. It is small if the body hardly deforms, however far the body moves,
  /// and so are its errors in single precision.
  Point common_ = Point::Zero();
  VertexSlots::Samples samples_;
};

template <typename S>
template <typename BV, typename Moving>
StepSummary<S> VertexStates<S>::readSome(const UpdateTarget<BV>& target, const StepInput<S>& input,
                                         DirtyNodes& nodes, Moving&& moving) {
  if (stale_) readInPlace(target);
  clearMotions();
  moving_slots_.clear();
  all_moving_ = false;
  StepSummary<S> summary;
  summary.body = body_;
  nodes.forEachLast(input.indices, input.count, [&](std::size_t i) {
    const unsigned v = input.indices[i];
    const Point& to = input.positions[i];
    const Point displacement = to - target.tree.positions[v];
    summary.add(to, displacement);
    moving(v, to);
    const Float4 position = frame_(to), motion = frame_.displacement(displacement);
    target.tree.topology.forEachSlot(v, nodes, [&](unsigned slot) {
      summary.body.add(position);
      float4::store3(position, states_[slot].position);
      float4::store3(motion, states_[slot].motion);
      moving_slots_.push_back(slot);
    });
  });
  return summary;
}

extern template class VertexStates<float>;
extern template class VertexStates<double>;

}  // namespace adaptive_bvh
