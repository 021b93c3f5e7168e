#include "update/refit.h"

namespace adaptive_bvh {

template <typename BV>
BV fitNode(const UpdateTarget<BV>& target, int node) {
  const fcl::BVNode<BV>& fcl_node = target.model.getBV(node);
  const auto first = static_cast<std::size_t>(fcl_node.first_primitive);
  return Volume<BV>::fit(viewOf(target.model), &target.tree.topology.leaf_vertices[first],
                         fcl_node.num_primitives);
}

template <typename BV>
BV refitAllButRoot(const UpdateTarget<BV>& target) {
  for (int i = 1; i < target.nodes(); ++i) target.volume(i) = fitNode(target, i);
  return fitNode(target, 0);
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                    \
  template fcl::RSS<S> fitNode(const UpdateTarget<fcl::RSS<S>>&, int); \
  template fcl::RSS<S> refitAllButRoot(const UpdateTarget<fcl::RSS<S>>&);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
