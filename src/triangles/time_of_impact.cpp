#include "triangles/time_of_impact.h"

#include <algorithm>
#include <cmath>

#include "triangles/feature_directions.h"

namespace adaptive_bvh {
namespace {

using Corners = std::array<MovingFeatures::Point, 4>;

constexpr double kUnit = std::numeric_limits<double>::epsilon() / 2;  // unit roundoff

/// A lower bound of the first zero on [0, 1] of a cubic polynomial given by its Bernstein
/// coefficients: the first zero of their convex hull; 1 if there is none, 0 if the polynomial
/// begins at zero or below.
double firstZero(const std::array<double, 4>& coefficients) {
  if (!(coefficients[0] > 0)) return 0;
  double zero = 1;
  // Lines from a positive coefficient i to a later one that is not positive. (If an earlier one is
  // not positive, the line from coefficient 0 to that one meets 0 earlier.)
  for (int i = 0; i < 4; ++i)
    for (int j = i + 1; j < 4; ++j) {
      const double above = coefficients[std::size_t(i)], below = coefficients[std::size_t(j)];
      if (above > 0 && below <= 0)
        zero = std::min(zero, (i + (j - i) * (above / (above - below))) / 3);
    }
  return zero;
}

}  // namespace

/// A direction that rotates over time: a quadratic curve through the directions at the begin, in
/// the middle and at the end of a time interval, as Bernstein coefficients.
struct MovingFeatures::Turn {
  Point control[3];
  double length;  ///< upper bound of the vectors' lengths

  /// A direction and its opposite separate equally well, so signs are chosen for a short curve.
  Turn(const Point& now, Point middle, Point later) {
    if (middle.dot(now) < 0) middle = -middle;
    if (later.dot(middle) < 0) later = -later;
    control[0] = now;
    control[1] = 2 * middle - (now + later) / 2;
    control[2] = later;
    length = std::max(1., control[1].norm() * (1 + 8 * kUnit));
  }
};

MovingFeatures::MovingFeatures(FeatureKind kind, const Corners& start, const Corners& end,
                               double error)
    : firsts_(kind == FeatureKind::EdgeEdge ? 2 : 1) {
  double apart = 0, moved = 0;  // the largest 1-norms
  for (std::size_t i = 0; i < 4; ++i) {
    start_[i] = start[i] - start[0];
    motion_[i] = end[i] - start[i];
    apart = std::max(apart, start_[i].lpNorm<1>());
    moved = std::max(moved, motion_[i].lpNorm<1>());
  }
  slack_ = 64 * kUnit * (apart + moved) + 4 * error + std::numeric_limits<double>::min();
}

Corners MovingFeatures::cornersAt(double t) const {
  Corners corners;
  for (std::size_t i = 0; i < 4; ++i) corners[i] = start_[i] + t * motion_[i];
  return corners;
}

double MovingFeatures::stepAlong(const Point& direction, const Corners& now, double target) const {
  double position[4], speed[4];
  for (std::size_t i = 0; i < 4; ++i) {
    position[i] = direction.dot(now[i]);
    speed[i] = direction.dot(motion_[i]);
  }
  double step = kNever;
  for (int i = 0; i < firsts_; ++i)
    for (int j = firsts_; j < 4; ++j) {
      const double gap = position[i] - position[j] - target, closing = speed[j] - speed[i];
      if (!(gap > 0)) return 0;
      if (gap < closing * step) step = gap / closing;
    }
  return step;
}

/// The gap of two corners along the direction is a cubic polynomial in time, which lies in the
/// convex hull of its Bernstein coefficients.
double MovingFeatures::shareAlong(const Turn& turn, const Corners& now, const Corners& later,
                                  double target) const {
  double positions[3][2][4];  // along each control vector, now and later
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t i = 0; i < 4; ++i) {
      positions[k][0][i] = turn.control[k].dot(now[i]);
      positions[k][1][i] = turn.control[k].dot(later[i]);
    }
  const double least = target * turn.length;
  double share = 1;
  for (int i = 0; i < firsts_; ++i)
    for (int j = firsts_; j < 4; ++j) {
      const auto gap = [&](int k, int end) {
        return positions[k][end][i] - positions[k][end][j] - least;
      };
      share = std::min(share, firstZero({gap(0, 0), (gap(0, 1) + 2 * gap(1, 0)) / 3,
                                         (2 * gap(1, 1) + gap(2, 0)) / 3, gap(2, 1)}));
    }
  return share;
}

/// Conservative advancement: each step leads to a time up to which the features certainly stay
/// apart, along one direction (stepAlong) or, farther, along a direction that rotates (shareAlong).
double MovingFeatures::timeOfImpact(double separation, double until) const {
  // Nearly all pairs take fewer than 20 steps. Edges that rotate and stay nearly parallel and near
  // each other take hundreds; to end sooner would report an impact that never happens.
  constexpr int kMostSteps = 20000;
  const double target = separation * (1 + 4 * kUnit) + slack_;
  double t = 0, look_ahead = 4;  // as a multiple of the step along one direction
  for (int count = 0; count < kMostSteps; ++count) {
    const double least = t * (1 + 16 * kUnit);  // a later time counts as progress
    const Corners now = cornersAt(t);
    const FeatureDirections directions(firsts_, now);
    double step = 0;
    int best = 0;
    for (int k = 0; k < FeatureDirections::kCount; ++k) {
      const double along = stepAlong(directions[k], now, target) * (1 - 4 * kUnit);
      if (t + along > std::max(until, least)) return kNever;
      if (along > step) best = k;
      step = std::max(step, along);
    }
    if (!(t + step > least)) return t;
    const double end = std::min(t + look_ahead * step, 1.);
    const Corners later = cornersAt(end);
    const Turn turn(directions[best], FeatureDirections(firsts_, cornersAt((t + end) / 2))[best],
                    FeatureDirections(firsts_, later)[best]);
    const double share = shareAlong(turn, now, later, target);
    look_ahead = share == 1 ? 8 * look_ahead : std::max(2., 2 * share * look_ahead);
    t = std::max(t + step, t + share * (1 - 4 * kUnit) * (end - t));
  }
  return t;
}

double MovingFeatures::distanceAtStart() const {
  const FeatureDirections directions(firsts_, start_);
  double bound = 0;
  for (int k = 0; k < FeatureDirections::kCount; ++k)
    bound = std::max(bound, gapAlong(directions[k], start_) - slack_);
  return bound;
}

double MovingFeatures::gapAlong(const Point& direction, const Corners& now) const {
  double gap = kNever;
  for (int i = 0; i < firsts_; ++i)
    for (int j = firsts_; j < 4; ++j)
      gap = std::min(gap, direction.dot(now[std::size_t(i)]) - direction.dot(now[std::size_t(j)]));
  return gap;
}

}  // namespace adaptive_bvh
