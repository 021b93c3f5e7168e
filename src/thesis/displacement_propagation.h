#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "adaptive_bvh/refit_policy.h"
#include "base/task_pool.h"
#include "mesh/vertex_summary.h"
#include "thesis/adaptive_tree.h"
#include "thesis/refit.h"

namespace adaptive_bvh {

/// Propagation::Displacements: the error propagation of thesis 4.3. Inflates every volume so that
/// it encloses its triangles at their new positions.
///
/// Leaf:  current = max(current, original + D_overall)     (step 3)
///        or original + D_overall, where `leaf_radius_may_shrink`
///        D_latest = latest displacement of its triangle   (step 4)
/// Inner: D_latest = max of both children's
///        current = current + D_latest                     (step 5)
///
/// Proof: let p be a corner of a triangle below the node and p' its new position. A leaf's original
/// volume contained p at its reference position, and |p' - p_reference| <= D_overall. An inner
/// volume contained p in the previous step, and |p' - p| <= D_latest. A volume is the set of all
/// points within its radius of its rectangle, so adding the displacement to the radius includes p';
/// as the volume is convex, it then contains the whole triangle. Displacements and sums are rounded
/// up (rounding.h).
///
/// Stores the data of thesis 4.2, as arrays in FCL's orders. A node's current radius is the one in
/// FCL's node. A primitive is a triangle, or a point of a point cloud. The public functions are
/// those that a step (step_scope.h) and a Refitter call; TranslationPropagation has the same ones.
template <typename BV>
class DisplacementPropagation {
 public:
  using S = typename BV::S;
  using Point = fcl::Vector3<S>;
  /// A step of some vertices is done as a step of all.
  static constexpr bool kTakesSomeVertices = false;
  using Summary = VertexSummary<S>;

  /// Allocates memory for the tree's nodes and the model's vertices; `start` must follow.
  void reset(const UpdateTarget<BV>& target);
  /// Restarts after all volumes have been fitted to the current positions; the root's volume is
  /// `root`.
  void start(const UpdateTarget<BV>& target, const BV& root);

  struct Fit {
    const UpdateTarget<BV> target;
    void add(int node) const { target.volume(node) = target.fitted(node); }
    static S finish() { return 0; }  // Volume::cornerSum: not needed by this propagation
  };
  static Fit fit(const UpdateTarget<BV>& target, const RefitPolicy&) { return {target}; }

  void begin(const UpdateTarget<BV>&, const StepInput<S>&) {}
  /// The number of vertices; `read` handles the range [first, last) of them, on any thread, and
  /// returns the statistics of their positions.
  static int readSize(const UpdateTarget<BV>& target) { return target.model.num_vertices; }
  VertexSummary<S> read(const UpdateTarget<BV>& target, const StepInput<S>& input, int first,
                        int last);
  void accept(const UpdateTarget<BV>&, const Summary&) {}
  void discard() {}
  /// A step at rest: no primitive has moved.
  void rest(const UpdateTarget<BV>&) { std::fill(latest_.begin(), latest_.end(), S(0)); }
  static bool canFollow(S largest) { return std::isfinite(largest); }
  /// Inflates all volumes, after the step's positions have been written to the model.
  PropagationCounts propagate(const UpdateTarget<BV>& target, const RefitPolicy& policy,
                              TaskPool& pool);
  static bool isInRange() { return true; }
  static const MayBeUnfit* candidates() { return nullptr; }  ///< a Refitter judges all nodes

  /// The current radius of FCL's volume minus its radius at the last refit.
  S inflation(const UpdateTarget<BV>& target, int node) const {
    return Volume<BV>::radius(target.volume(node)) - originalRadius(target, node);
  }
  S originalRadius(const UpdateTarget<BV>&, int node) const {
    return original_radius_[static_cast<std::size_t>(node)];
  }
  /// Stores the radius of a node whose volume was just fitted to the current positions; restarts
  /// the overall displacement of a leaf's primitive.
  void refitted(const UpdateTarget<BV>& target, int node);
  /// No nodes: the thesis refits only volumes that its criterion considers unfit.
  static NodeRange nextTurn(const UpdateTarget<BV>&) { return {}; }

  /// Largest displacement of a primitive's corners in the last step.
  S latestDisplacement(int primitive) const { return latest_[static_cast<std::size_t>(primitive)]; }
  /// Largest displacement of a primitive's corners since its leaf was last refitted.
  S overallDisplacement(int primitive) const {
    return overall_[static_cast<std::size_t>(primitive)];
  }

  std::size_t bytes() const;

 private:
  /// Sets `latest_` and `overall_` from the displacements of the vertices and the new positions.
  void measurePrimitives(const fcl::BVHModel<BV>& model);
  void restartPrimitive(const MeshView<S>& mesh, unsigned primitive);

  std::vector<S> original_radius_;               ///< by node: radius at its last refit
  std::vector<S> latest_, overall_;              ///< by primitive: see latestDisplacement
  std::vector<std::array<Point, 3>> reference_;  ///< by primitive: corners at its leaf's last refit
  std::vector<S> vertex_motion_;                 ///< by vertex: length of its last displacement
  std::vector<S> stack_;                         ///< of the post-order traversal
};

#define ADAPTIVE_BVH_INSTANTIATE(BV) extern template class DisplacementPropagation<BV>;
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
