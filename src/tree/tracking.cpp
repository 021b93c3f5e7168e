#include "tree/tracking.h"

namespace adaptive_bvh {

template <typename BV>
void Tracking<BV>::adopt(const fcl::BVHModel<BV>& model, const Topology& topology) {
  const auto nodes = static_cast<std::size_t>(model.getNumBVs());
  const std::size_t primitives = (nodes + 1) / 2;  // a binary tree with one leaf a primitive
  const MeshView<S> mesh = viewOf(model);

  original_radius.resize(nodes);
  latest.assign(primitives, S(0));
  overall.resize(primitives);
  reference.resize(primitives);
  pending.resize(topology.stackPlaces());
  vertex_motion.assign(static_cast<std::size_t>(model.num_vertices), S(0));

  for (int i = 0; i < model.getNumBVs(); ++i) {
    const fcl::BVNode<BV>& node = model.getBV(i);
    original_radius[i] = Volume<BV>::radius(node.bv);
    if (!node.isLeaf()) continue;
    resetPrimitive(mesh, static_cast<unsigned>(node.primitiveId()));
  }
}

template <typename BV>
void Tracking<BV>::resetPrimitive(const MeshView<S>& mesh, unsigned primitive) {
  overall[primitive] = 0;
  for (int k = 0; k < mesh.verticesPerPrimitive(); ++k)
    reference[primitive][k] = mesh.vertices[mesh.vertex(primitive, k)];
}

template <typename BV>
std::size_t Tracking<BV>::bytes() const {
  const auto size = [](const auto& v) { return v.capacity() * sizeof(v[0]); };
  return size(original_radius) + size(latest) + size(overall) + size(reference) +
         size(vertex_motion) + size(pending);
}

template struct Tracking<fcl::RSS<float>>;
template struct Tracking<fcl::RSS<double>>;

}  // namespace adaptive_bvh
