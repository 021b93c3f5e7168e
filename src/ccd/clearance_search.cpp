// The least distance over a motion: branch and bound in space and time. First the walk finds pairs
// of parts, then each pair is followed in time.
#include "ccd/clearance_search.h"

#include <cmath>
#include <stdexcept>
#include <string>

#include "base/leased.h"
#include "base/number_text.h"
#include "ccd/clearance_intervals.h"
#include "ccd/pair_in_time.h"
#include "query/pair_filter.h"

namespace adaptive_bvh {
namespace {

using Vector = fcl::Vector3d;

/// The index of a triangle, given by its leaf index, or the number of a cell; -1 for a shape.
int indexOfPart(const MovingBody& body, unsigned part) {
  return body.mesh() ? body.mesh()->tree.triangle(part) : body.cell();
}

/// Whether a body stands still.
bool isStill(const MovingBody& body) {
  const FrameAt from = body.frame().at(0), to = body.frame().at(1);
  return body.isUndeformed() && body.frame().isRigid() && from.linear == to.linear &&
         from.translation == to.translation;
}

/// The goal of MotionWalk that lowers an upper bound of the least distance.
template <typename Pair>
class LeastDistance {
 public:
  LeastDistance(const ClearanceQuery& query, MotionClearance& best)
      : query_(query),
        best_(best),
        is_still_(isStill(query.first.body) && isStill(query.second.body)) {
    if (best.elements[0] >= 0) direction_ = (best.points[1] - best.points[0]).stableNormalized();
  }

  double limit() const { return best_.upper - query_.tolerance; }
  const Vector& direction() const { return direction_; }
  static bool admits(double) { return true; }
  bool isDone() const { return !(limit() > 0); }

  void leaf(unsigned i, unsigned j, double begin, double end) {
    if (isLeftOut(query_, i, j)) return;
    const Pair pair(query_.first.body, query_.second.body, {i, j});
    const typename Pair::At a = pair.at(begin);
    if (is_still_) {
      if (!isApart(pair, a, a)) sample(pair, {i, j}, a);
      return;
    }
    const typename Pair::At b = pair.at(end);
    if (isApart(pair, a, b)) return;
    const Sample at_begin = sample(pair, {i, j}, a);
    const Sample at_end = sample(pair, {i, j}, b);
    follow(pair, {i, j}, at_begin, at_end);
  }

  bool isImproved() const { return is_improved_; }
  /// A lower bound of all that was left undivided.
  double unresolved() const { return unresolved_; }

 private:
  using Sample = PairSample<Pair>;

  bool isApart(const Pair& pair, const typename Pair::At& a, const typename Pair::At& b) const {
    return isApartAlong(pair, a, b, direction_, limit()) || isApartByGuess(pair, a, b, limit());
  }
  /// Computes the distance at a time, and keeps it if it is smaller.
  Sample sample(const Pair& pair, const PartNumbers& parts, const typename Pair::At& at) {
    Sample found(pair, at);
    ++best_.pair_times;
    const double distance = found.gap.distance;
    const double upper = distance > 0 ? distance + pair.gapError(distance) : 0;
    if (upper < best_.upper) {
      best_.upper = upper;
      best_.time = at.t;
      best_.elements = {indexOfPart(query_.first.body, parts.first),
                        indexOfPart(query_.second.body, parts.second)};
      best_.points = {found.gap.points.first, found.gap.points.second};
      direction_ = found.normal;
      is_improved_ = true;
    }
    return found;
  }
  /// Divides the time between two samples until the pair is known to be farther than the limit.
  void follow(const Pair& pair, const PartNumbers& parts, const Sample& a, const Sample& b) {
    if (isDone()) return;
    const TimeBound bound = boundBetween(pair, a, b);
    if (bound.lower >= limit()) return;
    if (b.at.t - a.at.t < kShortestTime) {
      unresolved_ = std::min(unresolved_, bound.lower);
      return;
    }
    const Sample middle = sample(pair, parts, pair.at(bound.time));
    follow(pair, parts, a, middle);
    follow(pair, parts, middle, b);
  }

  const ClearanceQuery& query_;
  MotionClearance& best_;
  const bool is_still_;
  Vector direction_ = Vector::Zero();  ///< between the nearest points so far, maybe of others
  bool is_improved_ = false;
  double unresolved_ = std::numeric_limits<double>::infinity();
};

/// The goal of MotionWalk that finds the first time, not after `latest`, at which two bodies are at
/// most `separation` apart.
template <typename Pair>
class FirstImpact {
 public:
  FirstImpact(const ClearanceQuery& query, double separation, double latest, MotionClearance& best)
      : query_(query), best_(best), separation_(separation), latest_(latest) {}

  double limit() const { return separation_; }
  static Vector direction() { return Vector::Zero(); }
  bool admits(double begin) const { return begin < latest_ || (begin == 0 && !is_found_); }
  bool isDone() const { return latest_ == 0 && is_found_; }
  bool isFound() const { return is_found_; }

  void leaf(unsigned i, unsigned j, double begin, double end) {
    if (isLeftOut(query_, i, j)) return;
    const Pair pair(query_.first.body, query_.second.body, {i, j});
    findFirstImpact(pair, begin, std::max(begin, std::min(end, latest_)), separation_,
                    [&](const PairSample<Pair>& sample) {
                      ++best_.pair_times;
                      take(sample, {i, j});
                    });
  }

 private:
  void take(const PairSample<Pair>& sample, const PartNumbers& parts) {
    if (is_found_ && !(sample.at.t < latest_)) return;
    latest_ = sample.at.t;
    is_found_ = true;
    best_.lower = best_.upper = 0;
    best_.time = latest_;
    best_.elements = {indexOfPart(query_.first.body, parts.first),
                      indexOfPart(query_.second.body, parts.second)};
    best_.points = {sample.gap.points.first, sample.gap.points.second};
  }

  const ClearanceQuery& query_;
  MotionClearance& best_;
  const double separation_;
  double latest_;
  bool is_found_ = false;
};

/// Walks over the bodies' trees with a goal.
template <typename Goal>
void walkWith(const ClearanceQuery& query, Goal& goal, std::size_t& box_tests) {
  const Leased<MotionWalk::Memory> memory;
  MotionWalk search(query.first, query.second, query.surface, query.tolerance, *memory);
  search.run(goal);
  box_tests += search.boxTests();
}

/// Returns run(pair), where `pair` is a null pointer to the type of the pairs of parts.
template <typename Run>
auto withPairType(const ClearanceQuery& query, const Run& run) {
  if (query.second.body.flat()) return run(static_cast<FlatPair*>(nullptr));
  if (query.second.body.mesh()) return run(static_cast<MovingTrianglePair*>(nullptr));
  return run(static_cast<SolidPair*>(nullptr));
}

template <typename Pair>
bool lowerOf(const ClearanceQuery& query, MotionClearance& best) {
  // What earlier bodies have left undivided.
  const double before = best.lower < best.upper - query.tolerance
                            ? best.lower
                            : std::numeric_limits<double>::infinity();
  LeastDistance<Pair> goal(query, best);
  walkWith(query, goal, best.box_tests);
  best.lower = std::max(0., std::min({best.upper - query.tolerance, goal.unresolved(), before}));
  if (!goal.isImproved()) return false;
  if (best.upper <= query.tolerance) {
    FirstImpact<Pair> impact(query, 0, best.meet() ? best.time : 1, best);
    walkWith(query, impact, best.box_tests);
  }
  return true;
}

}  // namespace

bool isLeftOut(const ClearanceQuery& query, unsigned i, unsigned j) {
  if (!query.ignored) return false;
  const auto a = static_cast<unsigned>(indexOfPart(query.first.body, i)),
             b = static_cast<unsigned>(indexOfPart(query.second.body, j));
  return isIgnored(*query.ignored, std::min(a, b), std::max(a, b));
}

ClearanceQuery queryOf(BoxedBody& first, BoxedBody& second, double tolerance) {
  const auto orderOf = [](const MovingBody& body) { return body.mesh() ? 0 : body.flat() ? 2 : 1; };
  const bool swaps = orderOf(first.body) > orderOf(second.body);
  return {swaps ? second : first, swaps ? first : second, tolerance, nullptr, nullptr, swaps};
}

void swapBodies(MotionClearance& clearance) {
  std::swap(clearance.elements[0], clearance.elements[1]);
  std::swap(clearance.points[0], clearance.points[1]);
}

void requireTolerable(double tolerance, double least) {
  if (!(tolerance > least) || !std::isfinite(tolerance))
    throw std::invalid_argument("adaptive_bvh: a tolerance of " + textOf(tolerance) +
                                "; for these bodies it must be finite and above " + textOf(least));
}

void requireTolerable(const ClearanceQuery& query) {
  if (query.first.body.flat())
    throw std::invalid_argument(
        "adaptive_bvh: the least distance of two planes or half-spaces over a motion");
  requireTolerable(query.tolerance,
                   1e-12 * (query.first.body.magnitude() + query.second.body.magnitude()));
}

bool lowerClearance(const ClearanceQuery& query, MotionClearance& best) {
  return withPairType(query, [&](auto* pair) {
    if (!lowerOf<std::remove_pointer_t<decltype(pair)>>(query, best)) return false;
    if (query.is_swapped) swapBodies(best);
    return true;
  });
}

bool findFirstImpact(const ClearanceQuery& query, double separation, double latest,
                     MotionClearance& found) {
  return withPairType(query, [&](auto* pair) {
    FirstImpact<std::remove_pointer_t<decltype(pair)>> goal(query, separation, latest, found);
    if (query.first.body.mesh())
      walkWith(query, goal, found.box_tests);
    else
      goal.leaf(0, 0, 0, latest);
    if (goal.isFound() && query.is_swapped) swapBodies(found);
    return goal.isFound();
  });
}

void lowerToTriangles(const ClearanceQuery& query, const std::array<int, 2>& triangles,
                      MotionClearance& best) {
  const auto cornersOf = [](const MovingBody& body, int triangle, double t) {
    const fcl::Triangle& v = body.mesh()->topology->triangles[std::size_t(triangle)];
    const MovingBody::At at = body.at(t);
    return TrianglePoints{body.vertex(v[0], at), body.vertex(v[1], at), body.vertex(v[2], at)};
  };
  const MovingTrianglePair pair(query.first.body, query.second.body, {0, 0});
  for (const double t : {0., 1.}) {
    const TriangleGap gap = gapOf(cornersOf(query.first.body, triangles[0], t),
                                  cornersOf(query.second.body, triangles[1], t));
    ++best.pair_times;
    const double upper = gap.distance + pair.gapError(gap.distance);
    if (!(upper > query.tolerance && upper < best.upper)) continue;
    best.upper = upper;
    best.lower = upper - query.tolerance;
    best.time = t;
    best.elements = triangles;
    best.points = {gap.points.first, gap.points.second};
  }
}

void findIntervalsBelow(const ClearanceQuery& query, double clearance,
                        std::vector<MotionInterval>& intervals) {
  withPairType(query, [&](auto* pair) {
    IntervalsBelow<std::remove_pointer_t<decltype(pair)>> goal(query, clearance);
    std::size_t box_tests = 0;
    walkWith(query, goal, box_tests);
    goal.finish(intervals);
  });
}

}  // namespace adaptive_bvh
