#pragma once

#include "base/vectors.h"
#include "thesis/volumes/kept_axes.h"

// Also compiled for AVX2: see thesis/volumes/fit_kernels.h.

namespace adaptive_bvh {

/// Operations that depend on the pack's size.
template <typename P>
struct Lanes;

template <>
struct Lanes<Float4> {
  static constexpr int kCount = 4;

  /// Gathers vectors; load(k) is the vector of lane k.
  template <typename Load>
  ADAPTIVE_BVH_INLINE static Vectors<Float4> gather(Load&& load) {
    return float4::columns(load(0), load(1), load(2), load(3));
  }
  /// Gathers all four numbers of load(k).
  template <typename Load>
  ADAPTIVE_BVH_INLINE static void gather4(Load&& load, Float4 (&numbers)[4]) {
    const float4::Rows rows = float4::transposed(load(0), load(1), load(2), load(3));
    numbers[0] = rows.x;
    numbers[1] = rows.y;
    numbers[2] = rows.z;
    numbers[3] = rows.w;
  }
  /// The largest number of each pack.
  ADAPTIVE_BVH_INLINE static Float4 largest(const Float4& a, const Float4& b, const Float4& c,
                                            const Float4& d) {
    const float4::Rows rows = float4::transposed(a, b, c, d);
    return float4::upper(float4::upper(rows.x, rows.y), float4::upper(rows.z, rows.w));
  }

  /// Converts half of the lanes to double precision.
  using Doubles = Pack<double>;
  template <int kHalf>
  ADAPTIVE_BVH_INLINE static Doubles widened(const Float4& v) {
    return kHalf == 0 ? float4::widenedXy(v) : float4::widenedZw(v);
  }
};

/// The surface area of the set of points within r of an a x b rectangle.
template <typename N>
ADAPTIVE_BVH_INLINE N sweptArea(const N& a, const N& b, const N& r) {
  constexpr float kPi = 3.14159265f;
  return 2 * a * b + 2 * kPi * r * (a + b + 2 * r);
}

/// Finds the rectangle in the plane z = middle that, swept with the smallest possible sphere (half
/// the thickness of the points), encloses some points: after Larsen et al. (1999), PQP. For a point
/// at height h above the plane, the sphere covers w = sqrt(r^2 - h^2) within the plane, so the
/// rectangle may end w short of a point. Points beyond two sides at once may lie outside the round
/// corner; for them both sides grow. Usage: add all points, call `close`, add all points as
/// corners, call `finish`. docs/bounds.md, 11.
///
/// Each lane has its own rectangle; or all lanes share one set of points, and `enclose` and
/// `encloseCorners` combine their results.
template <typename P>
class SlabRectangle {
 public:
  using Points = Vectors<P>;

  SlabRectangle() = default;
  ADAPTIVE_BVH_INLINE SlabRectangle(const P& low_z, const P& high_z)
      : middle((low_z + high_z) * 0.5f), radius((high_z - low_z) * 0.5f) {}

  ADAPTIVE_BVH_INLINE P side(int k) const { return high[k] - low[k]; }
  /// Surface area of the volume.
  ADAPTIVE_BVH_INLINE P area() const { return sweptArea(side(0), side(1), radius); }

  /// Encloses all points of one set, except for its corners. at(i) returns the points from i on,
  /// one per lane.
  template <typename At>
  ADAPTIVE_BVH_INLINE void enclose(std::size_t count, At&& at) {
    for (std::size_t i = 0; i < count; i += Lanes<P>::kCount) add(at(i));
    putTogether();
    close();
  }
  /// Encloses the corners of that set.
  template <typename At>
  ADAPTIVE_BVH_INLINE void encloseCorners(std::size_t count, At&& at) {
    for (std::size_t i = 0; i < count; i += Lanes<P>::kCount) addCorner(at(i));
    finish();
    putTogether();
  }

  ADAPTIVE_BVH_INLINE void add(const Points& at) {
    const P w = packs::squareRoot(squaredHalfChord(at.z));
    low[0] = packs::lower<P>(low[0], at.x + w);
    high[0] = packs::upper<P>(high[0], at.x - w);
    low[1] = packs::lower<P>(low[1], at.y + w);
    high[1] = packs::upper<P>(high[1], at.y - w);
  }
  /// Collapses an empty side to its middle, from which every ball reaches the points on both sides.
  ADAPTIVE_BVH_INLINE void close() {
    for (int k = 0; k < 2; ++k) {
      const P half = (low[k] + high[k]) * 0.5f;
      const auto is_empty = low[k] > high[k];
      low[k] = is_empty ? half : low[k];
      high[k] = is_empty ? half : high[k];
    }
  }

  /// Extends both sides by the smallest equal step that includes a point beyond them by dx and dy.
  /// The step is the smaller root g of (dx - g)^2 + (dy - g)^2 = w^2.
  ADAPTIVE_BVH_INLINE void addCorner(const Points& at) {
    const P none{};
    const P dx = packs::upper<P>(low[0] - at.x, at.x - high[0]),
            dy = packs::upper<P>(low[1] - at.y, at.y - high[1]), w2 = squaredHalfChord(at.z);
    const auto is_beyond = (dx > none) & (dy > none) & (dx * dx + dy * dy > w2);
    if (!packs::inAny(is_beyond)) return;
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

  P middle = {}, radius = {};
  P low[2] = {packs::filled<P>(kFar), packs::filled<P>(kFar)},
    high[2] = {packs::filled<P>(-kFar), packs::filled<P>(-kFar)};

 private:
  static constexpr float kFar = 1e30f;

  /// Sets all lanes to the minimum and maximum over all lanes.
  ADAPTIVE_BVH_INLINE void putTogether() {
    const auto far = Lanes<P>::largest(-low[0], -low[1], high[0], high[1]);
    for (int k = 0; k < 2; ++k) {
      low[k] = -far[k] - P{};
      high[k] = far[k + 2] - P{};
    }
  }

  /// The square of w for points at height z.
  ADAPTIVE_BVH_INLINE P squaredHalfChord(const P& z) const {
    const P height = z - middle;
    return packs::upper<P>(radius * radius - height * height, P{});
  }

  P growth_low_[2] = {}, growth_high_[2] = {};
};

/// The results of fits, one volume per lane, in the coordinates of the step.
template <typename P>
struct BodyVolumes {
  Axes<P> axes;
  Vectors<P> corner;  ///< first corner of the rectangle
  P sides[2], radius;
  /// A box around the same points: its centre relative to `corner`, and its half sides, along the
  /// first two axes. Along the third axis it has the sphere's extent.
  P to_middle[2], half[2];

  BodyVolumes() = default;
  /// The arguments are along the axes, relative to `first`: rectangles from `low` to `high` in the
  /// planes z = `middle`, and boxes between two ends.
  ADAPTIVE_BVH_INLINE BodyVolumes(const Axes<P>& along, const Vectors<P>& first, const P (&low)[2],
                                  const P (&high)[2], const P& middle, const P& sphere,
                                  const P (&box_low)[2], const P (&box_high)[2])
      : axes(along),
        corner(vectors::sum(first, along.combine(low[0], low[1], middle))),
        radius(sphere) {
    for (int k = 0; k < 2; ++k) {
      sides[k] = high[k] - low[k];
      to_middle[k] = (box_low[k] + box_high[k]) * 0.5f - low[k];
      half[k] = (box_high[k] - box_low[k]) * 0.5f;
    }
  }

  /// Surface areas of the volumes.
  ADAPTIVE_BVH_INLINE P area() const { return sweptArea(sides[0], sides[1], radius); }
};

/// The coordinate ranges of some points.
template <typename P>
struct PointRange {
  Vectors<P> low, high;

  ADAPTIVE_BVH_INLINE void add(const Vectors<P>& at) {
    low = {packs::lower<P>(low.x, at.x), packs::lower<P>(low.y, at.y),
           packs::lower<P>(low.z, at.z)};
    high = {packs::upper<P>(high.x, at.x), packs::upper<P>(high.y, at.y),
            packs::upper<P>(high.z, at.z)};
  }
};

/// The volumes of sets of points along given axes. `along[k]` is the k-th point of each set, along
/// the axes and relative to `first`.
template <typename P>
ADAPTIVE_BVH_INLINE BodyVolumes<P> volumesAround(const Axes<P>& axes, const Vectors<P>& first,
                                                 const Vectors<P>* along, int count) {
  PointRange<P> range{along[0], along[0]};
  for (int k = 1; k < count; ++k) range.add(along[k]);
  SlabRectangle<P> rectangle(range.low.z, range.high.z);
  for (int k = 0; k < count; ++k) rectangle.add(along[k]);
  rectangle.close();
  for (int k = 0; k < count; ++k) rectangle.addCorner(along[k]);
  rectangle.finish();
  return {axes,
          first,
          rectangle.low,
          rectangle.high,
          rectangle.middle,
          rectangle.radius,
          {range.low.x, range.low.y},
          {range.high.x, range.high.y}};
}

/// The volumes of triangles: the rectangle on the longest edge, whose area is twice the triangle's,
/// the least possible. A needle's axes are inaccurate, so the height that they leave is measured as
/// well.
template <typename P>
ADAPTIVE_BVH_INLINE BodyVolumes<P> triangleVolumes(const Vectors<P>& p, const Vectors<P>& q,
                                                   const Vectors<P>& r) {
  using vectors::difference;
  using vectors::dot;
  using vectors::select;
  const Vectors<P> pq = difference(q, p), qr = difference(r, q), rp = difference(p, r);
  const P squares = dot(pq, pq), squares1 = dot(qr, qr), squares2 = dot(rp, rp);
  const auto second = squares1 > squares, third = squares2 > packs::upper<P>(squares, squares1);
  const Vectors<P> along = select(third, rp, select(second, qr, pq));
  const Vectors<P> back = select(third, qr, select(second, pq, rp));  // to the beginning of `along`
  const Vectors<P> apex = {-back.x, -back.y, -back.z};
  const Axes<P> axes = axesAlong(along, apex);
  PointRange<P> range{};
  range.add(axes.components(along));
  range.add(axes.components(apex));
  const P low[2] = {range.low.x, range.low.y}, high[2] = {range.high.x, range.high.y};
  return {axes,
          select(third, r, select(second, q, p)),
          low,
          high,
          (range.low.z + range.high.z) * 0.5f,
          (range.high.z - range.low.z) * 0.5f,
          low,
          high};
}

/// The volumes of pairs of triangles abc and bad with the common edge ab, that is, of four points.
/// Among all pairs of parallel planes that enclose them, the planes through the diagonals are
/// closest. In these planes, the least rectangle has a side along one of the outer edges.
template <typename P>
ADAPTIVE_BVH_INLINE BodyVolumes<P> quadVolumes(const Vectors<P>& a, const Vectors<P>& b,
                                               const Vectors<P>& c, const Vectors<P>& d) {
  using vectors::difference;
  constexpr float kTiny = 1e-30f;
  const P none{};
  const Axes<P> axes = axesAlong(difference(b, a), difference(d, c));
  // The corners in cyclic order, relative to a.
  Vectors<P> around[4] = {{none, none, none},
                          axes.components(difference(c, a)),
                          axes.components(difference(b, a)),
                          axes.components(difference(d, a))};
  P least = packs::filled<P>(1e30f), cosine = packs::filled<P>(1), sine = none;
  for (int i = 0; i < 4; ++i) {
    const Vectors<P> edge = difference(around[(i + 1) % 4], around[i]);
    P low_x = none, high_x = none, low_y = none, high_y = none;  // starting with a
    for (int k = 1; k < 4; ++k) {  // along the edge and perpendicular to it, times its length
      const P forth = edge.x * around[k].x + edge.y * around[k].y,
              across = edge.x * around[k].y - edge.y * around[k].x;
      low_x = packs::lower<P>(low_x, forth);
      high_x = packs::upper<P>(high_x, forth);
      low_y = packs::lower<P>(low_y, across);
      high_y = packs::upper<P>(high_y, across);
    }
    const P squares = edge.x * edge.x + edge.y * edge.y, scale = 1 / packs::squareRoot(squares);
    const P area = (high_x - low_x) * (high_y - low_y) * scale * scale;
    const auto is_better = (squares > kTiny) & (area < least);
    least = is_better ? area : least;
    cosine = is_better ? edge.x * scale : cosine;
    sine = is_better ? edge.y * scale : sine;
  }
  for (int k = 1; k < 4; ++k)
    around[k] = {around[k].x * cosine + around[k].y * sine,
                 around[k].y * cosine - around[k].x * sine, around[k].z};
  return volumesAround(axes.turned(cosine, sine), a, around, 4);
}

}  // namespace adaptive_bvh
