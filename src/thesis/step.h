#pragma once

#include <variant>

#include "adaptive_bvh/refit_policy.h"
#include "adaptive_bvh/update_report.h"
#include "thesis/displacement_propagation.h"
#include "thesis/translation_propagation.h"
#include "thesis/vertex_leaf_map.h"

namespace adaptive_bvh {

/// What an update keeps from step to step, beside the AdaptiveTree: for the update alone.
template <typename BV>
struct UpdateState {
  /// In the order of the enum Propagation.
  std::variant<TranslationPropagation<BV>, DisplacementPropagation<BV>> method;
  VertexLeafMap leaves;  ///< empty until it is needed
  DirtyPairs dirty;      ///< none between steps
  int threads = 1;

  Propagation propagation() const { return static_cast<Propagation>(method.index()); }
  void setPropagation(Propagation propagation);

  std::size_t bytes() const {
    const auto of_method = [](const auto& method) { return method.bytes(); };
    return std::visit(of_method, method) + leaves.bytes() + dirty.bytes();
  }
};

/// The thesis's update (4.3): takes the model to the positions of `input`. Reads them, moves and
/// inflates all volumes bottom-up, and refits the volumes that the policy calls unfit. With indices
/// the cost is in proportion to the nodes above those vertices. Returns false, and changes nothing,
/// if a position is not finite or too large.
///
/// May throw std::bad_alloc before it writes a position: nothing that can be seen has changed then.
/// Where there is no memory later, for a fit, the step takes place, and all volumes are recomputed:
/// at once, or at the latest when the tree is read next. `report.resynchronised` says so; the
/// caller sets it before if it has repaired the tree.
///
/// Allocates nothing, but for `prev_vertices` in the first of two frames, on the first call with
/// indices, and on more than one thread.
template <typename BV>
bool takeStep(const UpdateTarget<BV>& target, UpdateState<BV>& state, const RefitPolicy& policy,
              const StepInput<typename BV::S>& input, UpdateReport& report);

/// Brings aabb_local, aabb_center and aabb_radius up to date, as FCL's computeLocalAABB does.
template <typename BV>
void updateLocalBounds(fcl::BVHModel<BV>& model);

/// Begins at a tree whose volumes are our own fits of the present positions.
template <typename BV>
void adoptBuild(const UpdateTarget<BV>& target, UpdateState<BV>& state);

/// Repairs a tree that was changed, or built, without our update: every volume is recomputed and
/// all that is kept begins anew. Nothing when the change detector matches. Threads that query may
/// call it at once. Returns whether there was a change.
template <typename BV>
bool repairIfChanged(const UpdateTarget<BV>& target, UpdateState<BV>& state);

}  // namespace adaptive_bvh
