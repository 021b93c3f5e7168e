#include "query/within/search_schedule.h"

#include <algorithm>
#include <limits>

#include "base/shortcut.h"
#include "query/tree_pair.h"
#include "query/within/near_search.h"
#include "query/within/search_margin.h"

namespace adaptive_bvh {
namespace {

constexpr double kUnlimited = std::numeric_limits<double>::infinity();

/// The share of a margin that vertices may use: the rest covers all rounding.
constexpr double kUsable = 1 - 1. / (1 << 10);

/// Whether that rest exceeds the rounding of positions and distances.
bool isPreciseMargin(const KeptMeshes& meshes, double distance, double margin) {
  constexpr double kRounding = 0x1p-34, kFloat = 0x1p-14, kSmallest = 1e-140, kLargest = 1e140;
  const KeptMeshes::Ball ball = meshes.enclosingBall();
  const double size = ball.centre.lpNorm<1>() + ball.radius + meshes.to_first.T.lpNorm<1>();
  return margin > kSmallest && size < kLargest && margin > kFloat * ball.radius &&
         margin > kRounding * (size + (distance < kUnlimited ? distance : 0));
}

/// Whether candidates can be tracked, and nodes compared, in single precision.
bool canTrack(const KeptMeshes& meshes) {
  return isTaken(Shortcut::Coherence) &&
         (meshes.is_self ||
          RelativeFrame(meshes.first.tree(), meshes.second.tree(), meshes.to_first).isPrecise());
}

double largerEdge(const KeptMeshes& meshes) {
  return std::max(meanEdge(meshes.first.mesh), meanEdge(meshes.second.mesh));
}

SearchMargin costOf(const KeptMeshes& meshes, double distance) {
  constexpr double kFar = 8;  // edges; margins need not grow with the distance beyond that
  const double edge = largerEdge(meshes);
  return {std::min(distance, kFar * edge), edge};
}

/// Whether the n-th update without a margin records positions, to measure the motion of the next:
/// that takes about as long as the search of a small mesh.
bool measuresAfter(unsigned n) {
  constexpr unsigned kSeldom = 16;
  return n % kSeldom == 0 || (n < kSeldom && (n & (n - 1)) == 0);
}

}  // namespace

SetSearch SearchSchedule::next(const KeptMeshes& meshes, double distance, bool is_known) {
  motion_.moveTo(meshes);
  ++steps_;
  if (!canTrack(meshes)) return searchAll(meshes, distance, 0);
  if (!is_known) {
    constexpr double kSlow = 0.005;  // edges: nothing is known of the motion
    const double speed = kSlow * largerEdge(meshes);
    return searchAll(
        meshes, distance,
        margin_ > 0 ? margin_ : costOf(meshes, distance).choose(speed, SearchMargin::kUsual, 1));
  }
  return margin_ > 0 ? withMargin(meshes, distance) : withoutMargin(meshes, distance);
}

/// Searches everything again when that is cheaper than what has moved.
SetSearch SearchSchedule::withMargin(const KeptMeshes& meshes, double distance) {
  constexpr double kEnough = 1;   // searches: then one of everything is due
  constexpr double kMany = 0.25;  // share of the leaves that move in themselves
  const double usable = margin_ * kUsable, motion = motion_.sinceRestart();
  if (motion <= allowance_) return SetSearch::None;
  double fastest = motion / 2 / steps_, speed = fastest;
  if (!displacements_.isEmpty()) {
    displacements_.measure(meshes, usable);
    if (searches_ < kEnough && displacements_.moved() < kMany) {
      motion_.restart();
      allowance_ = usable - displacements_.largest();
      return allowance_ >= 0 ? SetSearch::None : SetSearch::Moved;
    }
    fastest = displacements_.deviation() / steps_;
    speed = std::max(displacements_.local(), (1 + searches_) * margin_) / 2 / steps_;
  } else if (motion == kUnlimited) {
    return searchAll(meshes, distance, margin_);
  }
  return searchAll(meshes, distance, nextMargin(meshes, distance, speed, fastest));
}

/// Chooses the margin after one that is used up. `speed`: of two points that are near each other;
/// `fastest`: of points anywhere, in case that the margin has cost more than expected.
double SearchSchedule::nextMargin(const KeptMeshes& meshes, double distance, double speed,
                                  double fastest) {
  constexpr double kMost = 0.9;  // largest cost of a step, in queries
  constexpr double kFew = 3;     // updates: too few to know the motion
  const SearchMargin cost = costOf(meshes, distance);
  const double tested = steps_ > 1 ? tested_ / (steps_ - 1) : SearchMargin::kUsual;
  const double spent =
      (1 + searches_) * cost.ofSearch(margin_) / steps_ + cost.ofTests(margin_, tested);
  const bool is_dear = spent > kMost;
  speed_ = std::min(is_dear ? std::max(speed, fastest) : speed, largerEdge(meshes));
  const double next = cost.choose(speed_, tested, kMost);
  return is_dear && (steps_ < kFew || next < 2 * margin_) ? 0 : next;
}

/// Begins with a margin if that pays for the motion of the last steps: the deviation of vertices
/// from the mean motion. Half of the largest motion bounds it; what part of that it is, is measured
/// in some steps.
SetSearch SearchSchedule::withoutMargin(const KeptMeshes& meshes, double distance) {
  constexpr double kMost = 0.75;  // largest cost of a step, in queries
  constexpr double kNew = 0.25;   // weight of the last step: a slow one alone does not count
  constexpr double kFast = 8;     // edges; whatever is faster leaves no pair as it was
  const double edge = largerEdge(meshes), largest = std::min(motion_.lastStep() / 2, kFast * edge);
  if (!displacements_.isEmpty() && largest > 0) {
    displacements_.measure(meshes, edge);
    deviating_ = std::min(1., displacements_.deviation() / largest);
  }
  speed_ += kNew * (deviating_ * largest - speed_);
  return searchAll(meshes, distance,
                   costOf(meshes, distance).choose(speed_, SearchMargin::kUsual, kMost));
}

/// Searches everything: within a margin, or anew if that is 0 or smaller than what single precision
/// can measure.
SetSearch SearchSchedule::searchAll(const KeptMeshes& meshes, double distance, double margin) {
  margin_ = isPreciseMargin(meshes, distance, margin) ? margin : 0;
  steps_ = searches_ = tested_ = 0;
  anew_ = margin_ > 0 ? 0 : anew_ + 1;
  return margin_ > 0 ? SetSearch::All : SetSearch::Anew;
}

void SearchSchedule::record(const KeptMeshes& meshes, SetSearch search, std::size_t found,
                            std::size_t candidates) {
  constexpr double kLeastCost = 0.002;  // of a search of what has moved, that finds nothing
  // Measuring more vertices than that would take longer than a search.
  constexpr std::size_t kVerticesPerCandidate = 4;
  if (search == SetSearch::Moved) {
    searches_ += kLeastCost + double(found) / double(std::max<std::size_t>(1, candidates));
    return;
  }
  motion_.restart();
  allowance_ = margin_ * kUsable;
  std::size_t vertices = 0;
  for (int side = 0; side < meshes.sides(); ++side) vertices += meshes.mesh(side).vertices.size();
  const bool is_worth = vertices <= kVerticesPerCandidate * candidates;
  if (is_worth && (margin_ > 0 || measuresAfter(anew_)))
    displacements_.restart(meshes);
  else
    displacements_.clear();
}

}  // namespace adaptive_bvh
