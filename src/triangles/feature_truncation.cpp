#include "triangles/feature_truncation.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "triangles/feature_directions.h"

namespace adaptive_bvh {
namespace {

constexpr double kRoundoff = std::numeric_limits<double>::epsilon() / 2;
constexpr double kNoPlane = std::numeric_limits<double>::infinity();

/// Bounds of the errors of a position that is computed on the way of a corner, within its share. A
/// coordinate that does not change has no rounding error.
Eigen::Vector3d errorOnTheWay(const FeatureTruncation::Corner& corner) {
  Eigen::Vector3d error;
  for (int k = 0; k < 3; ++k) {
    const double from = (*corner.start)[k], to = (*corner.end)[k];
    const double rounding =
        4 * corner.unit * (*corner.share * std::abs(to - from) + std::abs(from));
    error[k] = corner.error + (from == to ? 0 : rounding);
  }
  return error;
}

}  // namespace

FeatureTruncation::FeatureTruncation(int firsts, const std::array<Corner, 4>& corners,
                                     double separation)
    : firsts_(firsts), corners_(corners), separation_(separation * (1 + 16 * kRoundoff)) {
  double apart = 0, moved = 0;  // the largest 1-norms
  for (std::size_t i = 0; i < 4; ++i) {
    start_[i] = *corners[i].start - *corners[0].start;
    motion_[i] = *corners[i].end - *corners[i].start;
    error_[i] = errorOnTheWay(corners[i]);
    length_[i] = motion_[i].norm();
    apart = std::max(apart, start_[i].lpNorm<1>());
    moved = std::max(moved, *corners[i].share * motion_[i].lpNorm<1>());
  }
  slack_ = 64 * kRoundoff * (apart + moved) + std::numeric_limits<double>::min();
}

bool FeatureTruncation::isAtRest() const {
  for (std::size_t i = 0; i < 4; ++i)
    if (*corners_[i].share > 0 && !motion_[i].isZero(0)) return false;
  return true;
}

FeatureTruncation::Point FeatureTruncation::relativeMotion() const {
  Point sums[2] = {Point::Zero(), Point::Zero()};
  for (std::size_t i = 0; i < 4; ++i) sums[int(i) >= firsts_] += *corners_[i].share * motion_[i];
  return sums[0] / firsts_ - sums[1] / (4 - firsts_);
}

FeatureTruncation::Heights FeatureTruncation::heightsAlong(const Point& direction) const {
  Heights heights;
  for (double* least : {heights.support, heights.wanted}) least[0] = least[1] = kNoPlane;
  const Point sizes = direction.cwiseAbs();
  for (std::size_t i = 0; i < 4; ++i) {
    const int side = int(i) >= firsts_;
    const double sign = side ? -1 : 1;
    const double start = sign * direction.dot(start_[i]) - sizes.dot(error_[i]);
    double rise = sign * direction.dot(motion_[i]);
    if (std::abs(rise) < 8 * kRoundoff * motion_[i].lpNorm<1>()) rise = 0;  // rounding
    heights.start[i] = start;
    heights.rise[i] = rise;
    heights.support[side] = std::min(heights.support[side], start);
    heights.wanted[side] =
        std::min(heights.wanted[side], start + *corners_[i].share * std::min(0., rise));
  }
  heights.gap = heights.support[0] + heights.support[1] - slack_;
  return heights;
}

bool FeatureTruncation::isFree(const Heights& heights) const {
  return heights.gap > separation_ &&
         heights.support[0] - heights.wanted[0] + (heights.support[1] - heights.wanted[1]) <=
             heights.gap - separation_;
}

/// The floors of both features add up to the separation. Each gets a part of what is free in
/// proportion to how far it would go.
FeatureTruncation::Cut FeatureTruncation::cutAt(const Heights& heights, double separation) const {
  const double free = heights.gap - separation;
  const double approach[2] = {heights.support[0] - heights.wanted[0],
                              heights.support[1] - heights.wanted[1]};
  const double sum = approach[0] + approach[1], part = sum > free ? free / sum : 1;
  Cut cut;
  for (std::size_t i = 0; i < 4; ++i) {
    const int side = int(i) >= firsts_;
    const double room = heights.start[i] - (heights.support[side] - part * approach[side]);
    const double share = *corners_[i].share, rise = heights.rise[i];
    cut.shares[i] = room < -share * rise && part < 1 ? room / -rise * (1 - 4 * kRoundoff) : share;
    cut.loss += (share - cut.shares[i]) * length_[i];
  }
  return cut;
}

/// The separation, or a little less than the distance at the start.
double FeatureTruncation::separationToKeep(const Candidates& candidates) const {
  double largest = 0;
  for (const Heights& heights : candidates) largest = std::max(largest, heights.gap);
  return largest > separation_ ? separation_ : (1 - kNearer) * largest;
}

/// The cut with the least loss. Most pairs that lose nothing are separated along one of the first
/// two directions.
FeatureTruncation::Cut FeatureTruncation::bestCut() const {
  const FeatureDirections directions(firsts_, start_);
  Candidates all;
  all[0] = heightsAlong(directions[0]);
  if (isFree(all[0])) return {};
  all[1] = heightsAlong(directions.across(relativeMotion()));
  if (isFree(all[1])) return {};
  for (int k = 1; k < FeatureDirections::kCount; ++k)
    all[std::size_t(k) + 1] = heightsAlong(directions[k]);
  const double separation = separationToKeep(all);
  Cut best;
  best.loss = kNoPlane;
  for (const Heights& heights : all) {
    if (!(heights.gap > 0 && heights.gap >= separation)) continue;
    const Cut cut = cutAt(heights, separation);
    if (cut.loss < best.loss) best = cut;
  }
  return best;
}

void FeatureTruncation::lowerShares() const {
  if (isAtRest()) return;
  const Cut cut = bestCut();
  if (cut.loss == 0) return;
  for (std::size_t i = 0; i < 4; ++i)
    if (!motion_[i].isZero(0)) *corners_[i].share = std::min(*corners_[i].share, cut.shares[i]);
}

}  // namespace adaptive_bvh
