#include "volumes/node_fit.h"

#include <vector>

#include "volumes/each_volume.h"

namespace adaptive_bvh {

template <typename BV>
BV fitNode(const UpdateTarget<BV>& target, int node) {
  const fcl::BVNode<BV>& fcl_node = target.model.getBV(node);
  static thread_local std::vector<VertexIndices> below;
  const auto first = static_cast<std::size_t>(fcl_node.first_primitive);
  below.resize(static_cast<std::size_t>(fcl_node.num_primitives));
  for (std::size_t i = 0; i < below.size(); ++i)
    below[i] = target.tree.topology.slots.verticesOf(first + i);
  return Volume<BV>::fit(viewOf(target.model), below.data(), fcl_node.num_primitives);
}

template <typename BV>
BV refitAllButRoot(const UpdateTarget<BV>& target) {
  for (int i = 1; i < target.nodes(); ++i) target.volume(i) = fitNode(target, i);
  return fitNode(target, 0);
}

#define ADAPTIVE_BVH_INSTANTIATE(BV)                 \
  template BV fitNode(const UpdateTarget<BV>&, int); \
  template BV refitAllButRoot(const UpdateTarget<BV>&);
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
