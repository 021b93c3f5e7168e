#include "update/box_propagation.h"

#include "update/sweep.h"
#include "volume/rss.h"

namespace adaptive_bvh {
namespace {

/// By how much a node moved: all its vertices by `center`, give or take `spread`.
struct Motion {
  Lanes center;
  float spread;
  float largest;  ///< no vertex moved farther
};

/// Rounded up. A staged displacement is off by 2u of itself, u = 2^-24, so by 2u (|c| + h) in the
/// sum over components, and the difference, sum and root below by 4u relative.
Motion motionOf(const Box& box) {
  constexpr float kUp = 1 + 1.f / (1 << 20), kError = 1.f / (1 << 22);
  Motion motion;
  motion.center = (box.low + box.high) * 0.5f;
  const Lanes half = (box.high - box.low) * 0.5f;
  const Lanes farthest = box.low.abs().max(box.high.abs());
  const float slack = kError * sumOf(farthest);
  motion.spread = std::sqrt(sumOf(half * half)) * kUp + slack;
  motion.largest = std::sqrt(sumOf(farthest * farthest)) * kUp + slack;
  return motion;
}

template <typename BV>
class Rule {
 public:
  using S = typename BV::S;

  Rule(fcl::BVHModel<BV>& model, const Topology& topology, Boxes<S>& boxes)
      : nodes_(&model.getBV(0)),
        topology_(topology),
        boxes_(boxes),
        unit_(1 / boxes.frame.scale()),
        previous_(model.prev_vertices) {}

  Swept leaf(int node) const {
    const auto& [a, b, c] = topology_.corners[static_cast<std::size_t>(topology_.place(node))];
    Swept swept{{boxes_.positionOf(a), boxes_.positionOf(a)},
                {boxes_.motionOf(a), boxes_.motionOf(a)}};
    for (unsigned v : {b, c}) {
      swept.box.add(boxes_.positionOf(v));
      swept.motion.add(boxes_.motionOf(v));
    }
    if (previous_) {  // the volume must hold both frames: no vertex moved, or each did
      for (unsigned v : {a, b, c}) swept.box.add(boxes_.frame.place(previous_[v]));
      swept.motion.add(Lanes::Zero());
    }
    return swept;
  }

  static void merge(Swept& a, const Swept& b) {
    a.box.add(b.box);
    a.motion.add(b.motion);
  }

  void apply(int i, const Swept& swept) {
    NodeBounds& bounds = boxes_[i];
    const float travel = bounds.travel, inflation = bounds.inflation;
    bounds.setBox(swept.box);
    const Motion motion = motionOf(swept.motion);
    if (!(motion.largest > 0)) return;
    BV& bv = nodes_[i].bv;
    const S spread = Volume<BV>::move(
        bv, motion.center.head<3>().matrix().template cast<S>() * unit_, S(motion.spread) * unit_);
    bounds.travel = (travel + motion.largest) * (1 + 1.f / (1 << 22));
    bounds.inflation = inflation + float(spread * boxes_.frame.scale());
    ++changed_;
  }

  int changed() const { return changed_; }

 private:
  fcl::BVNode<BV>* nodes_;
  const Topology& topology_;
  Boxes<S>& boxes_;
  S unit_;
  const fcl::Vector3<S>* previous_;
  int changed_ = 0;
};

}  // namespace

template <typename BV>
int propagateByBoxes(fcl::BVHModel<BV>& model, const Topology& topology,
                     Boxes<typename BV::S>& boxes) {
  Rule<BV> rule(model, topology, boxes);
  sweep(topology, boxes.pending, rule);
  return rule.changed();
}

#define ADAPTIVE_BVH_INSTANTIATE(S) \
  template int propagateByBoxes(fcl::BVHModel<fcl::RSS<S>>&, const Topology&, Boxes<S>&);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
