#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/rounding.h"

namespace adaptive_bvh {

/// True when every coordinate is finite and small enough for the sums of squares of a fit
/// (rounding::largestCoordinate).
template <typename S>
bool usablePositions(const fcl::Vector3<S>* positions, std::size_t count) {
  const S limit = rounding::largestCoordinate<S>();
  bool usable = true;
  for (std::size_t i = 0; i < count; ++i)
    for (int k = 0; k < 3; ++k) usable &= std::abs(positions[i][k]) <= limit;  // false for NaN
  return usable;
}

/// All that a step needs to know of its positions, gathered while they are read.
template <typename S>
struct VertexSummary {
  using Point = fcl::Vector3<S>;

  Point low = Point::Constant(std::numeric_limits<S>::max()), high = -low;  ///< of positions
  S squared = 0;  ///< the largest displacement
  /// The sum of all displacements, as |x| + |y| + |z|: 0 only when nothing moved, for it does not
  /// underflow; not finite when an old or a new position was not.
  S way = 0;

  void add(const Point& position, const Point& displacement) {
    const S square = displacement[0] * displacement[0] + displacement[1] * displacement[1] +
                     displacement[2] * displacement[2];
    squared = std::max(squared, square);
    way += std::abs(displacement[0]) + std::abs(displacement[1]) + std::abs(displacement[2]);
    for (int k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], position[k]);
      high[k] = std::max(high[k], position[k]);
    }
  }
  void add(const VertexSummary& other) {
    squared = std::max(squared, other.squared);
    way += other.way;
    low = low.cwiseMin(other.low);
    high = high.cwiseMax(other.high);
  }

  bool moved() const { return way != 0; }

  /// True: all positions are finite and within the limits. May be false although they are, when an
  /// old position was not finite.
  bool isSurelyUsable() const {
    const S limit = rounding::largestCoordinate<S>();
    return std::isfinite(way) && low.minCoeff() >= -limit && high.maxCoeff() <= limit;
  }

  /// Rounded up; not finite when an old position was not.
  S largestDisplacement() const {
    if (!std::isfinite(way)) return way;
    return moved() ? std::sqrt(squared) * (1 + 4 * rounding::epsilon<S>()) + rounding::tiny<S>()
                   : 0;
  }
};

}  // namespace adaptive_bvh
