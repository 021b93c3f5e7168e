#include "update/propagation.h"

#include <algorithm>

#include "update/sweep.h"

namespace adaptive_bvh {
namespace {

/// The equations of thesis 4.3; the value handed up is D_latest.
template <typename BV>
struct DisplacementRule {
  using S = typename BV::S;

  S leaf(int i) const { return tracking.latest[primitive(i)]; }

  static void merge(S& left, S right) { left = std::max(left, right); }

  void apply(int i, S latest) {
    BV& bv = model.getBV(i).bv;
    const S current = Volume<BV>::radius(bv);
    S inflated = rounding::sum(current, latest);
    if (topology.isLeaf(i) && latest > 0) {
      inflated = rounding::sum(tracking.original_radius[i], tracking.overall[primitive(i)]);
      if (!leaf_radius_may_shrink) inflated = std::max(current, inflated);
    }
    if (inflated == current) return;
    Volume<BV>::setRadius(bv, inflated);
    ++changed;
  }

  unsigned primitive(int leaf) const { return topology.order[topology.place(leaf)]; }

  fcl::BVHModel<BV>& model;
  const Topology& topology;
  const Tracking<BV>& tracking;
  bool leaf_radius_may_shrink;
  int changed = 0;
};

}  // namespace

template <typename BV>
int propagate(fcl::BVHModel<BV>& model, const Topology& topology, Tracking<BV>& tracking,
              bool leaf_radius_may_shrink) {
  DisplacementRule<BV> rule{model, topology, tracking, leaf_radius_may_shrink};
  sweep(topology, tracking.pending, rule);
  return rule.changed;
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                            \
  template int propagate(fcl::BVHModel<fcl::RSS<S>>&, const Topology&, Tracking<fcl::RSS<S>>&, \
                         bool);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
