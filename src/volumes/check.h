#pragma once

#include <string>

#include <fcl/geometry/bvh/BVH_model.h>

namespace adaptive_bvh {

/// The links of the tree and the invariant, see AdaptiveBVHModel::validate. Judges the nodes as
/// they stand, by nothing but FCL's own data.
template <typename BV>
bool checkTree(const fcl::BVHModel<BV>& model, std::string* reason);

}  // namespace adaptive_bvh
