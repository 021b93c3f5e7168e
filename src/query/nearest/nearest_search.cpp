#include "query/nearest/nearest_search.h"

#include <algorithm>

#include "base/shortcut.h"

namespace adaptive_bvh {
namespace {

/// The boxes of a node of the second tree if single precision cannot express them: boxes that are
/// far away or NaN are moved so near that squared gaps stay in range.
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

/// Costs of improving the line, and of testing the bodies as a whole, in box tests.
constexpr long kLineCost = 96;
constexpr long kWholeBodyCost = 256;
/// Cost of a look along the line between the convex hulls, in box tests.
constexpr long kHullCost = 20000;
constexpr long kNever = std::numeric_limits<long>::max();

/// Number of box tests after which to look along the line between two bodies. Zero if the bodies
/// are so far apart that single precision hardly distinguishes boxes; never if they are near,
/// because trees with the same coordinates are better there.
long testsBeforeView(const TreePair& trees) {
  constexpr double kNear = 32, kFar = 1 << 10;
  const double apart = trees.frame().t().template lpNorm<1>();
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
      line_(memory_->line),
      blocks_(second, trees_) {
  open_.reserve(16 * static_cast<std::size_t>(trees_.first().depth() + trees_.second().depth()));
  next_supports_ = LineSeparation::largestCost(trees_.first(), trees_.second());
  constexpr long kOften = 16;  // only a small part of a large mesh may be near
  if (std::max(trees_.first().size(), trees_.second().size()) > Supports::kSmall)
    next_supports_ /= kOften;
  if (supports_first_) next_supports_ = 1;
  next_line_ = kLineCost;
  next_view_ = testsBeforeView(trees_);
  next_hulls_ = kHullCost;
  next_check_ =
      std::max<long>(kWholeBodyCost, first.mesh.vertices.size() + second.mesh.vertices.size());
  next_alignment_ = 8 * trees_.costOfAlignment();  // supports mostly make it unnecessary
  if (!isTaken(Shortcut::Supports))
    next_supports_ = next_view_ = next_hulls_ = next_check_ = kNever;
}

const Boxes4& NearestSearch::secondBoxes(int node) {
  if (is_same_) return nodes2_[node].boxes;
  if (node != turned_node_)
    turned_ = trees_.frame().isInRange() ? trees_.frame()(nodes2_[node].boxes)
                                         : boxesInRange(trees_.frame(), nodes2_[node]);
  turned_node_ = node;
  return turned_;
}

/// Which boxes of two nodes are near along the line. A function of its own, because the other cases
/// take less time.
unsigned NearestSearch::nearInView(int first, int second, const LineSeparation* supports,
                                   Gaps4x4& gaps) {
  return view_.near(first, second, supports, gaps);
}

/// Which boxes of two nodes are near, by the boxes alone.
unsigned NearestSearch::nearBoxes(int first, int second, Gaps4x4& gaps) {
  if (has_view_) return nearInView(first, second, nullptr, gaps);
  gaps = squaredGaps(nodes1_[first].boxes, secondBoxes(second));
  return gaps.below(limit2_);
}

/// Which boxes of two nodes are near, by boxes and supports.
unsigned NearestSearch::nearLanes(int first, int second, Gaps4x4& gaps) {
  box_tests_ += nodes1_[first].count * nodes2_[second].count;
  if (has_view_) return nearInView(first, second, has_supports_ ? &line_ : nullptr, gaps);
  unsigned open = nearBoxes(first, second, gaps);
  if (has_supports_ && open) {
    open &= ~line_.apart(first, second);
    ++near_pairs_;
    apart_pairs_ += !open;
  }
  return open;
}

void NearestSearch::setLimit() {
  if (limit_ == nearest_.limit()) return;
  limit_ = nearest_.limit();
  limit2_ = BoxGaps(trees_.first().scale()).squaredGapFor(limit_);
  direction_ = trees_.first().coordinates().axes().transpose() * nearest_.triangles().direction();
  blocks_.lookAlong(vectors::all(direction_));
  if (has_view_) {
    view_.setLimit(nearest_.limitOfBounds());
    limit2_ = view_.limitOfKeys();
  }
  if (has_supports_) line_.setLimit(nearest_.limitWithinRounding());
}

/// Moves the nearest of all pairs to the end. With a line only: among many nodes at nearly the same
/// distance, depth-first order would get to the nearest one late.
void NearestSearch::moveNearestToEnd() {
  const auto isFarther = [](const Pair& a, const Pair& b) { return a.gap > b.gap; };
  while (heap_ < open_.size())
    std::push_heap(open_.begin(), open_.begin() + std::ptrdiff_t(++heap_), isFarther);
  std::pop_heap(open_.begin(), open_.end(), isFarther);
  --heap_;
}

/// Returns the nearest of the pairs that the last visit added, or the last pair; with a line, the
/// nearest of all pairs if that visit added none.
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
    if (box_tests_ >= next_stage_ && takeStage()) continue;
    const Pair pair = takeNext();
    if (pair.gap < limit2_) visit(pair);
  }
}

/// Takes the steps that pay after this many box tests. Returns whether the search may be over.
bool NearestSearch::takeStage() {
  const bool is_changed = takeStages();
  next_stage_ =
      std::min({next_line_, next_view_, next_check_, next_alignment_, next_hulls_, next_supports_});
  return is_changed;
}
bool NearestSearch::takeStages() {
  if (box_tests_ >= next_line_ && refineLine()) return true;
  if (box_tests_ >= next_view_) tryBoxes();
  if (box_tests_ >= next_check_ && check()) {
    open_.clear();
    return true;
  }
  if (box_tests_ >= next_alignment_) align();
  if (box_tests_ >= next_hulls_ && tryHulls()) return true;
  if (box_tests_ < next_supports_ || direction_ == fcl::Vector3d::Zero()) return false;
  trySupports();
  return true;
}

/// Aligns the trees. The nodes stay the same, and gaps stay lower bounds.
void NearestSearch::align() {
  next_alignment_ = kNever;
  trees_.align();
  nodes1_ = trees_.first().nodes();
  nodes2_ = trees_.second().nodes();
  is_same_ = trees_.frame().isSame();
  turned_node_ = -1;
  const double before = limit_;
  limit_ = -1;
  for (Pair& pair : open_) pair.gap = 0;  // their unit has changed
  if (before >= 0) setLimit();
}

/// Improves the line between the nearest points. Returns whether it changed.
bool NearestSearch::refineLine() {
  next_line_ = 2 * box_tests_;
  if (nearest_.isRefined()) return false;
  nearest_.refineLine();
  limit_ = -1;
  setLimit();
  return true;
}

/// Whether the bodies as a whole are as far apart as the nearest pair so far.
bool NearestSearch::check() {
  next_check_ = 2 * box_tests_;
  return nearest_.areSeparated();
}

/// Bounds boxes along a line from here on.
void NearestSearch::lookAlong(const TriangleSeparation::Line& line, double extent1,
                              double extent2) {
  view_.set(trees_, line.along1, line.from, line.to, extent1, extent2);
  has_view_ = true;
  next_alignment_ = next_view_ = kNever;
  nearest_.raiseLeast(view_.gap());
  limit_ = -1;
  setLimit();
  Gaps4x4 keys;
  for (Pair& pair : open_) {
    const unsigned near = nearLanes(pair.first, pair.second, keys);
    pair.gap = near ? packs::smallest(keys.least()) : std::numeric_limits<float>::infinity();
  }
  heap_ = 0;
  has_next_ = false;
}

/// Looks along the line between the local boxes of the meshes, if these are apart.
void NearestSearch::tryBoxes() {
  next_view_ = kNever;
  if (has_supports_ || !trees_.frame().isInRange()) return;
  const LocalBoxes& boxes = nearest_.boxes();
  TriangleSeparation::Line line;
  line.along1 = boxes.line();
  if (line.along1 == fcl::Vector3d::Zero()) return;
  line.along2 = trees_.toFirst().R.transpose() * line.along1;
  line.from = boxes.middle1();
  line.to = boxes.middle2();
  lookAlong(line, boxes.extent1(line.from, line.along1), boxes.extent2(line.to, -line.along2));
}

/// Removes pairs that are not nearer than the limit. Returns the cost of supports for the rest.
long NearestSearch::setSupportParts() {
  Gaps4x4 gaps;
  const auto near1 = [&](int node) -> unsigned {
    const unsigned pairs = nearBoxes(node, 0, gaps);
    return (pairs | pairs >> 4 | pairs >> 8 | pairs >> 12) & 15;
  };
  const auto near2 = [&](int node) -> unsigned {
    const unsigned pairs = nearBoxes(0, node, gaps);
    unsigned lanes = 0;
    for (int j = 0; j < 4; ++j) lanes |= unsigned((pairs >> (4 * j) & 15) != 0) << j;
    return lanes;
  };
  const long cost = line_.setParts(trees_.first(), near1, trees_.second(), near2);
  const auto isLeftOut = [&](const Pair& pair) { return !line_.covers(pair.first, pair.second); };
  open_.erase(std::remove_if(open_.begin(), open_.end(), isLeftOut), open_.end());
  heap_ = 0;
  has_next_ = false;
  return cost;
}

/// Computes supports if the search has already taken as long; repeats it along another line if the
/// last one separated many pairs of nodes.
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
  // A search that begins with supports does so before the hulls could pay.
  if (next_hulls_ != kNever && isApart() && !supports_first_ && tryHulls()) return;
  near_pairs_ = apart_pairs_ = 0;
  line_.compute(trees_.first(), trees_.second(), nearest_.triangles());
  has_supports_ = true;
  next_supports_ = 2 * (box_tests_ + cost);
  if (has_view_ || isApart()) {
    const auto& line = nearest_.triangles().line();
    lookAlong(line, line_.extent1(), line_.extent2());
  } else {
    limit_ = -1;
    setLimit();
  }
}

/// Looks along the line between the convex hulls, with supports, if that line separates the bodies
/// by nearly the distance. No other line is better then.
bool NearestSearch::tryHulls() {
  next_hulls_ = kNever;
  constexpr double kNear = 1;  // nearer, lines between triangles are as good
  if (!trees_.frame().isInRange() || !isFartherThan(kNear) || !nearest_.lookAlongHulls())
    return false;
  setSupportParts();
  line_.compute(trees_.first(), trees_.second(), nearest_.triangles());
  has_supports_ = true;
  next_supports_ = kNever;
  const auto& line = nearest_.triangles().line();
  lookAlong(line, line_.extent1(), line_.extent2());
  return true;
}

/// Whether the distance is more than `radii` times the radius of the smaller body.
bool NearestSearch::isFartherThan(double radii) const {
  const auto radius = [](const PlacedMesh& mesh) { return mesh.bounds().aabb_radius; };
  return limit_ > radii * std::min(radius(trees_.firstMesh()), radius(trees_.secondMesh()));
}

/// Whether the bodies are so far apart that gaps across the line matter, too.
bool NearestSearch::isApart() const {
  constexpr double kApart = 32;  // nearer, boxes along the trees' axes take less time
  return trees_.frame().isInRange() && isFartherThan(kApart);
}

void NearestSearch::visit(const Pair& pair) {
  const WideNode &a = nodes1_[pair.first], &b = nodes2_[pair.second];
  Gaps4x4 gaps;
  const unsigned open = nearLanes(pair.first, pair.second, gaps);
  if (!open) return;
  if (a.isLeaf() && b.isLeaf())
    testLeaves(pair, open);
  else
    push(pair, gaps, open);
}

/// Adds the pairs below two nodes. A leaf is not divided. The nearest pair comes next.
void NearestSearch::push(const Pair& pair, const Gaps4x4& gaps, unsigned pairs) {
  const WideNode &a = nodes1_[pair.first], &b = nodes2_[pair.second];
  const std::size_t begin = open_.size();
  const auto add = [&](int first, int second, float gap) {
    open_.push_back({first, second, gap});
    if (gap < open_[begin].gap) std::swap(open_[begin], open_.back());
  };
  if (a.isLeaf()) {
    for (int j = 0; j < int(b.count); ++j)
      if (pairs >> (4 * j) & 15) add(pair.first, b.below[j], packs::smallest(gaps.row[j]));
  } else if (b.isLeaf()) {
    const unsigned lanes = (pairs | pairs >> 4 | pairs >> 8 | pairs >> 12) & 15;
    const Float4 least = gaps.least();
    for (unsigned rest = lanes; rest; rest &= rest - 1) {
      const int i = __builtin_ctz(rest);
      add(a.below[i], pair.second, least[i]);
    }
  } else {
    for (; pairs; pairs &= pairs - 1) {
      const int bit = __builtin_ctz(pairs), i = bit & 3, j = bit >> 2;
      add(a.below[i], b.below[j], gaps(i, j));
    }
  }
  std::swap(open_[begin], open_.back());
  has_next_ = true;
}

void NearestSearch::testLeaves(const Pair& pair, unsigned open) {
  if (isTaken(Shortcut::SinglePrecision))
    open = blocks_.near(pair.first, pair.second, open, limit_ * trees_.first().scale());
  if (!open) return;
  if (nearest_.areMostlyTied()) {
    open = nearest_.withoutTied(open, nodes1_[pair.first], nodes2_[pair.second]);
    if (!open) return;
  }
  const double unit = 1 / trees_.first().scale();
  nearest_.test(open, blocks_(pair.first, pair.second), unit, blocks_.error() * unit,
                nodes1_[pair.first], nodes2_[pair.second]);
  setLimit();
}

}  // namespace adaptive_bvh
