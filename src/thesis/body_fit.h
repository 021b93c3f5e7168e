#pragma once

#include <array>
#include <vector>

#include "adaptive_bvh/refit_policy.h"
#include "base/leased.h"
#include "thesis/vertex_states.h"
#include "thesis/volumes/fit_kernels.h"

namespace adaptive_bvh {

/// Refits for TranslationPropagation: fits the volumes of nodes to the vertex states of a step, in
/// single precision and in groups of four or eight nodes (fit_kernels.h). A refit is one of two
/// kinds, with different costs:
/// - extents along known axes: the axes last chosen for the node, which rotate with its vertices;
///   for one or two triangles the axes that their shape defines;
/// - new axes (principal axes, and a search for the best sides), if the surface area of the volume
///   along the known ones has grown by more than RefitPolicy::axes_tolerance.
///
/// Volumes are enlarged by a bound of their rounding errors, so they enclose all triangles:
/// docs/bounds.md, 11. Use one object per thread; it allocates only when fits grow.
template <typename BV>
class BodyFit {
 public:
  using S = typename BV::S;

  /// `kept` are the axes of the tree's inner nodes, by Topology::innerIndex; refits update them.
  /// `functions` determine the number of nodes in a group; the volumes do not depend on it.
  BodyFit(const UpdateTarget<BV>& target, const VertexStates<S>& vertices, KeptAxes* kept,
          const RefitPolicy& policy, const FitFunctions& functions);

  /// Fits a node's volume to its triangles, now or later (nodes are fitted in groups).
  void add(int node);
  /// Fits the remaining nodes. Returns the largest Volume::cornerSum of all fitted volumes.
  S finish();

  /// Stores the axes of an inner node's volume that was fitted to these vertex states.
  void keepAxes(int node, const BV& bv);

 private:
  struct Group : FitGroup {
    int nodes[kMostLanes];
  };

  /// Adds a node to a group of its kind, and fits the group if that makes it full.
  void addTo(Group& group, int node, FitFunction fit);
  void finish(Group& group, FitFunction fit);
  /// The stored axes of an inner node; null if the node's shape defines its axes.
  KeptAxes* keptAxes(int node) const;
  void makeRoom(std::size_t points);
  /// Searches new axes for the node in a lane of a group, whose volume along its current axes has
  /// become too large: `area` is its surface area.
  void renewAxes(const Group& group, int lane, float area);
  /// The result of a search for the axes of a group of one node.
  Axes<Float4> bestAxesOf(const FitGroup& node) const;

  const UpdateTarget<BV> target_;
  const Topology& topology_;
  KeptAxes* const kept_;      ///< by Topology::innerIndex
  const float area_ratio_;    ///< largest ratio of a volume's area to KeptAxes::area without search
  const double unit_;         ///< the mesh's units per body unit
  const FitFunctions& fits_;  ///< a fit for each kind of node
  FitSource source_;
  const Leased<std::vector<float>> work_;  ///< memory of FitSource::work

  // The nodes added and not yet fitted, by kind (see FitFunctions). Patches with similar numbers of
  // triangles form groups, because a group takes as long as its largest node.
  static constexpr int kSizes = 8;
  Group triangles_, quads_, patches_[kSizes], others_;
  double largest_corner_sum_ = 0;
};

#define ADAPTIVE_BVH_INSTANTIATE(BV) extern template class BodyFit<BV>;
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
