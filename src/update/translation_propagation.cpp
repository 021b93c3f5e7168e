#include "update/translation_propagation.h"

#include <algorithm>

#include "update/post_order.h"

namespace adaptive_bvh {
namespace {

/// The motions of a step, lent to the rule of its traversal.
template <typename S>
struct Motions {
  const VertexState* states;
  const std::array<float, 4>* previous;  ///< null where one frame is kept
  const fcl::Vector3<S> common;
};

template <typename BV>
Motions<typename BV::S> motionsOf(const fcl::BVHModel<BV>& model,
                                  const VertexStates<typename BV::S>& vertices) {
  return {vertices.data(), model.prev_vertices ? vertices.previous() : nullptr,
          vertices.commonTranslation()};
}

/// All nodes below one: their pairs of siblings are a range.
struct Subtree {
  int root;
  int first_pair, last_pair;  ///< left siblings
  NodeMotion value;           ///< the root's, once the subtree is traversed
};

/// The rule of the traversal. Reads and writes plain arrays. (Eight lanes by AVX2
/// took 4.5 ns a node in place of 5.1 on the thesis's scenarios at 16 times their triangles, and
/// gained nothing at 64 times.)
template <typename BV>
class MotionRule {
 public:
  using S = typename BV::S;

  MotionRule(const UpdateTarget<BV>& target, const Motions<S>& motions)
      : fcl_nodes_(&target.model.getBV(0)),
        leaf_vertices_(target.tree.topology.leaf_vertices.data()),
        motions_(motions),
        boxes_(target.tree.boxes->nodes()),
        bounds_(target.tree.motion.ofPair(0)),
        common_length_(lengthOf(motions.common, target.tree.boxes->frame)),
        unit_(target.tree.boxes->frame.unit()),
        rounding_(target.tree.motion.roundingOfMove()),
        least_inflation_(leastInflation(target)) {}

  ADAPTIVE_BVH_INLINE bool isLeaf(int node) const { return boxes_.isLeaf(node); }

  ADAPTIVE_BVH_INLINE void known(int node, NodeMotion& value) const {
    value.box = boxes_.box(node);
    value.motion = {float4::all(0), float4::all(0)};
  }

  ADAPTIVE_BVH_INLINE void leaf(int node, NodeMotion& value) const {
    const VertexIndices& vertices = leaf_vertices_[boxes_.leafIndex(node)];
    const VertexState& a = motions_.states[vertices[0]];
    value.box.low = value.box.high = float4::load(a.position);
    value.motion.low = value.motion.high = float4::load(a.motion);
    for (int k = 1; k < 3; ++k) {
      const VertexState& b = motions_.states[vertices[k]];
      value.box.add(float4::load(b.position));
      value.motion.add(float4::load(b.motion));
    }
    if (!motions_.previous) return;
    // Two-frame update: the volume must hold the vertices where they were, which is motion 0.
    for (unsigned v : vertices) value.box.add(float4::load(motions_.previous[v].data()));
    value.motion.add(float4::all(0));
  }

  ADAPTIVE_BVH_INLINE static void merge(NodeMotion& a, const NodeMotion& b) {
    a.box.add(b.box);
    a.motion.add(b.motion);
  }

  ADAPTIVE_BVH_INLINE void apply(int left, const NodeMotion& a, const NodeMotion& b) {
    const int ahead = std::max(left - 16, 0);
    prefetch(ahead);
    prefetch(ahead + 1);
    const Float4 lengths = grow(left, a.motion, b.motion);
    if (lengths[0] + lengths[2] + common_length_ > 0) {  // else nothing moved
      move(left, a.motion, lengths[0]);
      move(left + 1, b.motion, lengths[2]);
    }
    boxes_.setBox(left, a.box);
    boxes_.setBox(left + 1, b.box);
  }

  /// The root is treated as a right sibling without a left one; the arrays have room for that.
  ADAPTIVE_BVH_INLINE void applyRoot(const NodeMotion& root) {
    const Float4 lengths = grow(-1, root.motion, root.motion);
    if (lengths[2] + common_length_ > 0) move(0, root.motion, lengths[2]);
    boxes_.setBox(0, root.box);
  }

  PropagationCounts counts() const { return counts_; }

 private:
  /// In body units, rounded up.
  static float lengthOf(const fcl::Vector3<S>& translation, const BodyFrame<S>& frame) {
    const S length = rounding::norm<S>(translation);
    return length > 0 ? float(length * frame.scale()) * (1 + 1.f / (1 << 20)) + BodyFrame<S>::kLeast
                      : 0.f;
  }

  /// What positions may be rounded to, in body units: a radius that grows by no more is not counted
  /// as inflated.
  static float leastInflation(const UpdateTarget<BV>& target) {
    const fcl::AABB<S>& box = target.model.aabb_local;
    const S farthest = box.min_.cwiseAbs().sum() + box.max_.cwiseAbs().sum();
    return float(4 * rounding::epsilon<S>() * (farthest + target.tree.motion.coordinateSum()) *
                 target.tree.boxes->frame.scale());
  }

  /// FCL's nodes are large: what the traversal needs of one lies on two cache lines. Saves 10 to 15
  /// % of the traversal.
  ADAPTIVE_BVH_INLINE void prefetch(int node) const {
    __builtin_prefetch(Volume<BV>::corner(fcl_nodes_[node].bv), 1);
    __builtin_prefetch(&Volume<BV>::radius(fcl_nodes_[node].bv), 1);
  }

  /// Adds to the motion bounds of two siblings. Returns half the diagonal of the first's motions
  /// and the farthest of them, then those of the second. Both are what is left beyond the common
  /// translation, which the accumulated motion gets in addition.
  ///
  /// Rounded up: let u = 2^-24. A motion of VertexState is off by 2u of itself, hence by 2u of the
  /// farthest; differences, squares, sums and roots here are off by less than 8u relative. Where
  /// anything moves, `kFloor` covers what is too small for that: the components of motions below
  /// BodyFrame::kLeast (sqrt(3) 2^-59) and squares below the smallest float (sqrt(3) 2^-63).
  ADAPTIVE_BVH_INLINE Float4 grow(int left, const Box& a, const Box& b) const {
    const Float4 up = float4::all(1 + 1.f / (1 << 20)), half = float4::all(0.5f);
    constexpr float kState = 1.f / (1 << 22), kFloor = 1.f / (1ull << 58);
    const Float4 half_a = (a.high - a.low) * half, half_b = (b.high - b.low) * half;
    const Float4 far_a = float4::upper(-a.low, a.high), far_b = float4::upper(-b.low, b.high);
    Float4 lengths = float4::squareRoot(float4::sums(half_a * half_a, far_a * far_a,
                                                     half_b * half_b, far_b * far_b)) *
                     up;
    const Float4 far{lengths[1], lengths[1], lengths[3], lengths[3]};
    lengths += far * Float4{kState, 0, kState, 0} +
               (far > float4::all(0) ? float4::all(kFloor) : float4::all(0));
    float* const bounds = bounds_ + 2 * left;  // of both: inflation, accumulated motion
    const Float4 common{0, common_length_, 0, common_length_};
    float4::store((float4::load(bounds) + lengths + common) * up, bounds);
    return lengths;
  }

  /// Moves FCL's volume by the middle of the motions and lets its radius grow by their spread.
  ADAPTIVE_BVH_INLINE void move(int node, const Box& motion, float spread) {
    const Float4 middle = (motion.low + motion.high) * float4::all(0.5f);
    BV& bv = fcl_nodes_[node].bv;
    S* const corner = Volume<BV>::corner(bv);
    for (int k = 0; k < 3; ++k) corner[k] += motions_.common[k] + S(middle[k]) * unit_;
    Volume<BV>::radius(bv) += S(spread) * unit_ + rounding_;
    ++counts_.moved;
    counts_.inflated += float4::largest(motion.high - motion.low) > least_inflation_;
  }

  fcl::BVNode<BV>* const fcl_nodes_;
  const VertexIndices* const leaf_vertices_;
  const Motions<S> motions_;
  const BoxNodes<BoxNode> boxes_;
  float* const bounds_;
  const float common_length_;
  const S unit_, rounding_;
  const float least_inflation_;
  PropagationCounts counts_;
};

/// All pairs from the last to the first of a range.
template <typename BV>
class RangeRule : public MotionRule<BV> {
 public:
  RangeRule(const UpdateTarget<BV>& target, const Motions<typename BV::S>& motions, int first,
            int last)
      : MotionRule<BV>(target, motions), end_(first - 2), left_(last + 2) {}

  ADAPTIVE_BVH_INLINE int nextPair() {
    left_ -= 2;
    return left_ != end_ ? left_ : 0;
  }
  ADAPTIVE_BVH_INLINE static bool isTraversed(int) { return true; }

 private:
  const int end_;
  int left_;
};

/// All pairs that are in none of some subtrees.
template <typename BV>
class AboveRule : public MotionRule<BV> {
 public:
  AboveRule(const UpdateTarget<BV>& target, const Motions<typename BV::S>& motions,
            const std::vector<Subtree>& subtrees)
      : MotionRule<BV>(target, motions),
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
  void known(int node, NodeMotion& value) const { value = find(node)->value; }

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

/// All dirty pairs.
template <typename BV>
class DirtyRule : public MotionRule<BV> {
 public:
  DirtyRule(const UpdateTarget<BV>& target, const Motions<typename BV::S>& motions,
            const DirtyPairs& dirty)
      : MotionRule<BV>(target, motions),
        boxes_(target.tree.boxes->nodes()),
        dirty_(dirty),
        left_(target.nodes()) {}

  int nextPair() { return left_ = dirty_.before(left_); }
  bool isTraversed(int node) const { return dirty_.isDirty(boxes_.left(node)); }

 private:
  const BoxNodes<BoxNode> boxes_;
  const DirtyPairs& dirty_;
  int left_;
};

/// About `count` subtrees without a node in common, from the last to the first, as equal in size as
/// the tree allows. None for small trees.
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
      subtrees.push_back({i, node.leftChild(), node.leftChild() + 2 * (pairs - 1), NodeMotion()});
    } else {
      open.push_back(node.leftChild());
      open.push_back(node.rightChild());  // comes off first: later pairs before earlier ones
    }
  }
  return subtrees;
}

}  // namespace

template <typename BV>
void TranslationPropagation<BV>::reset(const UpdateTarget<BV>& target) {
  AdaptiveTree<BV>& tree = target.tree;
  if (!tree.boxes) tree.boxes.emplace();
  tree.boxes->adopt(target.model);
  tree.motion.reset(target.nodes());
  vertices_.reset(target.model.num_vertices);
  stack_.resize(tree.topology.stackCapacity());
  next_limited_ = 0;
}

template <typename BV>
void TranslationPropagation<BV>::start(const UpdateTarget<BV>& target, const BV& root) {
  target.tree.boxes->frame =
      BodyFrame<S>(Volume<BV>::axes(root).template cast<double>(), root.center(), root.size() / 2);
  vertices_.start(target, target.tree.boxes->frame);
  ThreadPool alone(1);
  propagate(target, RefitPolicy(), alone);
  target.tree.restartMotion(target.model);
}

template <typename BV>
void TranslationPropagation<BV>::accept(const UpdateTarget<BV>& target, S largest) {
  AdaptiveTree<BV>& tree = target.tree;
  constexpr float kLongWay = 64;  // in body units: some sixty times the body's size
  if (tree.motion.accumulatedMotion(0) > kLongWay) tree.restartMotion(target.model);
  tree.boxes->frame = vertices_.frame();
  tree.motion.extend(largest, vertices_.frame().unit());
  vertices_.accept();
}

template <typename BV>
PropagationCounts TranslationPropagation<BV>::propagate(const UpdateTarget<BV>& target,
                                                        const RefitPolicy&, ThreadPool& pool) {
  if (pool.size() > 1) return propagateSubtrees(target, pool);
  RangeRule<BV> rule(target, motionsOf(target.model, vertices_), 1, target.nodes() - 2);
  traversePostOrder(stack_.data(), rule);
  return rule.counts();
}

/// First below every subtree's root, on any thread; then the rest.
template <typename BV>
PropagationCounts TranslationPropagation<BV>::propagateSubtrees(const UpdateTarget<BV>& target,
                                                                ThreadPool& pool) {
  std::vector<Subtree> subtrees = subtreesOf(target.model, 8 * pool.size());
  std::vector<std::vector<NodeMotion>> stacks(static_cast<std::size_t>(pool.size()));
  for (auto& stack : stacks) stack.resize(stack_.size());
  std::vector<PropagationCounts> counts(subtrees.size());
  pool.forEach(static_cast<int>(subtrees.size()), [&](int task, int thread) {
    Subtree& subtree = subtrees[static_cast<std::size_t>(task)];
    RangeRule<BV> rule(target, motionsOf(target.model, vertices_), subtree.first_pair,
                       subtree.last_pair);
    NodeMotion* stack = stacks[static_cast<std::size_t>(thread)].data();
    traversePairs(stack, rule);
    subtree.value = *--stack;
    counts[static_cast<std::size_t>(task)] = rule.counts();
  });
  AboveRule<BV> rule(target, motionsOf(target.model, vertices_), subtrees);
  traversePostOrder(stack_.data(), rule);
  PropagationCounts sum = rule.counts();
  for (const PropagationCounts& part : counts) sum += part;
  return sum;
}

template <typename BV>
PropagationCounts TranslationPropagation<BV>::propagateDirty(const UpdateTarget<BV>& target,
                                                             const DirtyPairs& dirty) {
  DirtyRule<BV> rule(target, motionsOf(target.model, vertices_), dirty);
  traversePostOrder(stack_.data(), rule);
  return rule.counts();
}

template <typename BV>
void TranslationPropagation<BV>::limitInflation(const UpdateTarget<BV>& target, int node) {
  const BoxTree<S>& boxes = *target.tree.boxes;
  const Box box = boxes.nodes().box(node);
  const Float4 sides = box.high - box.low;
  const float inflation = target.tree.motion.inflation(node);
  if (16 * inflation * inflation <= float4::sum(sides * sides)) return;
  const BV around = Volume<BV>::around(box, boxes.frame, boxes.root().largestCoordinate());
  BV& bv = target.volume(node);
  if (Volume<BV>::radius(around) >= Volume<BV>::radius(bv)) return;  // too small for the boxes
  bv = around;
  target.tree.motion.include(Volume<BV>::cornerSum(bv));
  // Counts as a rectangle that was inflated until it held the box: test A sees how loose it is.
  target.tree.motion.setInflation(node,
                                  static_cast<float>(Volume<BV>::radius(bv) * boxes.frame.scale()));
}

template <typename BV>
void TranslationPropagation<BV>::limitSomeInflations(const UpdateTarget<BV>& target) {
  constexpr int kRound = 16;  // updates until every node had its turn
  for (int count = target.nodes() / kRound + 1; count > 0; --count) {
    if (next_limited_ >= target.nodes()) next_limited_ = 0;
    limitInflation(target, next_limited_++);
  }
}

template <typename BV>
std::size_t TranslationPropagation<BV>::bytes() const {
  return vertices_.bytes() + stack_.capacity() * sizeof(NodeMotion);
}

template class TranslationPropagation<fcl::RSS<float>>;
template class TranslationPropagation<fcl::RSS<double>>;

}  // namespace adaptive_bvh
