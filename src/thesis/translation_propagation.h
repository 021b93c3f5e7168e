#pragma once

#include <algorithm>
#include <vector>

#include "adaptive_bvh/refit_policy.h"
#include "base/task_pool.h"
#include "thesis/body_fit.h"
#include "thesis/refit.h"
#include "thesis/vertex_states.h"

namespace adaptive_bvh {

/// Propagation::TranslationCompensated: moves and inflates every volume so that it encloses its
/// triangles at their new positions.
///
/// Let every vertex below a node move by some displacement d in the box [low, high], with centre c
/// and half diagonal h. Then d = c + e with |e| <= h. A volume that contained the vertex at p
/// before the step contains p + c after it is moved by c, and p + d after its radius also grows by
/// h. So a node that moves rigidly by a translation does not grow, and a node that is strained
/// grows by its own strain, at a rate relative to its size that does not depend on its size or
/// depth.
///
/// VertexState::motion is the remainder of d beyond a common translation m of the whole body, and
/// the box is that of the remainders: a volume moves by m + c. m is added in the model's precision,
/// so that the single precision of c and h costs nothing if a body moves far and deforms little.
///
/// The proof with rounding is in docs/bounds.md.
template <typename BV>
class TranslationPropagation {
 public:
  using S = typename BV::S;
  using Point = fcl::Vector3<S>;
  /// Whether the cost of a step of some vertices is proportional to their number.
  static constexpr bool kTakesSomeVertices = true;
  using Summary = StepSummary<S>;

  /// Allocates memory for the tree's nodes and the model's vertices; `start` must follow.
  void reset(const UpdateTarget<BV>& target);
  /// Returns an object that does refits to the positions of the last step.
  using Fit = BodyFit<BV>;
  Fit fit(const UpdateTarget<BV>& target, const RefitPolicy& policy,
          const FitFunctions& functions = fitFunctions()) {
    return {target, vertices_, kept_.data(), policy, functions};
  }
  /// Restarts after all volumes have been fitted to the current positions; the root's volume is
  /// `root`.
  void start(const UpdateTarget<BV>& target, const BV& root);

  /// \name A step: begin, read, then accept or discard; after accept propagate
  /// \{
  void begin(const UpdateTarget<BV>& target, const StepInput<S>& input) {
    vertices_.begin(target, input);
  }
  /// The number of slots; `read` handles the range [first, last) of them, on any thread, and
  /// returns the statistics of their positions.
  static int readSize(const UpdateTarget<BV>& target) {
    return static_cast<int>(target.tree.topology.slots.size());
  }
  Summary read(const UpdateTarget<BV>& target, const StepInput<S>& input, int first, int last) {
    return vertices_.read(target, input, first, last);
  }
  /// Reads the positions of some vertices: see VertexStates.
  template <typename Moving>
  Summary readSome(const UpdateTarget<BV>& target, const StepInput<S>& input, DirtyNodes& nodes,
                   Moving&& moving) {
    return vertices_.readSome(target, input, nodes, moving);
  }
  /// Accepts the step, whose largest displacement satisfies canFollow. Its positions have been
  /// written to the model; `summary` is the sum of all results of `read`.
  void accept(const UpdateTarget<BV>& target, const Summary& summary);
  void discard() { vertices_.discard(); }  ///< discards the step: the model keeps its positions
  /// Prepares refits in a step at rest.
  void rest(const UpdateTarget<BV>& target) {
    vertices_.rest(target);
    has_candidates_ = false;  // queries may have changed which volumes are unfit
  }
  /// Whether single precision can express a displacement of at most `largest`. False for NaN.
  bool canFollow(S largest) const { return largest * vertices_.frame().scale() < S(kRange); }
  /// Moves and inflates all volumes, or none if all will be refitted.
  PropagationCounts propagate(const UpdateTarget<BV>& target, const RefitPolicy& policy,
                              TaskPool& pool);
  /// Moves and inflates the nodes above moved vertices (Topology::dirtyNodes). Nothing may have
  /// moved below the others.
  PropagationCounts propagateDirty(const UpdateTarget<BV>& target, const RefitPolicy& policy,
                                   DirtyNodes& nodes);
  /// Whether single precision can still represent the body's parts: false if the body has grown or
  /// shrunk by a factor of 2^30 since `start`.
  bool isInRange() const {
    const float extent = vertices_.extent();
    return extent < kRange && extent > 1 / kRange;
  }
  /// By node. A Refitter judges the candidates, or all nodes if this is null.
  const MayBeUnfit* candidates() const { return has_candidates_ ? candidates_.data() : nullptr; }
  /// \}

  /// The current radius of FCL's volume minus its radius at the last refit.
  S inflation(const UpdateTarget<BV>& target, int node) const {
    return S(target.tree.inflations.of(node)) * vertices_.frame().unit();
  }
  S originalRadius(const UpdateTarget<BV>& target, int node) const {
    return std::max(S(0), Volume<BV>::radius(target.volume(node)) - inflation(target, node));
  }
  /// Resets the inflation of a node whose volume was just fitted to the current positions.
  void refitted(const UpdateTarget<BV>& target, int node) { target.tree.inflations.set(node, 0); }

  /// The nodes that a Refitter also judges by their inflation alone in this step. Every node gets
  /// its turn once in 64 steps.
  NodeRange nextTurn(const UpdateTarget<BV>& target);

  std::size_t bytes() const;

 private:
  static constexpr float kRange = 1 << 30;  ///< in body units

  /// Moves and inflates all volumes. With kMarks, marks candidates for a refit.
  template <bool kMarks>
  PropagationCounts propagateAll(const UpdateTarget<BV>& target, const RefitPolicy& policy,
                                 TaskPool& pool);
  /// The same on several threads.
  template <bool kMarks>
  PropagationCounts propagateSubtrees(const UpdateTarget<BV>& target, const RefitPolicy& policy,
                                      TaskPool& pool);

  VertexStates<S> vertices_;
  std::vector<MayBeUnfit> candidates_;  ///< by node
  bool has_candidates_ = false;         ///< not if only visited nodes can be unfit, which are fewer
  std::vector<KeptAxes> kept_;          ///< indexed by Topology::innerIndex
  std::vector<Box> stack_;              ///< of the post-order traversal
  int next_turn_ = 0;                   ///< first node of the next turn
};

#define ADAPTIVE_BVH_INSTANTIATE(BV) extern template class TranslationPropagation<BV>;
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
