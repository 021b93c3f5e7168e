#include "volumes/adaptive_tree.h"

namespace adaptive_bvh {

template <typename BV>
void AdaptiveTree<BV>::adopt(const fcl::BVHModel<BV>& model) {
  ++adoptions;
  topology.adopt(model);
  statistics.reset(model.getNumBVs());
  refits.reset(model.getNumBVs());
}

template <typename BV>
void AdaptiveTree<BV>::restartCoordinateSum(const fcl::BVHModel<BV>& model) {
  inflations.restart();
  for (int i = 0; i < model.getNumBVs(); ++i)
    inflations.include(Volume<BV>::cornerSum(model.getBV(i).bv));
}

#define ADAPTIVE_BVH_INSTANTIATE(BV) template struct AdaptiveTree<BV>;
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
