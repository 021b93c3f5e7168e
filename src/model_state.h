#pragma once

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "tree/adaptive_tree.h"
#include "update/step.h"
#include "update/step_buffer.h"

namespace adaptive_bvh {

/// All that a model holds beyond FCL's.
template <typename BV>
struct AdaptiveBVHModel<BV>::State {
  RefitPolicy policy;
  AdaptiveTree<BV> tree;
  UpdateState<BV> update;
  StepBuffer<S> buffer;
  UpdateReport report;
};

namespace detail {

/// The library's own way to the state of a model.
template <typename BV>
struct ModelAccess {
  static const AdaptiveTree<BV>& tree(const AdaptiveBVHModel<BV>& model) {
    return model.state_->tree;
  }
  static void updateBoxes(const AdaptiveBVHModel<BV>& model) {
    auto& state = *model.state_;
    state.tree.demand.askForBoxTree();
    adaptive_bvh::updateBoxes<BV>({const_cast<AdaptiveBVHModel<BV>&>(model), state.tree},
                                  state.update, state.policy);
  }
  /// getNodeType for a query by boxes: volumes that wait are left alone.
  static fcl::NODE_TYPE repairedType(const AdaptiveBVHModel<BV>& model) {
    model.repair();
    model.state_->tree.demand.askForPositions();
    return model.typeOfModel();
  }
};

}  // namespace detail
}  // namespace adaptive_bvh
