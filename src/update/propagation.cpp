#include "update/propagation.h"

#include <algorithm>

namespace adaptive_bvh {

template <typename BV>
int propagate(fcl::BVHModel<BV>& model, Tracking<BV>& tracking, bool leaf_radius_may_shrink) {
  using S = typename BV::S;
  int changed = 0;
  for (int i = model.getNumBVs() - 1; i >= 0; --i) {  // children before parents
    fcl::BVNode<BV>& node = model.getBV(i);
    const S current = Volume<BV>::radius(node.bv);
    S& motion = tracking.motion[i];
    S inflated;
    if (node.isLeaf()) {
      const int primitive = node.primitiveId();
      motion = tracking.latest[primitive];
      if (motion == 0) continue;
      inflated = rounding::sum(tracking.original_radius[i], tracking.overall[primitive]);
      if (!leaf_radius_may_shrink) inflated = std::max(current, inflated);
    } else {
      motion = std::max(tracking.motion[node.leftChild()], tracking.motion[node.rightChild()]);
      inflated = rounding::sum(current, motion);
    }
    if (inflated == current) continue;
    Volume<BV>::setRadius(node.bv, inflated);
    ++changed;
  }
  return changed;
}

template int propagate(fcl::BVHModel<fcl::RSS<float>>&, Tracking<fcl::RSS<float>>&, bool);
template int propagate(fcl::BVHModel<fcl::RSS<double>>&, Tracking<fcl::RSS<double>>&, bool);

}  // namespace adaptive_bvh
