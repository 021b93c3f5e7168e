#pragma once

#include <variant>

#include "adaptive_bvh/refit_policy.h"
#include "adaptive_bvh/update_report.h"
#include "hierarchy/dirty_nodes.h"
#include "thesis/displacement_propagation.h"
#include "thesis/translation_propagation.h"

namespace adaptive_bvh {

/// What only updates of a model use and keep between steps, in addition to the AdaptiveTree.
template <typename BV>
struct UpdateState {
  /// Alternatives in the order of the enum Propagation.
  std::variant<TranslationPropagation<BV>, DisplacementPropagation<BV>> method;
  DirtyNodes moved;  ///< Topology::dirtyNodes; empty until the first step of some vertices
  int threads = 1;   ///< for steps of large models

  Propagation propagation() const { return static_cast<Propagation>(method.index()); }
  /// Replaces `method` by a new one without data; a repair must follow.
  void setPropagation(Propagation propagation);

  std::size_t bytes() const {
    const auto of_method = [](const auto& method) { return method.bytes(); };
    return std::visit(of_method, method) + moved.bytes();
  }
};

/// The thesis's update (4.3): moves the model to the positions of `input`. Reads them, moves and
/// inflates all volumes bottom-up, and refits the volumes that the policy considers unfit. With
/// indices, Propagation::TranslationCompensated and one frame, the cost is proportional to the
/// number of nodes above these vertices. Returns false, and changes nothing, if a position is not
/// finite or too large.
///
/// The tree must be current (repairIfChanged), because displacements count from the positions that
/// the volumes enclose. `report` is new, but `report.resynchronised` is set if the tree was
/// repaired.
///
/// Throws std::bad_alloc only before it writes a position, and then without visible changes. If
/// memory for a fit runs out later, the step takes place and all volumes are recomputed: at once,
/// or at the latest when the tree is next read. Then `report.resynchronised` is set.
///
/// Allocates nothing, except `prev_vertices` in the first two-frame update, on the first call with
/// indices, and on more than one thread.
template <typename BV>
bool takeStep(const UpdateTarget<BV>& target, UpdateState<BV>& state, const RefitPolicy& policy,
              const StepInput<typename BV::S>& input, UpdateReport& report);

/// Updates the model's aabb_local, aabb_center and aabb_radius, like FCL's computeLocalAABB.
template <typename BV>
void updateLocalBounds(fcl::BVHModel<BV>& model);

/// Resets the state to a tree that FCL has built, whose volumes our fitter made.
template <typename BV>
void startFromBuild(const UpdateTarget<BV>& target, UpdateState<BV>& state);

/// Repairs a tree that was changed or built without our update: recomputes every volume and resets
/// the update's state. Does nothing if the change detector matches. Querying threads may call it
/// concurrently. Returns whether there was a change.
template <typename BV>
bool repairIfChanged(const UpdateTarget<BV>& target, UpdateState<BV>& state);

}  // namespace adaptive_bvh
