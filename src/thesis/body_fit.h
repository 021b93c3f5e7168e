#pragma once

#include <array>
#include <vector>

#include "adaptive_bvh/refit_policy.h"
#include "base/leased.h"
#include "thesis/vertex_states.h"
#include "thesis/volumes/fit_kernels.h"

namespace adaptive_bvh {

/// The refits of TranslationPropagation, from the vertex states of a step. They have two prices:
/// - extents along known axes: the node's former axes, rotated with its vertices since they were
///   chosen; for one or two triangles the axes that their shape defines.
/// - axes anew, where the volume along the kept ones has grown beyond RefitPolicy::axes_tolerance:
///   principal axes, and a search for the best sides.
///
/// docs/bounds.md, 11: what is computed in single precision here holds all triangles. One object a
/// thread; allocates only while a thread's fits grow in size.
template <typename BV>
class BodyFit {
 public:
  using S = typename BV::S;

  /// `functions`: for so many lanes; volumes are the same for any number.
  BodyFit(const UpdateTarget<BV>& target, const VertexStates<S>& vertices, KeptAxes* kept,
          const RefitPolicy& policy, const FitFunctions& functions);

  /// Fits a node's volume to its triangles, at the latest in `finish`: nodes are collected by kind,
  /// and nodes of one kind are fitted together.
  void add(int node);
  /// Returns the largest Volume::cornerSum of all volumes that were fitted.
  S finish();

  /// Begins to keep the axes of an inner node's volume that was fitted to these vertex states.
  void keepAxes(int node, const BV& bv);

 private:
  struct Group : FitGroup {
    int nodes[kMostLanes];
  };

  void addTo(Group& group, int node, FitFunction fit);
  void finish(Group& group, FitFunction fit);
  /// The kept axes of an inner node whose shape does not define its axes, or null.
  KeptAxes* keptAxes(int node) const;
  void makeRoom(std::size_t points);
  /// New axes for a volume that has outgrown its present ones.
  void renewAxes(const Group& group, int lane, float area);
  Axes<Float4> bestAxesOf(const FitGroup& of) const;

  const UpdateTarget<BV> target_;
  const Topology& topology_;
  KeptAxes* const kept_;  ///< by Topology::innerIndex
  const float limit_;     ///< of the growth of a volume's surface
  const double unit_;
  const FitFunctions& fits_;
  FitSource source_;
  const Leased<std::vector<float>> work_;

  /// Nodes of about as many triangles are worked on at once.
  static constexpr int kSizes = 8;
  Group triangles_, quads_, patches_[kSizes], others_;
  double largest_corner_sum_ = 0;
};

#define ADAPTIVE_BVH_INSTANTIATE(BV) extern template class BodyFit<BV>;
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
