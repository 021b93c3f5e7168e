#pragma once

#include <algorithm>
#include <vector>

#include "thesis/refit.h"
#include "thesis/vertex_states.h"

// The rules of TranslationPropagation's post-order traversal (post_order.h): what is done at each
// node (MotionRule, the arithmetic of docs/bounds.md, 3), and which nodes are traversed (RangeRule,
// AboveRule, DirtyRule).
namespace adaptive_bvh {

/// The motions of a step.
template <typename S>
struct Motions {
  const VertexState* states;  ///< by slot
  const bool two_frames;
  const S unit;                  ///< the mesh's units per unit of VertexState::motion
  const fcl::Vector3<S> common;  ///< translation that VertexState::motion leaves out
};

/// A subtree: its pairs of siblings are a contiguous range.
struct Subtree {
  int root;
  int first_pair, last_pair;  ///< left siblings
  Box motion;                 ///< motion of the root, set after the subtree is traversed
};

/// What is done at each node. The value of a node is the bounding box of VertexState::motion over
/// all vertices below it. (Eight lanes with AVX2 took 4.5 ns per node instead of 5.1 on the
/// thesis's scenarios with 16 times the triangles, and gained nothing with 64 times.)
///
/// With `kMarks`, sets the flag of each node in `candidates`: whether it may be unfit.
template <typename BV, bool kMarks>
class MotionRule {
 public:
  using S = typename BV::S;

  MotionRule(const UpdateTarget<BV>& target, const Motions<S>& motions, const RefitPolicy& policy,
             MayBeUnfit* candidates)
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
        candidates_(candidates) {}

  ADAPTIVE_BVH_INLINE bool isLeaf(int node) const { return topology_.isLeaf(node); }

  /// A node that is not traversed has motion 0.
  ADAPTIVE_BVH_INLINE static void skipped(int, Box& motion) {
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
    if constexpr (kMarks) {
      candidates_[left] = mayBeUnfit(left);
      candidates_[left + 1] = mayBeUnfit(left + 1);
    }
  }

  ADAPTIVE_BVH_INLINE void applyRoot(const Box& root) {
    const float spread = spreadsOf(root, root)[0];
    if (spread > 0 || has_common_motion_) move(0, root, spread);
    if constexpr (kMarks) candidates_[0] = mayBeUnfit(0);
  }

  PropagationCounts counts() const { return counts_; }

 private:
  /// The rounding error of positions, in body units: a smaller growth does not count as inflation.
  static float leastInflation(const UpdateTarget<BV>& target, S unit) {
    const fcl::AABB<S>& box = target.model.aabb_local;
    const S farthest = box.min_.cwiseAbs().sum() + box.max_.cwiseAbs().sum();
    return float(4 * rounding::epsilon<S>() * (farthest + target.tree.inflations.coordinateSum()) /
                 unit);
  }

  /// Prefetches the parts of FCL's node that the traversal needs, which are on two cache lines.
  /// Saves 10 to 15 % of the traversal.
  ADAPTIVE_BVH_INLINE void prefetch(int node) const { Volume<BV>::prefetch(fcl_nodes_[node].bv); }

  /// Half the diagonals of two boxes of motions, in lanes 0 (a) and 2 (b); 0 where nothing moves.
  ///
  /// Rounded up: let u = 2^-24. A motion of VertexState has a relative error of 2u, hence at most
  /// 2u of the largest motion; differences, squares, sums and roots here have a relative error
  /// below 8u. If anything moves, `kFloor` covers underflow: components of motions below
  /// ScaledFrame::kLeast (sqrt(3) 2^-59) and squares below the smallest float (sqrt(3) 2^-63).
  ADAPTIVE_BVH_INLINE static Float4 spreadsOf(const Box& a, const Box& b) {
    const Float4 half = float4::all(0.5f);
    constexpr float kStateError = 1.f / (1 << 22), kFloor = 1.f / (1ull << 58);
    const Float4 half_a = (a.high - a.low) * half, half_b = (b.high - b.low) * half;
    // The lengths of these are upper bounds of the largest motions.
    const Float4 far_a = float4::upper(-a.low, a.high), far_b = float4::upper(-b.low, b.high);
    const Float4 lengths = float4::squareRoot(float4::sums(half_a * half_a, far_a * far_a,
                                                           half_b * half_b, far_b * far_b)) *
                           float4::all(kUp);
    const Float4 largest{lengths[1], lengths[1], lengths[3], lengths[3]};
    return lengths + largest * float4::all(kStateError) +
           (largest > float4::all(0) ? float4::all(kFloor) : float4::all(0));
  }

  /// Moves FCL's volume by the common translation and the centre of the node's motions, and
  /// increases its radius by half their diagonal (`spread`).
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

  /// Whether the inflation factor (refit.h) may exceed leastUnfitFactor. Uses a slightly lower
  /// threshold, because the fitness test rounds differently; its reference length is never shorter
  /// than this one.
  ADAPTIVE_BVH_INLINE MayBeUnfit mayBeUnfit(int node) const {
    const BV& bv = fcl_nodes_[node].bv;
    const S inflation = S(inflations_[node]) * unit_;
    const S reference =
        Volume<BV>::radius(bv) - inflation + Volume<BV>::smallestSide(bv) * side_share_;
    return MayBeUnfit(!(inflation <= least_factor_ * reference));
  }

  static constexpr S kBelow = S(0.999);              ///< lowers the threshold of mayBeUnfit
  static constexpr float kUp = 1 + 1.f / (1 << 20);  ///< rounds a sum or a length up

  fcl::BVNode<BV>* const fcl_nodes_;  ///< by node
  const Topology& topology_;
  const Motions<S> motions_;
  float* const inflations_;  ///< by node, in body units
  const bool has_common_motion_;
  const S unit_;      ///< Motions::unit
  const S rounding_;  ///< error of moving a volume, in the mesh's units
  const float least_inflation_;
  const S side_share_;            ///< share of the smallest side in the reference length
  const S least_factor_;          ///< no volume with a lower inflation factor is unfit
  MayBeUnfit* const candidates_;  ///< by node
  PropagationCounts counts_;
};

/// Traverses the pairs from `first` to `last` (left siblings), beginning with the last.
template <typename BV, bool kMarks>
class RangeRule : public MotionRule<BV, kMarks> {
 public:
  RangeRule(const UpdateTarget<BV>& target, const Motions<typename BV::S>& motions,
            const RefitPolicy& policy, MayBeUnfit* candidates, int first, int last)
      : MotionRule<BV, kMarks>(target, motions, policy, candidates),
        end_(first - 2),
        left_(last + 2) {}

  ADAPTIVE_BVH_INLINE int nextPair() {
    left_ -= 2;
    return left_ != end_ ? left_ : 0;
  }
  ADAPTIVE_BVH_INLINE static bool isTraversed(int) { return true; }

 private:
  const int end_;  ///< the pair before the first one
  int left_;       ///< left sibling of the current pair
};

/// Traverses all pairs outside some subtrees, which have been traversed before. The subtrees are
/// sorted from the last to the first.
template <typename BV, bool kMarks>
class AboveRule : public MotionRule<BV, kMarks> {
 public:
  AboveRule(const UpdateTarget<BV>& target, const Motions<typename BV::S>& motions,
            const RefitPolicy& policy, MayBeUnfit* candidates, const std::vector<Subtree>& subtrees)
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
  void skipped(int node, Box& motion) const { motion = find(node)->motion; }

 private:
  /// The subtree with this root, or null.
  const Subtree* find(int node) const {
    for (const Subtree& subtree : subtrees_)
      if (subtree.root == node) return &subtree;
    return nullptr;
  }

  typename std::vector<Subtree>::const_iterator next_, end_;  ///< subtrees not yet left out
  const std::vector<Subtree>& subtrees_;
  int left_;  ///< left sibling of the current pair
};

/// Traverses the pairs above moved vertices.
template <typename BV>
class DirtyRule : public MotionRule<BV, false> {
 public:
  DirtyRule(const UpdateTarget<BV>& target, const Motions<typename BV::S>& motions,
            const RefitPolicy& policy, MayBeUnfit* candidates, DirtyNodes& nodes)
      : MotionRule<BV, false>(target, motions, policy, candidates),
        topology_(target.tree.topology),
        nodes_(nodes),
        pair_(nodes.size()) {}

  int nextPair() {
    pair_ = nodes_.before(pair_);
    return 2 * pair_ - 1;
  }
  bool isTraversed(int node) const {
    return nodes_.isMarked(static_cast<int>(topology_.innerIndex(node)) + 1);
  }

 private:
  const Topology& topology_;
  DirtyNodes& nodes_;
  int pair_;  ///< the current pair, as a node of `nodes_`
};

}  // namespace adaptive_bvh
