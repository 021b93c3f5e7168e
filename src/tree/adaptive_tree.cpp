#include "tree/adaptive_tree.h"

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
  topology_number = newGeneration();
  setMoved();
  topology.adopt(model);
  statistics.reset(model.getNumBVs());
  refits.reset(model.getNumBVs());
}

template <typename BV>
void AdaptiveTree<BV>::restartMotion(const fcl::BVHModel<BV>& model) {
  generation = newGeneration();
  motion.restart();
  for (int i = 0; i < model.getNumBVs(); ++i)
    motion.include(Volume<BV>::cornerSum(model.getBV(i).bv));
}

#define ADAPTIVE_BVH_INSTANTIATE(BV) template struct AdaptiveTree<BV>;
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
