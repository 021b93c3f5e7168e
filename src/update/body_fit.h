#pragma once

#include <array>

#include "adaptive_bvh/refit_policy.h"
#include "update/kept_axes.h"
#include "update/model_volumes.h"
#include "update/update_target.h"
#include "update/vertex_states.h"
#include "volume/point_arrays.h"

namespace adaptive_bvh {

/// The refits of TranslationPropagation, from the vertex states of a step. They have two prices:
/// - extents along axes that are known: those that the node had, turned as its vertices have turned
///   since they were chosen; for one or two triangles those that their shape gives.
/// - axes anew, where the volume along the kept ones has grown beyond RefitPolicy::axes_tolerance:
///   principal axes, and a search for the best sides.
///
/// docs/bounds.md, 11: what is computed in single precision here holds all triangles. One object a
/// thread; allocates only while a thread's fits grow in size.
template <typename BV>
class BodyFit {
 public:
  using S = typename BV::S;

  /// `previous`: by slot, the step before of two frames, or null.
  BodyFit(const UpdateTarget<BV>& target, const VertexState* states,
          const std::array<float, 4>* previous, KeptAxes* kept, const RefitPolicy& policy);

  /// The volume around the triangles of a node.
  BV operator()(int node);
  /// Writes those of many nodes, `to[i]` of `nodes[i]`. Faster than one by one.
  void operator()(const int* nodes, BV* const* to, int count);

  /// Begins to keep the axes of a volume with three triangles or more that was fitted to these
  /// vertex states.
  void keepAxes(int node, const BV& bv);

 private:
  ADAPTIVE_BVH_INLINE Float4 at(unsigned slot) const {
    return float4::load(states_[slot].position);
  }
  bool isTriangle(int node) const {
    return target_.model.getBV(node).num_primitives == 1 && !previous_;
  }
  void fitTriangles(const std::size_t (&leaves)[kLanes], BodyVolume (&volumes)[kLanes]) const;
  BodyVolume fit(int node);
  BodyVolume fitPair(std::size_t leaf);
  Axes4 bestAxesOf(const VertexSlots::Set& below);
  Axes4 nodeFrame(std::size_t first, std::size_t count) const;
  template <bool kWithBox>
  Ranges turnPoints(const VertexSlots::Set& below, const Axes4& axes);
  Extents extentsAlong(const Axes4& axes, const VertexSlots::Set& below);
  BodyVolume fitAlong(const Axes4& axes, const VertexSlots::Set& below) {
    return volumeAlong(axes, extentsAlong(axes, below));
  }
  BodyVolume volumeAlong(const Axes4& axes, const Extents& extents) const {
    return {axes, first_ + axes.combine(extents.corner[0], extents.corner[1], extents.corner[2]),
            extents};
  }

  const UpdateTarget<BV> target_;
  const VertexSlots& slots_;
  const VertexState* const states_;
  const std::array<float, 4>* const previous_;
  KeptAxes* const kept_;  ///< by BoxNodes::largeIndex
  const float limit_;     ///< of the growth of a volume's surface
  const BodyFrame<S>& frame_;
  const ModelVolumes<BV> in_model_;
  Float4 first_;                      ///< of the points of this fit
  PointArrays<float>&points_, &few_;  ///< all along some axes, from the first; some of them
};

}  // namespace adaptive_bvh
