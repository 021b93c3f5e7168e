#include "tree/topology.h"

#include <algorithm>

namespace adaptive_bvh {

template <typename BV>
void Topology::adopt(const fcl::BVHModel<BV>& model) {
  const auto nodes = static_cast<std::size_t>(model.getNumBVs());
  const std::size_t primitives = (nodes + 1) / 2;  // a binary tree with one leaf a primitive
  const auto mesh = viewOf(model);
  link.resize(nodes);
  order.resize(primitives);
  corners.resize(primitives);

  depth = 0;
  std::vector<int> depth_of(nodes, 0);
  for (int i = 0; i < model.getNumBVs(); ++i) {
    const fcl::BVNode<BV>& node = model.getBV(i);
    if (node.isLeaf()) {
      const auto primitive = static_cast<unsigned>(node.primitiveId());
      const auto place = static_cast<std::size_t>(node.first_primitive);
      link[i] = ~node.first_primitive;
      order[place] = primitive;
      for (int k = 0; k < 3; ++k)
        corners[place][k] = mesh.vertex(primitive, k % mesh.verticesPerPrimitive());
    } else {
      link[i] = node.leftChild();
      for (int child : {node.leftChild(), node.rightChild()}) depth_of[child] = depth_of[i] + 1;
    }
    depth = std::max(depth, depth_of[i]);
  }
}

std::size_t Topology::bytes() const {
  const auto size = [](const auto& v) { return v.capacity() * sizeof(v[0]); };
  return size(link) + size(order) + size(corners);
}

template void Topology::adopt(const fcl::BVHModel<fcl::RSS<float>>&);
template void Topology::adopt(const fcl::BVHModel<fcl::RSS<double>>&);

}  // namespace adaptive_bvh
