#pragma once

#include <stdexcept>

#include "geometry/rigid.h"
#include "model_state.h"
#include "query/placed_mesh.h"

namespace adaptive_bvh {

template <typename S>
void requireDistance(S distance) {
  if (!(distance >= 0))
    throw std::invalid_argument("adaptive_bvh: a distance to ask for is negative or not a number");
}

/// Repairs a tree that was changed without our update. Throws where there is nothing to query.
template <typename BV>
void requireQueryable(const AdaptiveBVHModel<BV>& model) {
  detail::ModelAccess<BV>::repairedType(model);
  requireTriangles<BV>(model);
}

template <typename BV>
const AdaptiveTree<BV>& treeOf(const AdaptiveBVHModel<BV>& model) {
  return detail::ModelAccess<BV>::tree(model);
}

}  // namespace adaptive_bvh
