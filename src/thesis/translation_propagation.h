#pragma once

#include <algorithm>
#include <vector>

#include "adaptive_bvh/refit_policy.h"
#include "base/task_pool.h"
#include "thesis/body_fit.h"
#include "thesis/refit.h"
#include "thesis/vertex_leaf_map.h"
#include "thesis/vertex_states.h"

namespace adaptive_bvh {

/// Propagation::TranslationCompensated: moves and inflates every volume so that it encloses its
/// triangles at their new positions.
///
/// Let every vertex below a node move by some d in the box [low, high] of displacements, c its
/// centre and h half its diagonal. d = c + e with |e| <= h. A volume that held the vertex at p
/// before holds p + c when it is moved by c, and p + d when its radius also grows by h. So a node
/// that moves as a whole does not grow at all, and one that is strained grows by its own strain,
/// at a rate relative to its size that does not depend on how large it is or how deep it lies.
///
/// The motions of VertexState are what is left beyond a common translation m: d = m + e. A volume
/// moves by m + c, c the centre of the box of the e; m is added in the model's own precision, so
/// that the single precision of c and h costs nothing where a body moves far and deforms little.
///
/// docs/bounds.md has the proof with rounding.
template <typename BV>
class TranslationPropagation {
 public:
  using S = typename BV::S;
  using Point = fcl::Vector3<S>;
  /// Whether a step of some vertices costs in proportion to these.
  static constexpr bool kTakesSomeVertices = true;
  using Summary = StepSummary<S>;

  /// Makes room for the tree's nodes and the model's vertices; `start` is to follow.
  void reset(const UpdateTarget<BV>& target);
  /// The refits of this step.
  using Fit = BodyFit<BV>;
  Fit fit(const UpdateTarget<BV>& target, const RefitPolicy& policy,
          const FitFunctions& functions = fitFunctions()) {
    return {target, vertices_, kept_.data(), policy, functions};
  }
  /// Begins anew: all volumes have been fitted to the present positions, the root's is `root`.
  void start(const UpdateTarget<BV>& target, const BV& root);

  /// \name A step: begin, read, then accept or discard; after accept propagate
  /// \{
  void begin(const UpdateTarget<BV>& target, const StepInput<S>& input) {
    vertices_.begin(target, input);
  }
  /// All vertices are read in so many parts, on any threads: those in [first, last) of them.
  static int readSize(const UpdateTarget<BV>& target) {
    return static_cast<int>(target.tree.topology.slots.size());
  }
  Summary read(const UpdateTarget<BV>& target, const StepInput<S>& input, int first, int last) {
    return vertices_.read(target, input, first, last);
  }
  /// Reads some vertices: see VertexStates.
  template <typename Moving>
  Summary readSome(const UpdateTarget<BV>& target, const StepInput<S>& input,
                   const VertexLeafMap& leaves, Moving&& moving) {
    return vertices_.readSome(target, input, leaves, moving);
  }
  /// The step takes place; its largest displacement can be followed.
  void accept(const UpdateTarget<BV>& target, const Summary& seen);
  /// The step does not take place, or nothing has moved.
  void discard() { vertices_.discard(); }
  /// Whether single precision can express a displacement of at most `largest`. False for NaN.
  bool canFollow(S largest) const { return largest * vertices_.frame().scale() < S(kRange); }
  /// Moves and inflates all volumes; none where all are to be refitted.
  PropagationCounts propagate(const UpdateTarget<BV>& target, const RefitPolicy& policy,
                              TaskPool& pool);
  /// Moves and inflates the dirty nodes and the root. Nothing may have moved below the other nodes.
  PropagationCounts propagateDirty(const UpdateTarget<BV>& target, const RefitPolicy& policy,
                                   const DirtyPairs& dirty);
  /// Whether single precision can still express the body's parts: false when the body has grown or
  /// shrunk to 2^30 times, or a 2^30th of, its size at `start`.
  bool isInRange() const {
    const float extent = vertices_.extent();
    return extent < kRange && extent > 1 / kRange;
  }
  /// Which nodes the last propagation left to be judged.
  const Candidates& candidates() const { return candidates_; }
  /// \}

  /// Radius of FCL's volume less its radius when last refitted.
  S inflation(const UpdateTarget<BV>& target, int node) const {
    return S(target.tree.inflations.of(node)) * vertices_.frame().unit();
  }
  S originalRadius(const UpdateTarget<BV>& target, int node) const {
    return std::max(S(0), Volume<BV>::radius(target.volume(node)) - inflation(target, node));
  }
  /// The volume of `node` was just fitted to the present positions.
  void refitted(const UpdateTarget<BV>& target, int node) { target.tree.inflations.set(node, 0); }

  /// The nodes whose turn it is to be refitted when they are too inflated, whether they were in the
  /// way of a query or not: in other steps others.
  NodeRange nextTurn(const UpdateTarget<BV>& target);

  std::size_t bytes() const;

 private:
  static constexpr float kRange = 1 << 30;

  template <bool kMarks>
  PropagationCounts propagateAll(const UpdateTarget<BV>& target, const RefitPolicy& policy,
                                 TaskPool& pool);
  template <bool kMarks>
  PropagationCounts propagateSubtrees(const UpdateTarget<BV>& target, const RefitPolicy& policy,
                                      TaskPool& pool);

  VertexStates<S> vertices_;
  Candidates candidates_;
  std::vector<KeptAxes> kept_;  ///< by Topology::innerIndex
  std::vector<Box> stack_;
  int next_turn_ = 0;  ///< a node
};

#define ADAPTIVE_BVH_INSTANTIATE(BV) extern template class TranslationPropagation<BV>;
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
