#pragma once

#include <array>
#include <limits>

#include <Eigen/Core>

#include "adaptive_bvh/feature_pairs.h"

namespace adaptive_bvh {

/// A pair of features, a vertex and a face or two edges, whose four corners move in straight lines:
/// start + t * motion, t from 0 to 1. Rounding errors depend on the corners' distances from each
/// other and on their motions, not on where the pair is.
class MovingFeatures {
 public:
  using Point = Eigen::Vector3d;

  /// No impact before the end.
  static constexpr double kNever = std::numeric_limits<double>::infinity();

  /// Corners: for a vertex and a face the vertex first, whichever mesh it belongs to; for two edges
  /// the corners of the first edge first. `error` bounds the error of each position.
  MovingFeatures(FeatureKind kind, const std::array<Point, 4>& start,
                 const std::array<Point, 4>& end, double error = 0);

  /// Returns a time up to which the features certainly stay farther apart than `separation`, as
  /// late as rounding allows; kNever if that holds up to `until`; 0 if they are not farther apart
  /// at the start. Never later than the exact time of impact; docs/bounds.md, 15. A result other
  /// than kNever does not depend on `until`.
  double timeOfImpact(double separation, double until = 1) const;

  /// A lower bound of the distance at the start.
  double distanceAtStart() const;

 private:
  using Corners = std::array<Point, 4>;
  struct Turn;

  Corners cornersAt(double t) const;
  /// The time from `now` for which the features stay farther apart than `target` along a direction;
  /// 0 if they are not farther apart now.
  double stepAlong(const Point& direction, const Corners& now, double target) const;
  /// The share of the time between `now` and `later` for which the features stay farther apart than
  /// `target` along a direction that rotates in between.
  double shareAlong(const Turn& turn, const Corners& now, const Corners& later,
                    double target) const;
  /// The gap of the features along a unit direction from the second to the first; may be negative.
  double gapAlong(const Point& direction, const Corners& now) const;

  int firsts_;              ///< number of corners of the first feature
  Corners start_, motion_;  ///< positions relative to the first corner's start; displacements
  double slack_;            ///< bound of the rounding and input errors of a gap
};

}  // namespace adaptive_bvh
