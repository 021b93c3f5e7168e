#pragma once

#include "geometry/vectors.h"

namespace adaptive_bvh {

/// The rectangle in the plane z = middle with which the least sphere, of half the thickness, holds
/// some points: after Larsen et al. (1999), PQP. Over a point at height h the sphere reaches w =
/// sqrt(r^2 - h^2) within the plane, so the rectangle may end w short of it. Points beyond two
/// sides at once may lie outside the round corner: there both sides grow. All points are to be
/// added, then `close`, then all as corners, then `finish`. docs/bounds.md, 11.
///
/// Each lane has a rectangle of its own; or all have points of one set, and the caller puts
/// together what they found, before `close` and after `finish`.
template <typename P>
class SlabRectangle {
 public:
  using Points = Vectors<P>;

  ADAPTIVE_BVH_INLINE SlabRectangle(const P& low_z, const P& high_z)
      : middle((low_z + high_z) * 0.5f), radius((high_z - low_z) * 0.5f) {}

  ADAPTIVE_BVH_INLINE void add(const Points& at) {
    const P w = packs::squareRoot(squaredHalfChord(at.z));
    low[0] = packs::lower<P>(low[0], at.x + w);
    high[0] = packs::upper<P>(high[0], at.x - w);
    low[1] = packs::lower<P>(low[1], at.y + w);
    high[1] = packs::upper<P>(high[1], at.y - w);
  }
  /// An empty side becomes its middle: every ball then reaches the point from both sides.
  ADAPTIVE_BVH_INLINE void close() {
    for (int k = 0; k < 2; ++k) {
      const P half = (low[k] + high[k]) * 0.5f;
      const auto is_empty = low[k] > high[k];
      low[k] = is_empty ? half : low[k];
      high[k] = is_empty ? half : high[k];
    }
  }

  /// Lets both sides grow by the least equal step that reaches a point beyond them: by dx and dy.
  /// The step is the smaller root g of (dx - g)^2 + (dy - g)^2 = w^2.
  ADAPTIVE_BVH_INLINE void addCorner(const Points& at) {
    const P none{};
    const P dx = packs::upper<P>(low[0] - at.x, at.x - high[0]),
            dy = packs::upper<P>(low[1] - at.y, at.y - high[1]), w2 = squaredHalfChord(at.z);
    const auto is_beyond = (dx > none) & (dy > none) & (dx * dx + dy * dy > w2);
    if (packs::bits(is_beyond) == 0) return;
    const P difference = dx - dy;
    const P root = packs::squareRoot(packs::upper<P>(w2 + w2 - difference * difference, none));
    const P step = is_beyond ? (dx + dy - root) * 0.5f : none;
    const auto left = at.x < low[0], below = at.y < low[1];
    growth_low_[0] = packs::upper<P>(growth_low_[0], left ? step : none);
    growth_high_[0] = packs::upper<P>(growth_high_[0], left ? none : step);
    growth_low_[1] = packs::upper<P>(growth_low_[1], below ? step : none);
    growth_high_[1] = packs::upper<P>(growth_high_[1], below ? none : step);
  }
  ADAPTIVE_BVH_INLINE void finish() {
    for (int k = 0; k < 2; ++k) {
      low[k] -= growth_low_[k];
      high[k] += growth_high_[k];
    }
  }

  P middle, radius;
  P low[2] = {packs::filled<P>(kFar), packs::filled<P>(kFar)},
    high[2] = {packs::filled<P>(-kFar), packs::filled<P>(-kFar)};

 private:
  static constexpr float kFar = 1e30f;

  /// w^2.
  ADAPTIVE_BVH_INLINE P squaredHalfChord(const P& z) const {
    const P height = z - middle;
    return packs::upper<P>(radius * radius - height * height, P{});
  }

  P growth_low_[2] = {}, growth_high_[2] = {};
};

}  // namespace adaptive_bvh
