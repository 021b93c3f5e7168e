#include "tree/adaptive_tree.h"

#include <algorithm>
#include <atomic>

namespace adaptive_bvh {

template <typename BV>
std::uint64_t AdaptiveTree<BV>::newGeneration() {
  static std::atomic<std::uint64_t> last{0};
  return last.fetch_add(1, std::memory_order_relaxed) + 1;
}

template <typename BV>
void AdaptiveTree<BV>::adopt(const fcl::BVHModel<BV>& model) {
  generation = newGeneration();
  topology.adopt(model);
  incidence.clear();
  evidence.reset(model.getNumBVs());
  displacements.reset();
  if (propagation == Propagation::Displacements) {
    boxes.reset();
    displacements.emplace().adopt(model, topology);
  } else {
    if (!boxes) boxes.emplace();
    boxes->adopt(model, topology);
  }
}

template <typename BV>
void AdaptiveTree<BV>::refitted(const fcl::BVHModel<BV>& model, int i) {
  const fcl::BVNode<BV>& node = model.getBV(i);
  if (boxes) {
    boxes->inflationOf(i) = 0;
    return;
  }
  displacements->original_radius[static_cast<std::size_t>(i)] = Volume<BV>::radius(node.bv);
  if (node.isLeaf())
    displacements->resetPrimitive(viewOf(model), static_cast<unsigned>(node.primitiveId()));
}

template <typename BV>
void AdaptiveTree<BV>::forgetTravel(const fcl::BVHModel<BV>& model) {
  generation = newGeneration();
  boxes->reach = 0;
  for (int i = 0; i < model.getNumBVs(); ++i) {
    boxes->travelOf(i) = 0;
    boxes->reach = std::max(boxes->reach, Volume<BV>::reach(model.getBV(i).bv));
  }
}

template struct AdaptiveTree<fcl::RSS<float>>;
template struct AdaptiveTree<fcl::RSS<double>>;

}  // namespace adaptive_bvh
