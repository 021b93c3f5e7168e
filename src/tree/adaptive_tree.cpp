#include "tree/adaptive_tree.h"

namespace adaptive_bvh {

template <typename BV>
void AdaptiveTree<BV>::adopt(const fcl::BVHModel<BV>& model) {
  topology.adopt(model);
  evidence.reset(model.getNumBVs());
  displacements.reset();
  if (propagation == Propagation::Displacements) {
    boxes.reset();
    displacements.emplace().adopt(model);
  } else {
    if (!boxes) boxes.emplace();
    boxes->resize(model.getNumBVs(), model.num_vertices, topology.depth);
  }
}

template <typename BV>
void AdaptiveTree<BV>::refitted(const fcl::BVHModel<BV>& model, int i) {
  const fcl::BVNode<BV>& node = model.getBV(i);
  if (boxes) {
    (*boxes)[i].inflation = 0;
    return;
  }
  displacements->original_radius[static_cast<std::size_t>(i)] = Volume<BV>::radius(node.bv);
  if (node.isLeaf())
    displacements->resetPrimitive(viewOf(model), static_cast<unsigned>(node.primitiveId()));
}

template struct AdaptiveTree<fcl::RSS<float>>;
template struct AdaptiveTree<fcl::RSS<double>>;

}  // namespace adaptive_bvh
