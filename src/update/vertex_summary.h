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
  S sum = 0;      ///< of all squares; not finite when an old or a new position was not
  bool moved = false;

  void add(const Point& position, const Point& displacement) {
    const S square = displacement[0] * displacement[0] + displacement[1] * displacement[1] +
                     displacement[2] * displacement[2];
    squared = std::max(squared, square);
    sum += square;
    moved |= (displacement[0] != 0) | (displacement[1] != 0) | (displacement[2] != 0);
    for (int k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], position[k]);
      high[k] = std::max(high[k], position[k]);
    }
  }
  void add(const VertexSummary& other) {
    squared = std::max(squared, other.squared);
    sum += other.sum;
    moved |= other.moved;
    low = low.cwiseMin(other.low);
    high = high.cwiseMax(other.high);
  }

  /// True: all positions are finite and within the limits. May be false although they are, when an
  /// old position was not finite.
  bool isSurelyUsable() const {
    const S limit = rounding::largestCoordinate<S>();
    return std::isfinite(sum) && low.minCoeff() >= -limit && high.maxCoeff() <= limit;
  }

  /// Rounded up; not finite when an old position was not.
  S largestDisplacement() const {
    if (!std::isfinite(sum)) return sum;
    return moved ? std::sqrt(squared) * (1 + 4 * rounding::epsilon<S>()) + rounding::tiny<S>() : 0;
  }
};

}  // namespace adaptive_bvh
