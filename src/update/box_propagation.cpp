#include "update/box_propagation.h"

#include <algorithm>

#include "update/sweep.h"
#include "volume/rss.h"

namespace adaptive_bvh {
namespace {

/// The rule of the sweep. Works on what the sweep touches as plain arrays.
template <typename BV>
class BoxRule {
 public:
  using S = typename BV::S;

  BoxRule(fcl::BVHModel<BV>& model, const Topology& topology, Boxes<S>& boxes)
      : nodes_(&model.getBV(0)),
        corners_(topology.corners.data()),
        staged_(boxes.staged.data()),
        before_(model.prev_vertices ? boxes.before.data() : nullptr),
        box_(boxes.box.data() + 1),
        growth_(boxes.growth.data() + 2),
        common_(boxes.common),
        common_length_(lengthOf(boxes)),
        unit_(boxes.frame.unit()),
        rounding_(boxes.rounding()),
        least_inflation_(leastInflation(model, boxes)) {}

  ADAPTIVE_BVH_INLINE bool isLeaf(int node) const { return box_[node].isLeaf(); }

  ADAPTIVE_BVH_INLINE void known(int node, Swept& value) const {
    value.box = box_[node].box();
    value.motion = {lanes::all(0), lanes::all(0)};
  }

  ADAPTIVE_BVH_INLINE void leaf(int node, Swept& value) const {
    const Corners& corners = corners_[box_[node].leaf()];
    const StagedVertex& a = staged_[corners[0]];
    value.box.low = value.box.high = lanes::load(a.at);
    value.motion.low = value.motion.high = lanes::load(a.motion);
    for (int k = 1; k < 3; ++k) {
      const StagedVertex& b = staged_[corners[k]];
      value.box.add(lanes::load(b.at));
      value.motion.add(lanes::load(b.motion));
    }
    if (!before_) return;
    // No vertex moved, or each did: the volume must hold both frames.
    for (unsigned v : corners) value.box.add(lanes::load(before_[v].data()));
    value.motion.add(lanes::all(0));
  }

  ADAPTIVE_BVH_INLINE static void merge(Swept& a, const Swept& b) {
    a.box.add(b.box);
    a.motion.add(b.motion);
  }

  ADAPTIVE_BVH_INLINE void apply(int left, const Swept& a, const Swept& b) {
    const int ahead = std::max(left - 16, 0);
    prefetch(ahead);
    prefetch(ahead + 1);
    const Lanes lengths = grow(left, a.motion, b.motion);
    if (lengths[0] + lengths[2] + common_length_ > 0) {  // else nothing moved
      move(left, a.motion, lengths[0]);
      move(left + 1, b.motion, lengths[2]);
    }
    box_[left].setBox(a.box);
    box_[left + 1].setBox(b.box);
  }

  /// As the right one of two siblings without a left one; the tables have room for that.
  ADAPTIVE_BVH_INLINE void applyRoot(const Swept& root) {
    const Lanes lengths = grow(-1, root.motion, root.motion);
    if (lengths[2] + common_length_ > 0) move(0, root.motion, lengths[2]);
    box_[0].setBox(root.box);
  }

  Propagated result() const { return result_; }

 private:
  /// In body units, rounded up.
  static float lengthOf(const Boxes<S>& boxes) {
    const S length = rounding::norm<S>(boxes.common);
    return length > 0
               ? float(length * boxes.frame.scale()) * (1 + 1.f / (1 << 20)) + BodyFrame<S>::kLeast
               : 0.f;
  }

  /// What positions may be rounded to, in body units: a radius that grows by no more is not counted
  /// as inflated.
  static float leastInflation(const fcl::BVHModel<BV>& model, const Boxes<S>& boxes) {
    const S farthest =
        model.aabb_local.min_.cwiseAbs().sum() + model.aabb_local.max_.cwiseAbs().sum();
    return float(4 * rounding::epsilon<S>() * (farthest + boxes.reach) * boxes.frame.scale());
  }

  /// FCL's nodes are large: what the sweep needs of one lies on two cache lines.
  ADAPTIVE_BVH_INLINE void prefetch(int node) const {
    __builtin_prefetch(Volume<BV>::corner(nodes_[node].bv), 1);
    __builtin_prefetch(&Volume<BV>::radius(nodes_[node].bv), 1);
  }

  /// Adds to the growths of two siblings. Returns half the diagonal of the first's motions and the
  /// farthest of them, then the same of the second. Both are what is left beyond the common
  /// translation, which `travel` gets in addition.
  ///
  /// Rounded up: let u = 2^-24. A staged motion is off by 2u of itself, hence by 2u of the
  /// farthest; differences, squares, sums and roots here are off by less than 8u relative. Where
  /// anything moves, `kFloor` covers what is too small for that: the components of motions below
  /// BodyFrame::kLeast (sqrt(3) 2^-59) and squares below the smallest float (sqrt(3) 2^-63).
  ADAPTIVE_BVH_INLINE Lanes grow(int left, const Box& a, const Box& b) const {
    const Lanes up = lanes::all(1 + 1.f / (1 << 20)), half = lanes::all(0.5f);
    constexpr float kStaged = 1.f / (1 << 22), kFloor = 1.f / (1ull << 58);
    const Lanes half_a = (a.high - a.low) * half, half_b = (b.high - b.low) * half;
    const Lanes far_a = lanes::upper(-a.low, a.high), far_b = lanes::upper(-b.low, b.high);
    Lanes lengths = lanes::squareRoot(lanes::sums(half_a * half_a, far_a * far_a, half_b * half_b,
                                                  far_b * far_b)) *
                    up;
    const Lanes far{lengths[1], lengths[1], lengths[3], lengths[3]};
    lengths += far * Lanes{kStaged, 0, kStaged, 0} +
               (far > lanes::all(0) ? lanes::all(kFloor) : lanes::all(0));
    float* const growth = growth_ + 2 * left;  // of both: inflation, travel, and again
    const Lanes common{0, common_length_, 0, common_length_};
    lanes::store((lanes::load(growth) + lengths + common) * up, growth);
    return lengths;
  }

  /// Moves FCL's volume by the middle of the motions and lets its radius grow by their spread.
  ADAPTIVE_BVH_INLINE void move(int node, const Box& motion, float spread) {
    const Lanes middle = (motion.low + motion.high) * lanes::all(0.5f);
    BV& bv = nodes_[node].bv;
    S* const corner = Volume<BV>::corner(bv);
    for (int k = 0; k < 3; ++k) corner[k] += common_[k] + S(middle[k]) * unit_;
    Volume<BV>::radius(bv) += S(spread) * unit_ + rounding_;
    ++result_.moved;
    result_.inflated += lanes::largest(motion.high - motion.low) > least_inflation_;
  }

  fcl::BVNode<BV>* const nodes_;
  const Corners* const corners_;
  const StagedVertex* const staged_;
  const std::array<float, 4>* const before_;
  NodeBox* const box_;
  float* const growth_;
  const fcl::Vector3<S> common_;
  const float common_length_;
  const S unit_, rounding_;
  const float least_inflation_;
  Propagated result_;
};

/// All pairs from the last to the first of a range.
template <typename BV>
class Range : public BoxRule<BV> {
 public:
  Range(fcl::BVHModel<BV>& model, const Topology& topology, Boxes<typename BV::S>& boxes, int first,
        int last)
      : BoxRule<BV>(model, topology, boxes), end_(first - 2), left_(last + 2) {}

  ADAPTIVE_BVH_INLINE int nextPair() {
    left_ -= 2;
    return left_ != end_ ? left_ : 0;
  }
  ADAPTIVE_BVH_INLINE static bool isSwept(int) { return true; }

 private:
  const int end_;
  int left_;
};

/// All pairs that are in none of some subtrees.
template <typename BV>
class Above : public BoxRule<BV> {
 public:
  Above(fcl::BVHModel<BV>& model, const Topology& topology, Boxes<typename BV::S>& boxes,
        const std::vector<Subtree>& subtrees)
      : BoxRule<BV>(model, topology, boxes),
        next_(subtrees.begin()),
        end_(subtrees.end()),
        subtrees_(subtrees),
        left_(model.getNumBVs()) {}

  int nextPair() {
    left_ -= 2;
    for (; next_ != end_ && left_ == next_->last_pair; ++next_) left_ = next_->first_pair - 2;
    return left_;
  }
  bool isSwept(int node) const { return !find(node); }
  void known(int node, Swept& value) const { value = find(node)->value; }

 private:
  const Subtree* find(int node) const {
    for (const Subtree& subtree : subtrees_)
      if (subtree.root == node) return &subtree;
    return nullptr;
  }

  typename std::vector<Subtree>::const_iterator next_, end_;
  const std::vector<Subtree>& subtrees_;
  int left_;
};

/// Those that are marked.
template <typename BV>
class MarkedPart : public BoxRule<BV> {
 public:
  MarkedPart(fcl::BVHModel<BV>& model, const Topology& topology, const Incidence& incidence,
             Boxes<typename BV::S>& boxes)
      : BoxRule<BV>(model, topology, boxes),
        boxes_(boxes),
        incidence_(incidence),
        left_(model.getNumBVs()) {}

  int nextPair() { return left_ = incidence_.markedBefore(left_); }
  bool isSwept(int node) const { return incidence_.isMarked(boxes_[node].left()); }

 private:
  const Boxes<typename BV::S>& boxes_;
  const Incidence& incidence_;
  int left_;
};

}  // namespace

template <typename BV>
Propagated propagateByBoxes(fcl::BVHModel<BV>& model, const Topology& topology,
                            Boxes<typename BV::S>& boxes) {
  Range<BV> rule(model, topology, boxes, 1, model.getNumBVs() - 2);
  sweep(boxes.pending.data(), rule);
  return rule.result();
}

template <typename BV>
std::vector<Subtree> subtreesOf(const fcl::BVHModel<BV>& model, int count) {
  std::vector<Subtree> subtrees;
  const int most = std::max(2, model.getBV(0).num_primitives / count);
  std::vector<int> open = {0};
  while (!open.empty()) {
    const int i = open.back();
    open.pop_back();
    const fcl::BVNode<BV>& node = model.getBV(i);
    if (node.isLeaf()) continue;
    if (i > 0 && node.num_primitives <= most) {
      const int pairs = node.num_primitives - 1;
      subtrees.push_back({i, node.leftChild(), node.leftChild() + 2 * (pairs - 1), Swept()});
    } else {
      open.push_back(node.leftChild());
      open.push_back(node.rightChild());  // comes off first: later pairs before earlier ones
    }
  }
  return subtrees;
}

template <typename BV>
Propagated propagateWithin(fcl::BVHModel<BV>& model, const Topology& topology,
                           Boxes<typename BV::S>& boxes, Subtree& subtree, Swept* stack) {
  Range<BV> rule(model, topology, boxes, subtree.first_pair, subtree.last_pair);
  sweepPairs(stack, rule);
  subtree.value = *--stack;
  return rule.result();
}

template <typename BV>
Propagated propagateAbove(fcl::BVHModel<BV>& model, const Topology& topology,
                          Boxes<typename BV::S>& boxes, const std::vector<Subtree>& subtrees) {
  Above<BV> rule(model, topology, boxes, subtrees);
  sweep(boxes.pending.data(), rule);
  return rule.result();
}

template <typename BV>
Propagated propagateByBoxes(fcl::BVHModel<BV>& model, const Topology& topology,
                            const Incidence& incidence, Boxes<typename BV::S>& boxes) {
  MarkedPart<BV> rule(model, topology, incidence, boxes);
  sweep(boxes.pending.data(), rule);
  return rule.result();
}

#define ADAPTIVE_BVH_INSTANTIATE(S)                                                              \
  template Propagated propagateByBoxes(fcl::BVHModel<fcl::RSS<S>>&, const Topology&, Boxes<S>&); \
  template Propagated propagateByBoxes(fcl::BVHModel<fcl::RSS<S>>&, const Topology&,             \
                                       const Incidence&, Boxes<S>&);                             \
  template std::vector<Subtree> subtreesOf(const fcl::BVHModel<fcl::RSS<S>>&, int);              \
  template Propagated propagateWithin(fcl::BVHModel<fcl::RSS<S>>&, const Topology&, Boxes<S>&,   \
                                      Subtree&, Swept*);                                         \
  template Propagated propagateAbove(fcl::BVHModel<fcl::RSS<S>>&, const Topology&, Boxes<S>&,    \
                                     const std::vector<Subtree>&);
ADAPTIVE_BVH_INSTANTIATE(float)
ADAPTIVE_BVH_INSTANTIATE(double)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
