#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include <fcl/common/types.h>

#include "base/pack.h"
#include "base/rounding.h"

namespace adaptive_bvh {

/// Whether every coordinate is finite and small enough for the sums of squares of a fit
/// (rounding::largestCoordinate).
template <typename S>
bool usablePositions(const fcl::Vector3<S>* positions, std::size_t count) {
  const S limit = rounding::largestCoordinate<S>();
  bool usable = true;
  for (std::size_t i = 0; i < count; ++i)
    for (int k = 0; k < 3; ++k) usable &= std::abs(positions[i][k]) <= limit;  // false for NaN
  return usable;
}

/// A group of kPoints points, loaded from an array as three packs: the i-th number of all packs is
/// component i % 3 of point i / 3.
template <typename S>
struct PackedPoints {
  static constexpr std::size_t kPoints = packs::kSize<S>;

  static PackedPoints load(const fcl::Vector3<S>* from) {
    PackedPoints points;
    __builtin_memcpy(points.pack, from->data(), sizeof(points.pack));
    return points;
  }
  void store(fcl::Vector3<S>* to) const { __builtin_memcpy(to->data(), pack, sizeof(pack)); }
  /// Repeats one point.
  static PackedPoints repeated(const fcl::Vector3<S>& point) {
    PackedPoints points;
    for (std::size_t i = 0; i < 3 * kPoints; ++i)
      points.pack[i / kPoints][i % kPoints] = point[i % 3];
    return points;
  }
  PackedPoints operator-(const PackedPoints& other) const {
    return {{pack[0] - other.pack[0], pack[1] - other.pack[1], pack[2] - other.pack[2]}};
  }
  /// The squared lengths of the points.
  Pack<S> squares() const {
    const Pack<S> a = pack[0] * pack[0], b = pack[1] * pack[1], c = pack[2] * pack[2];
    if constexpr (kPoints == 2)
      return Pack<S>{a[0], b[1]} + Pack<S>{a[1], c[0]} + Pack<S>{b[0], c[1]};
    else
      return Pack<S>{a[0], a[3], b[2], c[1]} + Pack<S>{a[1], b[0], b[3], c[2]} +
             Pack<S>{a[2], b[1], c[0], c[3]};
  }

  Pack<S> pack[3];
};

/// Statistics of the positions and displacements of an update, gathered in one pass.
template <typename S>
struct VertexSummary {
  using Point = fcl::Vector3<S>;

  Point low = Point::Constant(std::numeric_limits<S>::max()),
        high = -low;  ///< bounding box of the positions
  S squared = 0;      ///< the largest squared displacement
  /// The sum of |x| + |y| + |z| over all displacements. It does not underflow, so it is 0 only if
  /// nothing moved; not finite if an old or a new position was not.
  S displacement_sum = 0;

  void add(const Point& position, const Point& displacement) {
    const S square = displacement[0] * displacement[0] + displacement[1] * displacement[1] +
                     displacement[2] * displacement[2];
    squared = std::max(squared, square);
    displacement_sum +=
        std::abs(displacement[0]) + std::abs(displacement[1]) + std::abs(displacement[2]);
    for (int k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], position[k]);
      high[k] = std::max(high[k], position[k]);
    }
  }
  /// Adds positions, given with their previous positions, in contiguous arrays.
  void add(const Point* positions, const Point* before, std::size_t count) {
    using Packed = PackedPoints<S>;
    Packed lows = Packed::repeated(low), highs = Packed::repeated(high);
    Pack<S> squares{}, sums{};
    std::size_t v = 0;
    for (; v + Packed::kPoints <= count; v += Packed::kPoints) {
      const Packed x = Packed::load(positions + v), d = x - Packed::load(before + v);
      squares = packs::upper<Pack<S>>(d.squares(), squares);  // ignores NaN
      sums += packs::absolute<Pack<S>>(d.pack[0]) + packs::absolute<Pack<S>>(d.pack[1]) +
              packs::absolute<Pack<S>>(d.pack[2]);
      for (int k = 0; k < 3; ++k) {
        lows.pack[k] = packs::lower<Pack<S>>(x.pack[k], lows.pack[k]);
        highs.pack[k] = packs::upper<Pack<S>>(x.pack[k], highs.pack[k]);
      }
    }
    for (std::size_t i = 0; i < 3 * Packed::kPoints; ++i) {
      const auto number = [&](const Packed& points) -> S {
        return points.pack[i / Packed::kPoints][i % Packed::kPoints];
      };
      low[i % 3] = std::min(low[i % 3], number(lows));
      high[i % 3] = std::max(high[i % 3], number(highs));
    }
    displacement_sum += packs::sum(sums);
    squared = std::max(squared, packs::largest(squares));
    for (; v < count; ++v) add(positions[v], positions[v] - before[v]);
  }
  void add(const VertexSummary& other) {
    squared = std::max(squared, other.squared);
    displacement_sum += other.displacement_sum;
    low = low.cwiseMin(other.low);
    high = high.cwiseMax(other.high);
  }

  bool moved() const { return displacement_sum != 0; }

  /// True only if all positions are finite and within the limits. May be false for usable positions
  /// if an old position was not finite.
  bool isSurelyUsable(S limit = rounding::largestCoordinate<S>()) const {
    return std::isfinite(displacement_sum) && low.minCoeff() >= -limit && high.maxCoeff() <= limit;
  }

  /// The largest displacement, rounded up; not finite if an old position was not.
  S largestDisplacement() const {
    if (!std::isfinite(displacement_sum)) return displacement_sum;
    return moved() ? std::sqrt(squared) * (1 + 4 * rounding::epsilon<S>()) + rounding::tiny<S>()
                   : 0;
  }
};

/// Copies a contiguous array of points, also to a second array unless that is null. Returns the
/// largest squared distance from `middle`.
template <typename S>
S copyPoints(const fcl::Vector3<S>* from, std::size_t count, const fcl::Vector3<S>& middle,
             fcl::Vector3<S>* to, fcl::Vector3<S>* second = nullptr) {
  using Packed = PackedPoints<S>;
  const Packed middles = Packed::repeated(middle);
  Pack<S> squares{};
  std::size_t v = 0;
  for (; v + Packed::kPoints <= count; v += Packed::kPoints) {
    const Packed x = Packed::load(from + v);
    x.store(to + v);
    if (second) x.store(second + v);
    squares = packs::upper<Pack<S>>((x - middles).squares(), squares);
  }
  S most = packs::largest(squares);
  for (; v < count; ++v) {
    const fcl::Vector3<S> x = from[v], d = x - middle;
    to[v] = x;
    if (second) second[v] = x;
    most = std::max(most, d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
  }
  return most;
}

}  // namespace adaptive_bvh
