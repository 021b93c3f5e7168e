#pragma once

#include <set>
#include <vector>

#include <fcl/geometry/bvh/BVH_model.h>

namespace adaptive_bvh_test {

/// The tree as the sets of triangles below its nodes: what matters, whichever child is the left
/// one.
template <typename BV>
std::set<std::set<int>> groupsOf(const fcl::BVHModel<BV>& model) {
  std::set<std::set<int>> groups;
  std::vector<std::set<int>> below(std::size_t(model.getNumBVs()));
  for (int i = model.getNumBVs() - 1; i >= 0; --i) {
    const auto& node = model.getBV(i);
    auto& group = below[std::size_t(i)];
    if (node.isLeaf()) {
      group.insert(node.primitiveId());
    } else {
      for (int child : {node.leftChild(), node.rightChild()})
        group.insert(below[std::size_t(child)].begin(), below[std::size_t(child)].end());
    }
    groups.insert(group);
  }
  return groups;
}

}  // namespace adaptive_bvh_test
