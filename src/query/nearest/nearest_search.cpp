// The search for the distance of two meshes: branch and bound on pairs of nodes of their trees.
// Pairs have keys that grow with a lower bound of their distance: squared gaps of boxes, or keys of
// the view, which measures far bodies along a line. Supports are extents of nodes along that line.
#include "query/nearest/nearest_search.h"

#include <algorithm>

#include "base/shortcut.h"

namespace adaptive_bvh {
namespace {

/// Returns the boxes of a node of the second tree in the first's coordinates if these are out of
/// the range of single precision: coordinates are clamped to kFar, so that squared gaps stay in
/// range, and a box with NaN extends over that whole range.
Boxes4 boxesInRange(const RelativeFrame& frame, const WideNode& node) {
  constexpr float kFar = 1e15f;
  const Boxes4 turned = frame(node.boxes);
  Boxes4 boxes = node.boxes;  // kept for lanes without a box
  for (int k = 0; k < 3; ++k)
    for (int i = 0; i < int(node.count); ++i) {
      // If one argument is NaN, std::min and std::max return the first one.
      boxes.low[k][i] = std::min(kFar, std::max(-kFar, turned.low[k][i]));
      boxes.high[k][i] = std::max(-kFar, std::min(kFar, turned.high[k][i]));
    }
  return boxes;
}

// Costs of steps, in box tests.
constexpr long kLineCost = 96;        // refineLine
constexpr long kWholeBodyCost = 256;  // areSeparated, at least, and tryLineOfBoxes
constexpr long kHullCost = 20000;     // tryLineOfHulls
constexpr long kNever = std::numeric_limits<long>::max();

/// Returns the number of box tests before tryLineOfBoxes: 0 if the bodies are so far apart that
/// single precision hardly distinguishes boxes; kNever if they are near, where alignment is better.
long testsBeforeView(const TreePair& trees) {
  constexpr double kNear = 32, kFar = 1 << 10;
  const double apart = trees.frame().t().lpNorm<1>();
  if (apart > kFar) return 0;
  return apart > kNear ? kWholeBodyCost : kNever;
}

}  // namespace

NearestSearch::NearestSearch(const PlacedMesh& first, const PlacedMesh& second,
                             NearestPair& nearest, bool supports_first)
    : nearest_(nearest),
      trees_(first, second),
      nodes1_(trees_.first().nodes()),
      nodes2_(trees_.second().nodes()),
      supports_first_(supports_first),
      is_same_(trees_.frame().isSame()),
      open_(memory_->open),
      supports_(memory_->supports),
      slabs_(memory_->slabs),
      blocks_(second, trees_) {
  open_.reserve(16 * static_cast<std::size_t>(trees_.first().depth() + trees_.second().depth()));
  next_supports_ = LineSeparation::largestCost(trees_.first(), trees_.second());
  constexpr long kOften = 16;  // the near part of a large mesh may be small, and so its cost
  if (std::max(trees_.first().size(), trees_.second().size()) > Supports::kSmall)
    next_supports_ /= kOften;
  if (supports_first_) next_supports_ = 1;
  next_line_ = kLineCost;
  next_view_ = testsBeforeView(trees_);
  next_hulls_ = kHullCost;
  next_check_ =
      std::max<long>(kWholeBodyCost, first.mesh.vertices.size() + second.mesh.vertices.size());
  next_alignment_ = 8 * trees_.costOfAlignment();  // supports mostly make it unnecessary
  next_slabs_ = isTaken(Shortcut::SinglePrecision) ? SlabSeparation::cost(trees_) : kNever;
  if (!isTaken(Shortcut::Supports))
    next_supports_ = next_view_ = next_hulls_ = next_check_ = kNever;
}

/// Returns the boxes of a node of the second tree, in the first tree's coordinates.
const Boxes4& NearestSearch::secondBoxes(int node) {
  if (is_same_) return nodes2_[node].boxes;
  if (node != turned_node_)
    turned_ = trees_.frame().isInRange() ? trees_.frame()(nodes2_[node].boxes)
                                         : boxesInRange(trees_.frame(), nodes2_[node]);
  turned_node_ = node;
  return turned_;
}

/// Tests boxes in the view. Not inlined, because that would slow down searches without a view.
unsigned NearestSearch::nearInView(int first, int second, const LineSeparation* supports,
                                   Gaps4x4& keys) {
  return view_.near(first, second, supports, keys);
}

/// Tests boxes without supports.
unsigned NearestSearch::nearByBoxes(int first, int second, Gaps4x4& keys) {
  if (has_view_) return nearInView(first, second, nullptr, keys);
  keys = squaredGaps(nodes1_[first].boxes, secondBoxes(second));
  return keys.below(key_limit_);
}

/// Tests boxes, then slabs and supports if there are any. Counts the tests.
unsigned NearestSearch::nearByAll(int first, int second, Gaps4x4& keys) {
  box_tests_ += nodes1_[first].count * nodes2_[second].count;
  if (has_view_) return nearInView(first, second, has_supports_ ? &supports_ : nullptr, keys);
  unsigned near = nearByBoxes(first, second, keys);
  if (has_slabs_ && near && !nodes1_[first].isLeaf() && !nodes2_[second].isLeaf())
    near = nearBySlabs(first, second, near);
  if (has_supports_ && near) {
    near &= ~supports_.apart(first, second);
    ++by_supports_.tested;
    by_supports_.apart += !near;
  }
  return near;
}

/// Removes the pairs of boxes that slabs separate.
unsigned NearestSearch::nearBySlabs(int first, int second, unsigned pairs) {
  const unsigned apart =
      slabs_.apart(first, nodes1_[first].boxes, second, secondBoxes(second), pairs);
  by_slabs_.tested += packs::countOf16(pairs);
  by_slabs_.apart += packs::countOf16(apart);
  has_slabs_ = by_slabs_.mayPay();
  return pairs & ~apart;
}

/// Sets all bounds to the limit of the nearest pair, if that has changed.
void NearestSearch::setLimit() {
  if (limit_ == nearest_.limit()) return;
  limit_ = nearest_.limit();
  key_limit_ = BoxGaps(trees_.first().scale()).squaredGapFor(limit_);
  direction_ = trees_.first().coordinates().axes().transpose() * nearest_.triangles().direction();
  blocks_.lookAlong(vectors::all(direction_));
  if (has_view_) {
    view_.setLimit(nearest_.limitWithinRounding());
    key_limit_ = view_.limitOfKeys();
  }
  if (has_supports_) supports_.setLimit(nearest_.limitWithinRounding());
  if (has_slabs_) slabs_.setLimit(limit_ * trees_.first().scale());
}

/// Moves the nearest of all open pairs to the end, with a view and supports: among many nodes at
/// nearly the same distance, depth-first order would get to the nearest one late.
void NearestSearch::moveNearestToEnd() {
  const auto isFarther = [](const Pair& a, const Pair& b) { return a.key > b.key; };
  while (heap_size_ < open_.size())
    std::push_heap(open_.begin(), open_.begin() + std::ptrdiff_t(++heap_size_), isFarther);
  std::pop_heap(open_.begin(), open_.end(), isFarther);
  --heap_size_;
}

/// Removes and returns the next pair: the top of the stack, which is the nearest of the pairs that
/// the last visit added. If that visit added none, with a view and supports: the nearest of all.
NearestSearch::Pair NearestSearch::takeNext() {
  if (has_view_ && has_supports_ && !has_next_) moveNearestToEnd();
  has_next_ = false;
  const Pair pair = open_.back();
  open_.pop_back();
  return pair;
}

void NearestSearch::run() {
  open_.clear();
  open_.push_back({0, 0, 0});
  limit_ = -1;
  setLimit();
  while (!open_.empty() && !nearest_.isDone()) {
    if (box_tests_ >= next_step_ && runDueSteps()) continue;
    const Pair pair = takeNext();
    if (pair.key < key_limit_) visit(pair);
  }
}

/// Runs the steps that are due after this many box tests. Returns whether the search may be over.
bool NearestSearch::runDueSteps() {
  const bool may_be_over = trySteps();
  next_step_ = std::min({next_line_, next_view_, next_check_, next_alignment_, next_hulls_,
                         next_supports_, next_slabs_});
  return may_be_over;
}
bool NearestSearch::trySteps() {
  if (box_tests_ >= next_line_ && refineLine()) return true;
  if (box_tests_ >= next_view_) tryLineOfBoxes();
  if (box_tests_ >= next_check_ && areSeparated()) {
    open_.clear();
    return true;
  }
  if (box_tests_ >= next_alignment_) align();
  if (box_tests_ >= next_slabs_) computeSlabs();
  if (box_tests_ >= next_hulls_ && tryLineOfHulls()) return true;
  if (box_tests_ < next_supports_ || direction_ == fcl::Vector3d::Zero()) return false;
  trySupports();
  return true;
}

/// Aligns the trees. The nodes, and so the open pairs, stay the same.
void NearestSearch::align() {
  next_alignment_ = kNever;
  trees_.align();
  nodes1_ = trees_.first().nodes();
  nodes2_ = trees_.second().nodes();
  is_same_ = trees_.frame().isSame();
  turned_node_ = -1;
  if (has_slabs_) computeSlabs();
  const double before = limit_;
  limit_ = -1;
  for (Pair& pair : open_) pair.key = 0;  // still a lower bound; their unit may have changed
  if (before >= 0) setLimit();
}

/// Computes slabs, if single precision suffices for both trees.
void NearestSearch::computeSlabs() {
  next_slabs_ = kNever;
  has_slabs_ = trees_.frame().isPrecise() && !has_view_;
  if (!has_slabs_) return;
  slabs_.compute(trees_);
  slabs_.setLimit(limit_ * trees_.first().scale());
}

/// Improves the line between the nearest points. Returns whether it may have changed.
bool NearestSearch::refineLine() {
  next_line_ = 2 * box_tests_;
  if (nearest_.isRefined()) return false;
  nearest_.refineLine();
  limit_ = -1;
  setLimit();
  return true;
}

/// Whether the bodies as a whole are as far apart as the nearest pair, which ends the search.
bool NearestSearch::areSeparated() {
  next_check_ = 2 * box_tests_;
  return nearest_.areSeparated();
}

/// Bounds all pairs by a view along a line from here on. `extent1`, `extent2`: how far the meshes
/// extend toward each other, from the line's points.
void NearestSearch::setView(const TriangleSeparation::Line& line, double extent1, double extent2) {
  view_.set(trees_, line.along1, line.from, line.to, extent1, extent2);
  has_view_ = true;
  next_alignment_ = next_view_ = kNever;
  nearest_.raiseLowerBound(view_.gap());
  limit_ = -1;
  setLimit();
  Gaps4x4 keys;
  for (Pair& pair : open_) {
    const unsigned near = nearByAll(pair.first, pair.second, keys);
    pair.key = near ? packs::smallest(keys.least()) : std::numeric_limits<float>::infinity();
  }
  heap_size_ = 0;
  has_next_ = false;
}

/// Sets the view along the line between the local boxes of the meshes, if these are apart.
void NearestSearch::tryLineOfBoxes() {
  next_view_ = kNever;
  if (has_supports_ || !trees_.frame().isInRange()) return;
  const LocalBoxes& boxes = nearest_.boxes();
  TriangleSeparation::Line line;
  line.along1 = boxes.line();
  if (line.along1 == fcl::Vector3d::Zero()) return;
  line.along2 = trees_.toFirst().R.transpose() * line.along1;
  line.from = boxes.middle1();
  line.to = boxes.middle2();
  setView(line, boxes.extent1(line.from, line.along1), boxes.extent2(line.to, -line.along2));
}

/// Chooses the parts of both trees that may be near the root of the other, for supports, and
/// removes the open pairs outside of them. Returns the cost of the supports, in box tests.
long NearestSearch::setSupportParts() {
  Gaps4x4 keys;
  const auto near1 = [&](int node) -> unsigned {
    const unsigned pairs = nearByBoxes(node, 0, keys);
    return (pairs | pairs >> 4 | pairs >> 8 | pairs >> 12) & 15;
  };
  const auto near2 = [&](int node) -> unsigned {
    const unsigned pairs = nearByBoxes(0, node, keys);
    unsigned lanes = 0;
    for (int j = 0; j < 4; ++j) lanes |= unsigned((pairs >> (4 * j) & 15) != 0) << j;
    return lanes;
  };
  const long cost = supports_.setParts(trees_.first(), near1, trees_.second(), near2);
  const auto isOutside = [&](const Pair& p) { return !supports_.covers(p.first, p.second); };
  open_.erase(std::remove_if(open_.begin(), open_.end(), isOutside), open_.end());
  heap_size_ = 0;
  has_next_ = false;
  return cost;
}

/// Computes supports along the line between the nearest points, unless they would cost more than
/// the search so far: then they are due later. Is due again after twice as many tests, for the line
/// known by then, but does nothing if supports have separated few pairs of nodes.
void NearestSearch::trySupports() {
  if (has_supports_ && !has_view_ && !supportsPaid()) {
    next_supports_ = kNever;
    return;
  }
  const long cost = setSupportParts();
  if (cost > box_tests_ && !supports_first_) {
    next_supports_ = cost;
    return;
  }
  // With `supports_first_` this is the beginning of the search, too early for the cost of hulls.
  if (next_hulls_ != kNever && areFarApart() && !supports_first_ && tryLineOfHulls()) return;
  by_supports_ = Payoff();
  supports_.compute(trees_.first(), trees_.second(), nearest_.triangles());
  has_supports_ = true;
  next_supports_ = 2 * (box_tests_ + cost);
  if (has_view_ || areFarApart()) {
    setView(nearest_.triangles().line(), supports_.extent1(), supports_.extent2());
  } else {
    limit_ = -1;
    setLimit();
  }
}

/// Sets a view and supports along the line between the convex hulls, if that line separates the
/// bodies by nearly the distance. Then no other line is better. Returns whether it did so.
bool NearestSearch::tryLineOfHulls() {
  next_hulls_ = kNever;
  constexpr double kNear = 1;  // for nearer bodies, lines between triangles are as good
  if (!trees_.frame().isInRange() || !isFartherThan(kNear) || !nearest_.lookAlongHulls())
    return false;
  setSupportParts();
  supports_.compute(trees_.first(), trees_.second(), nearest_.triangles());
  has_supports_ = true;
  next_supports_ = kNever;
  setView(nearest_.triangles().line(), supports_.extent1(), supports_.extent2());
  return true;
}

/// Whether the distance is more than `radii` times the radius of the smaller body.
bool NearestSearch::isFartherThan(double radii) const {
  const auto radius = [](const PlacedMesh& mesh) { return mesh.bounds().aabb_radius; };
  return limit_ > radii * std::min(radius(trees_.firstMesh()), radius(trees_.secondMesh()));
}

/// Whether the bodies are so far apart that a view pays, with gaps along a line and across it.
bool NearestSearch::areFarApart() const {
  constexpr double kFar = 32;  // for nearer bodies, boxes along the trees' axes take less time
  return trees_.frame().isInRange() && isFartherThan(kFar);
}

/// Tests the triangles of two leaves, or adds the pairs of children that may be near.
void NearestSearch::visit(const Pair& pair) {
  const WideNode &a = nodes1_[pair.first], &b = nodes2_[pair.second];
  Gaps4x4 keys;
  const unsigned near = nearByAll(pair.first, pair.second, keys);
  if (!near) return;
  if (a.isLeaf() && b.isLeaf())
    testLeaves(pair, near);
  else
    push(pair, keys, near);
}

/// Adds the pairs of nodes below the boxes `pairs` of two nodes, of which one may be a leaf: that
/// is then in all of these pairs. The nearest pair goes on top of the stack.
void NearestSearch::push(const Pair& pair, const Gaps4x4& keys, unsigned pairs) {
  const WideNode &a = nodes1_[pair.first], &b = nodes2_[pair.second];
  const std::size_t begin = open_.size();
  const auto add = [&](int first, int second, float key) {
    open_.push_back({first, second, key});
    if (key < open_[begin].key) std::swap(open_[begin], open_.back());
  };
  if (a.isLeaf()) {
    for (int j = 0; j < int(b.count); ++j)
      if (pairs >> (4 * j) & 15) add(pair.first, b.below[j], packs::smallest(keys.row[j]));
  } else if (b.isLeaf()) {
    unsigned lanes = (pairs | pairs >> 4 | pairs >> 8 | pairs >> 12) & 15;
    const Float4 least = keys.least();
    for (; lanes; lanes &= lanes - 1) {
      const int i = __builtin_ctz(lanes);
      add(a.below[i], pair.second, least[i]);
    }
  } else {
    for (; pairs; pairs &= pairs - 1) {
      const int bit = __builtin_ctz(pairs), i = bit & 3, j = bit >> 2;
      add(a.below[i], b.below[j], keys(i, j));
    }
  }
  std::swap(open_[begin], open_.back());
  has_next_ = true;
}

/// Tests the pairs of triangles `pairs` of two leaves.
void NearestSearch::testLeaves(const Pair& pair, unsigned pairs) {
  if (isTaken(Shortcut::SinglePrecision) &&
      (by_leaf_slabs_.mayPay() || !nearest_.areMostlyTied())) {
    pairs = blocks_.near(pair.first, pair.second, pairs, limit_ * trees_.first().scale());
    ++by_leaf_slabs_.tested;
    by_leaf_slabs_.apart += !pairs;
  }
  if (!pairs) return;
  if (nearest_.areMostlyTied()) {
    pairs = nearest_.withoutTied(pairs, nodes1_[pair.first], nodes2_[pair.second]);
    if (!pairs) return;
  }
  const double unit = 1 / trees_.first().scale();
  nearest_.test(pairs, blocks_(pair.first, pair.second), unit, blocks_.error() * unit,
                nodes1_[pair.first], nodes2_[pair.second]);
  setLimit();
}

}  // namespace adaptive_bvh
