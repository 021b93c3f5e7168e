#include "tree/topology.h"

#include <algorithm>
#include <vector>

#include "volume/each_volume.h"

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

#define ADAPTIVE_BVH_INSTANTIATE(BV) template void Topology::adopt(const fcl::BVHModel<BV>&);
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
