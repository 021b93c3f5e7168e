#pragma once

#include <array>
#include <limits>

#include <Eigen/Core>

#include "adaptive_bvh/feature_pairs.h"

namespace adaptive_bvh {

/// The four corners of a pair of features, each on a straight line: start + t * motion, t from 0 to
/// 1. From positions in any place: what counts for rounding is how far the corners are from each
/// other and move.
class MovingFeatures {
 public:
  using Point = Eigen::Vector3d;

  /// No impact before the end.
  static constexpr double kNever = std::numeric_limits<double>::infinity();

  /// Corners: of a vertex and a face the vertex first, whichever mesh it is of; of two edges those
  /// of the first first. `error`: how far each position may be from the exact one.
  MovingFeatures(FeatureKind kind, const std::array<Point, 4>& start,
                 const std::array<Point, 4>& end, double error = 0);

  /// A time up to which the features are surely farther apart than `separation`, the largest that
  /// rounding lets it find; kNever when that holds up to `until`. 0 when they are as near at the
  /// start. Never later than the first time at which the exact ones are as near;
  /// docs/bounds.md, 15. The same numbers give the same time, whatever `until` is, if it is not
  /// kNever.
  double timeOfImpact(double separation, double until = 1) const;

  /// A lower bound of the distance at the start.
  double distanceAtStart() const;

 private:
  using Corners = std::array<Point, 4>;
  struct Turn;

  Corners at(double t) const;
  double stepAlong(const Point& direction, const Corners& now, double target) const;
  double shareAlong(const Turn& turn, const Corners& now, const Corners& later,
                    double target) const;
  double gapAlong(const Point& direction, const Corners& now) const;

  int firsts_;  ///< corners of the first feature
  Corners start_, motion_;
  double slack_;
};

}  // namespace adaptive_bvh
