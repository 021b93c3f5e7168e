#pragma once

#include <optional>
#include <vector>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "volumes/adaptive_tree.h"
#include "volumes/step.h"
#include "volumes/step_buffer.h"

namespace adaptive_bvh {

/// All that a model holds beyond FCL's.
template <typename BV>
struct AdaptiveBVHModel<BV>::State {
  RefitPolicy policy;
  AdaptiveTree<BV> tree;
  UpdateState<BV> update;
  StepBuffer<S> buffer;
  UpdateReport report;
  std::optional<DeformableMesh<S>> mesh;  ///< made by the first call of `mesh`
  int mesh_adoption = 0;     ///< AdaptiveTree::adoptions when it was built: else it is out of date
  std::vector<Point> moved;  ///< of the last step of some vertices, for the mesh
};

namespace detail {

/// The library's own way to the state of a model.
template <typename BV>
struct ModelAccess {
  static const AdaptiveTree<BV>& tree(const AdaptiveBVHModel<BV>& model) {
    return model.state_->tree;
  }
};

}  // namespace detail
}  // namespace adaptive_bvh
