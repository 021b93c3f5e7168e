#pragma once

#include <array>
#include <vector>

#include "adaptive_bvh/refit_policy.h"
#include "base/leased.h"
#include "thesis/vertex_states.h"
#include "thesis/volumes/fit_kernels.h"

namespace adaptive_bvh {

/// Refits for TranslationPropagation, from the vertex states of a step. A refit is one of two
/// kinds, with different costs:
/// - extents along known axes: the node's former axes, which rotate with its vertices; for one or
///   two triangles the axes that their shape defines;
/// - new axes, if the volume along the former ones has grown beyond RefitPolicy::axes_tolerance:
///   principal axes, and a search for the best sides.
///
/// The volumes enclose all triangles although they are computed in single precision:
/// docs/bounds.md, 11. Use one object per thread; it allocates only when a thread's fits grow in
/// size.
template <typename BV>
class BodyFit {
 public:
  using S = typename BV::S;

  /// `functions` determine the number of lanes; the volumes do not depend on it.
  BodyFit(const UpdateTarget<BV>& target, const VertexStates<S>& vertices, KeptAxes* kept,
          const RefitPolicy& policy, const FitFunctions& functions);

  /// Fits a node's volume to its triangles, at the latest in `finish`: nodes are collected by kind
  /// and fitted in groups.
  void add(int node);
  /// Fits the remaining nodes. Returns the largest Volume::cornerSum of all fitted volumes.
  S finish();

  /// Stores the axes of an inner node's volume that was fitted to these vertex states.
  void keepAxes(int node, const BV& bv);

 private:
  struct Group : FitGroup {
    int nodes[kMostLanes];
  };

  void addTo(Group& group, int node, FitFunction fit);
  void finish(Group& group, FitFunction fit);
  /// The stored axes of an inner node, or null if its shape defines its axes.
  KeptAxes* keptAxes(int node) const;
  void makeRoom(std::size_t points);
  /// Computes new axes for a volume that has become too large along its current ones.
  void renewAxes(const Group& group, int lane, float area);
  Axes<Float4> bestAxesOf(const FitGroup& of) const;

  const UpdateTarget<BV> target_;
  const Topology& topology_;
  KeptAxes* const kept_;  ///< by Topology::innerIndex
  const float limit_;     ///< largest allowed growth of a volume's surface
  const double unit_;
  const FitFunctions& fits_;
  FitSource source_;
  const Leased<std::vector<float>> work_;

  /// Nodes with similar numbers of triangles are fitted together.
  static constexpr int kSizes = 8;
  Group triangles_, quads_, patches_[kSizes], others_;
  double largest_corner_sum_ = 0;
};

#define ADAPTIVE_BVH_INSTANTIATE(BV) extern template class BodyFit<BV>;
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
