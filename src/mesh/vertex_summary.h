#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include <fcl/geometry/collision_geometry.h>

#include "base/rounding.h"

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

/// The box around some positions, at least one.
template <typename S>
struct LocalBox {
  LocalBox(const fcl::Vector3<S>* positions, std::size_t count)
      : low(positions[0]), high(positions[0]) {
    for (std::size_t i = 1; i < count; ++i) {
      low = low.cwiseMin(positions[i]);
      high = high.cwiseMax(positions[i]);
    }
  }

  fcl::Vector3<S> low, high;
};

/// Sets the local box of a geometry, and its centre.
template <typename S>
void setLocalBox(fcl::CollisionGeometry<S>& geometry, const fcl::Vector3<S>& low,
                 const fcl::Vector3<S>& high) {
  geometry.aabb_local.min_ = low;
  geometry.aabb_local.max_ = high;
  geometry.aabb_center = geometry.aabb_local.center();
}

/// Updates the local box of a geometry for new positions of some vertices. If a vertex moves away
/// from a side of the box, that side has to be computed from all vertices.
template <typename S>
class BoxAfterSome {
 public:
  explicit BoxAfterSome(const fcl::CollisionGeometry<S>& geometry)
      : low_(geometry.aabb_local.min_), high_(geometry.aabb_local.max_) {}

  /// A vertex moves.
  void move(const fcl::Vector3<S>& from, const fcl::Vector3<S>& to) {
    for (int k = 0; k < 3; ++k) {
      leaves_side_ = leaves_side_ || (from[k] == low_[k] && to[k] > from[k]) ||
                     (from[k] == high_[k] && to[k] < from[k]);
      low_[k] = std::min(low_[k], to[k]);
      high_[k] = std::max(high_[k], to[k]);
    }
    squared_ = std::max(squared_, (to - from).squaredNorm());
  }
  /// The largest one.
  S squaredDisplacement() const { return squared_; }

  /// After the last position is written: sets box, centre and radius. The radius is half the box's
  /// diagonal, rounded up: it holds all vertices, though not tightly.
  void finish(const fcl::Vector3<S>* vertices, std::size_t count,
              fcl::CollisionGeometry<S>& geometry) const {
    fcl::Vector3<S> low = low_, high = high_;
    if (leaves_side_) {
      const LocalBox<S> all(vertices, count);
      low = all.low;
      high = all.high;
    }
    setLocalBox(geometry, low, high);
    const fcl::Vector3<S>& center = geometry.aabb_center;
    geometry.aabb_radius =
        rounding::norm<S>(fcl::Vector3<S>((high - center).cwiseMax(center - low)));
  }

 private:
  fcl::Vector3<S> low_, high_;
  bool leaves_side_ = false;
  S squared_ = 0;
};

}  // namespace adaptive_bvh
