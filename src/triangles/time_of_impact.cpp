#include "triangles/time_of_impact.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "triangles/feature_distance.h"

namespace adaptive_bvh {
namespace {

using Vector = MovingFeatures::Point;
using Corners = std::array<Vector, 4>;

constexpr double kUnit = std::numeric_limits<double>::epsilon() / 2;

/// Of length one, or zero where that is not sure.
Vector unit(const Vector& direction) {
  const double length = direction.norm();
  return length > 1e-150 ? Vector(direction / length) : Vector(Vector::Zero());
}

/// Unit vectors along which features may be apart: from the second to the first.
class Directions {
 public:
  static constexpr int kCount = 5;

  Directions(int firsts, const Corners& at) : firsts_(firsts) {
    edges_[0] = firsts == 1 ? at[2] - at[1] : at[1] - at[0];
    edges_[1] = at[3] - at[2];
    edges_[2] = at[3] - at[1];
    difference_ = (firsts == 1 ? vertexFaceDistance<double>(at[0], {at[1], at[2], at[3]})
                               : edgeEdgeDistance<double>({at[0], at[1]}, {at[2], at[3]}))
                      .difference();
  }

  /// The likeliest first. Zero where there is none. Near contact the difference of the nearest
  /// points has lost its digits; the normal has not, nor what is at right angles to an edge. The
  /// normal of edges at an angle of a has an error of 2^-53 / a; when it is made perpendicular to
  /// one of them, what is left is in the plane of both, where the features are only a times their
  /// length wide.
  Vector operator[](int k) const {
    if (k == 0) return unit(difference_);
    if (k == 1) {
      const Vector normal = perpendicular(edges_[0].cross(edges_[1]), edges_[0]);
      return unit(normal.dot(difference_) < 0 ? Vector(-normal) : normal);
    }
    if (firsts_ == 2 && k == 4) return Vector::Zero();
    return unit(perpendicular(difference_, edges_[k - 2]));
  }

 private:
  static Vector perpendicular(const Vector& x, const Vector& edge) {
    const double square = edge.squaredNorm();
    if (!(square > 0)) return Vector::Zero();
    const Vector once = x - (x.dot(edge) / square) * edge;
    return once - (once.dot(edge) / square) * edge;
  }

  int firsts_;
  Vector edges_[3], difference_;
};

}  // namespace

MovingFeatures::MovingFeatures(FeatureKind kind, const Corners& start, const Corners& end,
                               double error)
    : firsts_(kind == FeatureKind::EdgeEdge ? 2 : 1) {
  double apart = 0, moved = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    start_[i] = start[i] - start[0];
    motion_[i] = end[i] - start[i];
    apart = std::max(apart, start_[i].lpNorm<1>());
    moved = std::max(moved, motion_[i].lpNorm<1>());
  }
  slack_ = 64 * kUnit * (apart + moved) + 4 * error + std::numeric_limits<double>::min();
}

Corners MovingFeatures::at(double t) const {
  Corners corners;
  for (std::size_t i = 0; i < 4; ++i) corners[i] = start_[i] + t * motion_[i];
  return corners;
}

/// How long the features stay apart by more than `target` along a direction; 0 when they are not.
double MovingFeatures::stepAlong(const Point& direction, const Corners& now, double target) const {
  double place[4], speed[4];
  for (std::size_t i = 0; i < 4; ++i) {
    place[i] = direction.dot(now[i]);
    speed[i] = direction.dot(motion_[i]);
  }
  double step = kNever;
  for (int i = 0; i < firsts_; ++i)
    for (int j = firsts_; j < 4; ++j) {
      const double gap = place[i] - place[j] - target, closing = speed[j] - speed[i];
      if (!(gap > 0)) return 0;
      if (gap < closing * step) step = gap / closing;
    }
  return step;
}

/// As above, along a direction that turns from the one at `now` to the one at `later`: for which
/// share of the time between. The gap of two corners is a quadratic polynomial in time, which lies
/// in the hull of its Bernstein coefficients.
double MovingFeatures::shareAlong(const Point& direction, const Corners& now,
                                  const Point& later_direction, const Corners& later,
                                  double target) const {
  double places[4][4];  // now, now to later, later to now, later
  for (std::size_t i = 0; i < 4; ++i) {
    places[0][i] = direction.dot(now[i]);
    places[1][i] = direction.dot(later[i]);
    places[2][i] = later_direction.dot(now[i]);
    places[3][i] = later_direction.dot(later[i]);
  }
  double share = 1;
  for (int i = 0; i < firsts_; ++i)
    for (int j = firsts_; j < 4; ++j) {
      const auto gap = [&](int k) { return places[k][i] - places[k][j] - target; };
      const double first = gap(0), middle = (gap(1) + gap(2)) / 2, last = gap(3);
      if (!(first > 0)) return 0;
      if (last < 0) share = std::min(share, first / (first - last));
      if (middle <= 0)
        share = std::min(share, first / (2 * (first - middle)));
      else if (last < 0)
        share = std::min(share, (1 + middle / (middle - last)) / 2);
    }
  return share;
}

double MovingFeatures::timeOfImpact(double separation, double until) const {
  // Nearly all pairs take fewer than 20. Edges that turn and stay nearly parallel and near each
  // other take thousands; to end sooner would report an impact that never happens.
  constexpr int kMostSteps = 20000;
  const double target = separation * (1 + 4 * kUnit) + slack_;
  double t = 0, look = 4;  // so much farther than along one direction
  for (int count = 0; count < kMostSteps; ++count) {
    const Corners now = at(t);
    const Directions directions(firsts_, now);
    double step = 0;
    int best = 0;
    for (int k = 0; k < Directions::kCount; ++k) {
      const double along = stepAlong(directions[k], now, target) * (1 - 4 * kUnit);
      if (t + along > until) return kNever;
      if (along > step) best = k;
      step = std::max(step, along);
    }
    if (!(t + step > t * (1 + 16 * kUnit))) return t;
    const double farther = std::min(t + look * step, 1.);
    const Corners later = at(farther);
    const Point direction = directions[best];
    Point turned = Directions(firsts_, later)[best];
    if (turned.dot(direction) < 0) turned = -turned;
    const double share = shareAlong(direction, now, turned, later, target);
    look = share == 1 ? 8 * look : std::max(2., 2 * share * look);
    t = std::max(t + step, t + share * (1 - 4 * kUnit) * (farther - t));
  }
  return t;
}

double MovingFeatures::distanceAtStart() const {
  const Directions directions(firsts_, start_);
  double bound = 0;
  for (int k = 0; k < Directions::kCount; ++k)
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
