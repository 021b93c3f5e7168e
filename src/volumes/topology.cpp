#include "volumes/topology.h"

#include <algorithm>

#include "base/scratch.h"
#include "mesh/mesh_view.h"
#include "volumes/each_volume.h"

namespace adaptive_bvh {

template <typename BV>
void Topology::adopt(const fcl::BVHModel<BV>& model) {
  const auto nodes = static_cast<std::size_t>(model.getNumBVs());
  OrderedTree tree;
  tree.nodes.reserve(nodes);
  links.resize(nodes);
  tree.primitives.resize((nodes + 1) / 2);
  for (int i = 0; i < model.getNumBVs(); ++i) {
    const fcl::BVNode<BV>& node = model.getBV(i);
    const auto first = static_cast<unsigned>(node.first_primitive);
    tree.nodes.push_back({node.isLeaf() ? -1 : node.leftChild(),
                          node.isLeaf() ? -1 : node.rightChild(), first,
                          static_cast<unsigned>(node.num_primitives)});
    links[static_cast<std::size_t>(i)] = node.isLeaf() ? -1 - int(first) : node.leftChild();
    if (node.isLeaf()) tree.primitives[first] = static_cast<unsigned>(node.primitiveId());
  }
  slots.adopt(tree, viewOf(model), static_cast<std::size_t>(model.num_vertices));
  depth = 0;
  Scratch<int> depth_of(nodes, 0);
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
