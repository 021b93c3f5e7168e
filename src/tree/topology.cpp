#include "tree/topology.h"

#include <algorithm>
#include <vector>

namespace adaptive_bvh {

template <typename BV>
void Topology::adopt(const fcl::BVHModel<BV>& model) {
  const auto nodes = static_cast<std::size_t>(model.getNumBVs());
  slots.adopt(model);
  depth = 0;
  std::vector<int> depth_of(nodes, 0);
  for (int i = 0; i < model.getNumBVs(); ++i) {
    const fcl::BVNode<BV>& node = model.getBV(i);
    depth = std::max(depth, depth_of[i]);
    if (node.isLeaf()) continue;
    for (int child : {node.leftChild(), node.rightChild()}) depth_of[child] = depth_of[i] + 1;
  }
}

template void Topology::adopt(const fcl::BVHModel<fcl::RSS<float>>&);
template void Topology::adopt(const fcl::BVHModel<fcl::RSS<double>>&);

}  // namespace adaptive_bvh
