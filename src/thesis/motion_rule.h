#pragma once

#include <algorithm>
#include <vector>

#include "thesis/refit.h"
#include "thesis/vertex_leaf_map.h"
#include "thesis/vertex_states.h"

// The work of TranslationPropagation at each node of its post-order traversal (post_order.h): the
// arithmetic of docs/bounds.md, 3, and the choice of visited nodes.
namespace adaptive_bvh {

/// The motions of a step, by reference, for the traversal's rule.
template <typename S>
struct Motions {
  const VertexState* states;
  const bool two_frames;
  const S unit;  ///< body unit of the motions
  const fcl::Vector3<S> common;
};

/// A subtree: its pairs of siblings are a contiguous range.
struct Subtree {
  int root;
  int first_pair, last_pair;  ///< left siblings
  Box motion;                 ///< motion of the root, set after the subtree is traversed
};

/// The rule of the traversal. Its values are bounding boxes of VertexState::motion over all
/// vertices below a node. Reads and writes plain arrays. (Eight lanes with AVX2 took 4.5 ns per
/// node instead of 5.1 on the thesis's scenarios with 16 times the triangles, and gained nothing
/// with 64 times.)
///
/// With `kMarks`, marks the candidates for a refit.
template <typename BV, bool kMarks>
class MotionRule {
 public:
  using S = typename BV::S;

  MotionRule(const UpdateTarget<BV>& target, const Motions<S>& motions, const RefitPolicy& policy,
             Candidates& candidates)
      : fcl_nodes_(&target.model.getBV(0)),
        topology_(target.tree.topology),
        motions_(motions),
        inflations_(target.tree.inflations.data()),
        has_common_motion_(!motions.common.isZero(0)),
        unit_(motions.unit),
        rounding_(target.tree.inflations.roundingOfMove()),
        least_inflation_(leastInflation(target, unit_)),
        side_share_(policy.reference == InflationReference::NodeSize ? S(0.5) : S(0)),
        least_factor_(S(leastUnfitFactor(policy)) * kBelow),
        marks_(candidates) {}

  ADAPTIVE_BVH_INLINE bool isLeaf(int node) const { return topology_.isLeaf(node); }

  /// A node that is not traversed has motion 0.
  ADAPTIVE_BVH_INLINE static void known(int, Box& motion) {
    motion = {float4::all(0), float4::all(0)};
  }

  ADAPTIVE_BVH_INLINE void leaf(int node, Box& motion) const {
    const auto leaf = static_cast<std::size_t>(topology_.leafIndex(node));
    const VertexIndices slots = topology_.slots.slotsOf(leaf);
    motion.low = motion.high = float4::load(motions_.states[slots[0]].motion);
    for (int k = 1; k < 3; ++k) motion.add(float4::load(motions_.states[slots[k]].motion));
    // The volume must also enclose the previous positions, which have motion 0.
    if (motions_.two_frames) motion.add(float4::all(0));
  }

  ADAPTIVE_BVH_INLINE static void merge(Box& a, const Box& b) { a.add(b); }

  ADAPTIVE_BVH_INLINE void apply(int left, const Box& a, const Box& b) {
    const int ahead = std::max(left - 16, 0);
    prefetch(ahead);
    prefetch(ahead + 1);
    const Float4 spreads = spreadsOf(a, b);
    if (spreads[0] + spreads[2] > 0 || has_common_motion_) {
      move(left, a, spreads[0]);
      move(left + 1, b, spreads[2]);
    }
    if constexpr (kMarks) marks_.mark(left, mayBeUnfit(left) | mayBeUnfit(left + 1) << 1);
  }

  ADAPTIVE_BVH_INLINE void applyRoot(const Box& root) {
    const float spread = spreadsOf(root, root)[0];
    if (spread > 0 || has_common_motion_) move(0, root, spread);
    if constexpr (kMarks) marks_.mark(-1, mayBeUnfit(0) << 1);
  }

  PropagationCounts counts() const { return counts_; }

 private:
  /// The rounding error of positions, in body units: a radius that grows by no more does not count
  /// as inflated.
  static float leastInflation(const UpdateTarget<BV>& target, S unit) {
    const fcl::AABB<S>& box = target.model.aabb_local;
    const S farthest = box.min_.cwiseAbs().sum() + box.max_.cwiseAbs().sum();
    return float(4 * rounding::epsilon<S>() * (farthest + target.tree.inflations.coordinateSum()) /
                 unit);
  }

  /// Prefetches the parts of FCL's node that the traversal needs, which are on two cache lines.
  /// Saves 10 to 15 % of the traversal.
  ADAPTIVE_BVH_INLINE void prefetch(int node) const { Volume<BV>::prefetch(fcl_nodes_[node].bv); }

  /// Half the diagonals of two siblings' motions, in lanes 0 and 2; 0 if nothing moves.
  ///
  /// Rounded up: let u = 2^-24. A motion of VertexState has a relative error of 2u, hence at most
  /// 2u of the largest motion; differences, squares, sums and roots here have a relative error
  /// below 8u. If anything moves, `kFloor` covers underflow: components of motions below
  /// ScaledFrame::kLeast (sqrt(3) 2^-59) and squares below the smallest float (sqrt(3) 2^-63).
  ADAPTIVE_BVH_INLINE static Float4 spreadsOf(const Box& a, const Box& b) {
    const Float4 half = float4::all(0.5f);
    constexpr float kState = 1.f / (1 << 22), kFloor = 1.f / (1ull << 58);
    const Float4 half_a = (a.high - a.low) * half, half_b = (b.high - b.low) * half;
    const Float4 far_a = float4::upper(-a.low, a.high), far_b = float4::upper(-b.low, b.high);
    const Float4 lengths = float4::squareRoot(float4::sums(half_a * half_a, far_a * far_a,
                                                           half_b * half_b, far_b * far_b)) *
                           float4::all(kUp);
    const Float4 far{lengths[1], lengths[1], lengths[3], lengths[3]};
    return lengths + far * float4::all(kState) +
           (far > float4::all(0) ? float4::all(kFloor) : float4::all(0));
  }

  /// Moves FCL's volume by the centre of the motions and increases its radius by their spread.
  ADAPTIVE_BVH_INLINE void move(int node, const Box& motion, float spread) {
    inflations_[node] = (inflations_[node] + spread) * kUp;
    const Float4 middle = (motion.low + motion.high) * float4::all(0.5f);
    const fcl::Vector3<S> translation(motions_.common[0] + S(middle[0]) * unit_,
                                      motions_.common[1] + S(middle[1]) * unit_,
                                      motions_.common[2] + S(middle[2]) * unit_);
    Volume<BV>::move(fcl_nodes_[node].bv, translation, S(spread) * unit_ + rounding_);
    ++counts_.moved;
    const Float4 sides = motion.high - motion.low;  // compared without calling std::fmax
    counts_.inflated += std::max(std::max(sides[0], sides[1]), sides[2]) > least_inflation_;
  }

  /// Returns 1 if inflation > least (original radius + smallest side / 2) is possible, else 0. Uses
  /// a slightly lower threshold, because the fitness test uses other operations; its reference is
  /// never shorter than this one.
  ADAPTIVE_BVH_INLINE Candidates::Word mayBeUnfit(int node) const {
    const BV& bv = fcl_nodes_[node].bv;
    const S inflation = S(inflations_[node]) * unit_;
    const S reference =
        Volume<BV>::radius(bv) - inflation + Volume<BV>::smallestSide(bv) * side_share_;
    return !(inflation <= least_factor_ * reference);
  }

  static constexpr S kBelow = S(0.999);
  static constexpr float kUp = 1 + 1.f / (1 << 20);  ///< rounds a sum up

  fcl::BVNode<BV>* const fcl_nodes_;
  const Topology& topology_;
  const Motions<S> motions_;
  float* const inflations_;
  const bool has_common_motion_;
  const S unit_, rounding_;
  const float least_inflation_;
  const S side_share_, least_factor_;
  Candidates::Marks marks_;
  PropagationCounts counts_;
};

/// Visits all pairs of a range, from the last to the first.
template <typename BV, bool kMarks>
class RangeRule : public MotionRule<BV, kMarks> {
 public:
  RangeRule(const UpdateTarget<BV>& target, const Motions<typename BV::S>& motions,
            const RefitPolicy& policy, Candidates& candidates, int first, int last)
      : MotionRule<BV, kMarks>(target, motions, policy, candidates),
        end_(first - 2),
        left_(last + 2) {}

  ADAPTIVE_BVH_INLINE int nextPair() {
    left_ -= 2;
    return left_ != end_ ? left_ : 0;
  }
  ADAPTIVE_BVH_INLINE static bool isTraversed(int) { return true; }

 private:
  const int end_;
  int left_;
};

/// Visits all pairs outside some subtrees.
template <typename BV, bool kMarks>
class AboveRule : public MotionRule<BV, kMarks> {
 public:
  AboveRule(const UpdateTarget<BV>& target, const Motions<typename BV::S>& motions,
            const RefitPolicy& policy, Candidates& candidates, const std::vector<Subtree>& subtrees)
      : MotionRule<BV, kMarks>(target, motions, policy, candidates),
        next_(subtrees.begin()),
        end_(subtrees.end()),
        subtrees_(subtrees),
        left_(target.nodes()) {}

  int nextPair() {
    left_ -= 2;
    for (; next_ != end_ && left_ == next_->last_pair; ++next_) left_ = next_->first_pair - 2;
    return left_;
  }
  bool isTraversed(int node) const { return !find(node); }
  void known(int node, Box& motion) const { motion = find(node)->motion; }

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

/// Visits all dirty pairs.
template <typename BV>
class DirtyRule : public MotionRule<BV, false> {
 public:
  DirtyRule(const UpdateTarget<BV>& target, const Motions<typename BV::S>& motions,
            const RefitPolicy& policy, Candidates& candidates, const DirtyPairs& dirty)
      : MotionRule<BV, false>(target, motions, policy, candidates),
        topology_(target.tree.topology),
        dirty_(dirty),
        left_(target.nodes()) {}

  int nextPair() { return left_ = dirty_.before(left_); }
  bool isTraversed(int node) const { return dirty_.isDirty(topology_.left(node)); }

 private:
  const Topology& topology_;
  const DirtyPairs& dirty_;
  int left_;
};

}  // namespace adaptive_bvh
