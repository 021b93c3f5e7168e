#include "thesis/translation_propagation.h"

#include <new>

#include "thesis/motion_rule.h"
#include "thesis/post_order.h"

namespace adaptive_bvh {
namespace {

/// The motions that the vertex pass has read.
template <typename BV>
Motions<typename BV::S> motionsOf(const fcl::BVHModel<BV>& model,
                                  const VertexStates<typename BV::S>& vertices) {
  return {vertices.data(), model.prev_vertices != nullptr, vertices.frame().unit(),
          vertices.commonTranslation()};
}

/// About `count` disjoint subtrees of similar sizes, from last to first; none in small trees.
template <typename BV>
std::vector<Subtree> subtreesOf(const fcl::BVHModel<BV>& model, int count) {
  std::vector<Subtree> subtrees;
  const int max_primitives = std::max(2, model.getBV(0).num_primitives / count);
  std::vector<int> stack = {0};
  while (!stack.empty()) {
    const int i = stack.back();
    stack.pop_back();
    const fcl::BVNode<BV>& node = model.getBV(i);
    if (node.isLeaf()) continue;
    if (i > 0 && node.num_primitives <= max_primitives) {
      const int pairs = node.num_primitives - 1;  // one for each inner node
      subtrees.push_back({i, node.leftChild(), node.leftChild() + 2 * (pairs - 1), Box()});
    } else {
      stack.push_back(node.leftChild());
      stack.push_back(node.rightChild());  // popped first: later pairs before earlier ones
    }
  }
  return subtrees;
}

}  // namespace

template <typename BV>
void TranslationPropagation<BV>::reset(const UpdateTarget<BV>& target) {
  AdaptiveTree<BV>& tree = target.tree;
  tree.inflations.reset(target.nodes());
  candidates_.resize(static_cast<std::size_t>(target.nodes()));
  has_candidates_ = false;
  vertices_.reset(tree.topology.slots.size());
  stack_.resize(tree.topology.stackCapacity());
  next_turn_ = 0;
}

template <typename BV>
void TranslationPropagation<BV>::start(const UpdateTarget<BV>& target, const BV& root) {
  vertices_.start(target, ScaledFrame<S>(Volume<BV>::center(root), Volume<BV>::length(root) / 2));
  target.tree.restartCoordinateSum(target.model);
  target.tree.inflations.include(Volume<BV>::cornerSum(root));
  kept_.assign(target.tree.topology.slots.leaves() - 1, KeptAxes());
  BodyFit<BV> fits = fit(target, RefitPolicy());
  for (int i = 0; i < target.nodes(); ++i)
    if (!target.tree.topology.isLeaf(i)) fits.keepAxes(i, i == 0 ? root : target.volume(i));
}

template <typename BV>
void TranslationPropagation<BV>::accept(const UpdateTarget<BV>& target, const Summary& summary) {
  AdaptiveTree<BV>& tree = target.tree;
  const S unit = vertices_.frame().unit();
  if (tree.inflations.needsRestart(unit)) tree.restartCoordinateSum(target.model);
  tree.inflations.extend(summary.largestDisplacement(), unit);
  vertices_.accept(summary);
}

template <typename BV>
PropagationCounts TranslationPropagation<BV>::propagate(const UpdateTarget<BV>& target,
                                                        const RefitPolicy& policy, TaskPool& pool) {
  const bool refits_all = policy.criterion == FitnessCriterion::RefitAll;
  has_candidates_ = !refits_all && !onlyVisitedAreUnfit(target.tree.statistics, policy);
  if (refits_all) return {};  // the refits replace all volumes
  return has_candidates_ ? propagateAll<true>(target, policy, pool)
                         : propagateAll<false>(target, policy, pool);
}

template <typename BV>
template <bool kMarks>
PropagationCounts TranslationPropagation<BV>::propagateAll(const UpdateTarget<BV>& target,
                                                           const RefitPolicy& policy,
                                                           TaskPool& pool) {
  if (pool.size() > 1) {
    try {
      return propagateSubtrees<kMarks>(target, policy, pool);
    } catch (const std::bad_alloc&) {  // nothing has moved yet: go on with one thread
    }
  }
  RangeRule<BV, kMarks> rule(target, motionsOf(target.model, vertices_), policy, candidates_.data(),
                             1, target.nodes() - 2);
  traversePostOrder(stack_.data(), rule);
  return rule.counts();
}

/// Propagates below every subtree's root, on any thread, then in the remaining nodes on one.
/// Allocates before it moves any volume.
template <typename BV>
template <bool kMarks>
PropagationCounts TranslationPropagation<BV>::propagateSubtrees(const UpdateTarget<BV>& target,
                                                                const RefitPolicy& policy,
                                                                TaskPool& pool) {
  std::vector<Subtree> subtrees = subtreesOf(target.model, 8 * pool.size());
  std::vector<std::vector<Box>> stacks(static_cast<std::size_t>(pool.size()));
  for (auto& stack : stacks) stack.resize(stack_.size());
  std::vector<PropagationCounts> counts(subtrees.size());
  pool.forEach(static_cast<int>(subtrees.size()), [&](int task, int slot) {
    Subtree& subtree = subtrees[static_cast<std::size_t>(task)];
    RangeRule<BV, kMarks> rule(target, motionsOf(target.model, vertices_), policy,
                               candidates_.data(), subtree.first_pair, subtree.last_pair);
    Box* stack = stacks[static_cast<std::size_t>(slot)].data();
    traversePairs(stack, rule);
    subtree.motion = *--stack;  // of the subtree's root, which AboveRule reads
    counts[static_cast<std::size_t>(task)] = rule.counts();
  });
  AboveRule<BV, kMarks> rule(target, motionsOf(target.model, vertices_), policy, candidates_.data(),
                             subtrees);
  traversePostOrder(stack_.data(), rule);
  PropagationCounts sum = rule.counts();
  for (const PropagationCounts& part : counts) sum += part;
  return sum;
}

template <typename BV>
PropagationCounts TranslationPropagation<BV>::propagateDirty(const UpdateTarget<BV>& target,
                                                             const RefitPolicy& policy,
                                                             DirtyNodes& nodes) {
  DirtyRule<BV> rule(target, motionsOf(target.model, vertices_), policy, candidates_.data(), nodes);
  traversePostOrder(stack_.data(), rule);
  return rule.counts();
}

template <typename BV>
NodeRange TranslationPropagation<BV>::nextTurn(const UpdateTarget<BV>& target) {
  constexpr int kRound = 64;  // number of steps in which every node gets its turn
  const int first = next_turn_ < target.nodes() ? next_turn_ : 0;
  next_turn_ = std::min(first + target.nodes() / kRound + 1, target.nodes());
  return {first, next_turn_};
}

template <typename BV>
std::size_t TranslationPropagation<BV>::bytes() const {
  return vertices_.bytes() + candidates_.capacity() + kept_.capacity() * sizeof(KeptAxes) +
         stack_.capacity() * sizeof(Box);
}

#define ADAPTIVE_BVH_INSTANTIATE(BV) template class TranslationPropagation<BV>;
ADAPTIVE_BVH_FOR_EACH_VOLUME(ADAPTIVE_BVH_INSTANTIATE)
#undef ADAPTIVE_BVH_INSTANTIATE

}  // namespace adaptive_bvh
