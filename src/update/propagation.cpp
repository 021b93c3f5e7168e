#include "update/propagation.h"

#include <algorithm>

#include "update/sweep.h"

namespace adaptive_bvh {
namespace {

/// The equations of thesis 4.3; the value handed up is D_latest.
template <typename BV>
struct DisplacementRule {
  using S = typename BV::S;

  int nextPair() { return left -= 2; }
  bool isLeaf(int i) const { return model.getBV(i).isLeaf(); }
  void leaf(int i, S& latest) const { latest = tracking.latest[primitive(i)]; }
  static bool isSwept(int) { return true; }
  static void known(int, S&) {}
  static void merge(S& a, S b) { a = std::max(a, b); }

  void apply(int first, S a, S b) {
    inflate(first, a);
    inflate(first + 1, b);
  }
  void applyRoot(S root) { inflate(0, root); }

  void inflate(int i, S latest) {
    BV& bv = model.getBV(i).bv;
    S& radius = Volume<BV>::radius(bv);
    const S current = radius;
    S inflated = rounding::sum(current, latest);
    if (isLeaf(i) && latest > 0) {
      inflated = rounding::sum(tracking.original_radius[i], tracking.overall[primitive(i)]);
      if (!leaf_radius_may_shrink) inflated = std::max(current, inflated);
    }
    if (inflated == current) return;
    radius = inflated;
    ++changed;
  }

  int primitive(int leaf) const { return model.getBV(leaf).primitiveId(); }

  fcl::BVHModel<BV>& model;
  const Tracking<BV>& tracking;
  bool leaf_radius_may_shrink;
  int left;  ///< of the siblings that the sweep is at
  int changed = 0;
};

}  // namespace

template <typename BV>
int propagate(fcl::BVHModel<BV>& model, Tracking<BV>& tracking, bool leaf_radius_may_shrink) {
  DisplacementRule<BV> rule{model, tracking, leaf_radius_may_shrink, model.getNumBVs()};
  sweep(tracking.pending.data(), rule);
  return rule.changed;
}

#define ADAPTIVE_BVH_INSTANTIATE(S) \
  template int propagate(fcl::BVHModel<fcl::RSS<S>>&, Tracking<fcl::RSS<S>>&, bool);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
