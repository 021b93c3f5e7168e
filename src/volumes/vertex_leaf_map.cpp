#include "volumes/vertex_leaf_map.h"

#include "volumes/each_volume.h"

namespace adaptive_bvh {

template <typename BV>
void VertexLeafMap::adopt(const fcl::BVHModel<BV>& model, const Topology& topology) {
  const auto pairs = topology.slots.leaves() - 1;
  parent_.assign(pairs, 0);
  first_.assign(static_cast<std::size_t>(model.num_vertices) + 1, 0);
  leaf_.resize(3 * topology.slots.leaves());

  for (std::size_t leaf = 0; leaf < topology.slots.leaves(); ++leaf)
    for (unsigned v : topology.slots.verticesOf(leaf)) ++first_[v];
  int sum = 0;
  for (int& first : first_) first = sum += first;  // where the vertex's leaves end
  for (int i = 0; i < model.getNumBVs(); ++i) {
    const fcl::BVNode<BV>& node = model.getBV(i);
    if (!node.isLeaf()) {
      parent_[static_cast<std::size_t>(node.leftChild() - 1) / 2] = i;
      continue;
    }
    for (unsigned v : topology.slots.verticesOf(static_cast<std::size_t>(node.first_primitive)))
      leaf_[static_cast<std::size_t>(--first_[v])] = i;
  }
}

#define ADAPTIVE_BVH_INSTANTIATE(BV) \
  template void VertexLeafMap::adopt(const fcl::BVHModel<BV>&, const Topology&);
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
