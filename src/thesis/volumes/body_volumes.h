#pragma once

#include "base/vectors.h"
#include "thesis/volumes/kept_axes.h"

// Also compiled for AVX2: see thesis/volumes/fit_kernels.h.

namespace adaptive_bvh {

/// What is special to the size of a pack.
template <typename P>
struct Lanes;

template <>
struct Lanes<Float4> {
  static constexpr int kCount = 4;

  /// load(k) is the vector of lane k.
  template <typename Load>
  ADAPTIVE_BVH_INLINE static Vectors<Float4> gather(Load&& load) {
    return float4::columns(load(0), load(1), load(2), load(3));
  }
  /// All four numbers of load(k).
  template <typename Load>
  ADAPTIVE_BVH_INLINE static void gather4(Load&& load, Float4 (&numbers)[4]) {
    const float4::Rows rows = float4::transposed(load(0), load(1), load(2), load(3));
    numbers[0] = rows.x;
    numbers[1] = rows.y;
    numbers[2] = rows.z;
    numbers[3] = rows.w;
  }
  /// The largest of each.
  ADAPTIVE_BVH_INLINE static Float4 largest(const Float4& a, const Float4& b, const Float4& c,
                                            const Float4& d) {
    const float4::Rows rows = float4::transposed(a, b, c, d);
    return float4::upper(float4::upper(rows.x, rows.y), float4::upper(rows.z, rows.w));
  }

  /// Half of the lanes in double precision.
  using Doubles = Pack<double>;
  template <int kHalf>
  ADAPTIVE_BVH_INLINE static Doubles widened(const Float4& v) {
    return kHalf == 0 ? float4::widenedXy(v) : float4::widenedZw(v);
  }
};

/// The surface of all points within r of an a x b rectangle.
template <typename N>
ADAPTIVE_BVH_INLINE N sweptArea(const N& a, const N& b, const N& r) {
  constexpr float kPi = 3.14159265f;
  return 2 * a * b + 2 * kPi * r * (a + b + 2 * r);
}

/// The rectangle in the plane z = middle with which the least sphere, of half the thickness, holds
/// some points: after Larsen et al. (1999), PQP. Over a point at height h the sphere reaches w =
/// sqrt(r^2 - h^2) within the plane, so the rectangle may end w short of it. Points beyond two
/// sides at once may lie outside the round corner: there both sides grow. All points are to be
/// added, then `close`, then all as corners, then `finish`. docs/bounds.md, 11.
///
/// Each lane has a rectangle of its own; or all have points of one set: `enclose` and
/// `encloseCorners` put together what they found.
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

  /// All points of one set but for its corners. at(i): those from i on, as many as there are lanes.
  template <typename At>
  ADAPTIVE_BVH_INLINE void enclose(std::size_t count, At&& at) {
    for (std::size_t i = 0; i < count; i += Lanes<P>::kCount) add(at(i));
    putTogether();
    close();
  }
  /// The corners of that set.
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

  /// Gives all lanes the least and the largest ends of any.
  ADAPTIVE_BVH_INLINE void putTogether() {
    const auto far = Lanes<P>::largest(-low[0], -low[1], high[0], high[1]);
    for (int k = 0; k < 2; ++k) {
      low[k] = -far[k] - P{};
      high[k] = far[k + 2] - P{};
    }
  }

  /// w^2.
  ADAPTIVE_BVH_INLINE P squaredHalfChord(const P& z) const {
    const P height = z - middle;
    return packs::upper<P>(radius * radius - height * height, P{});
  }

  P growth_low_[2] = {}, growth_high_[2] = {};
};

/// Volumes as a fit decides them, a lane each: those of a step in its coordinates.
template <typename P>
struct BodyVolumes {
  Axes<P> axes;
  Vectors<P> corner;  ///< of the rectangle, along the first two axes
  P sides[2], radius;
  /// A box around the same points: its middle relative to `corner`, and half its sides, along the
  /// first two axes. Along the third it is as high as the sphere.
  P to_middle[2], half[2];

  BodyVolumes() = default;
  /// Along axes, from `first`: rectangles from `low` on, in the planes z = `middle`; boxes between
  /// two ends.
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

/// The least and the largest of some points.
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

/// The volumes along some axes of sets of points. `along[k]`: the k-th point of each, along the
/// axes and from `first`.
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

/// The volumes of triangles: the rectangle on the longest edge, which has twice the area of the
/// triangle, the least any rectangle has. The axes of a needle are off, so what they leave of a
/// height is measured as well.
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
  const Vectors<P> back = select(third, qr, select(second, pq, rp));  // to where `along` begins
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

/// The volumes of pairs of triangles abc and bad, with the common edge ab: of four points. Of all
/// pairs of planes between which these lie, those through the diagonals are nearest. In them, the
/// least rectangle has a side along one of the outer edges.
template <typename P>
ADAPTIVE_BVH_INLINE BodyVolumes<P> quadVolumes(const Vectors<P>& a, const Vectors<P>& b,
                                               const Vectors<P>& c, const Vectors<P>& d) {
  using vectors::difference;
  constexpr float kTiny = 1e-30f;
  const P none{};
  const Axes<P> axes = axesAlong(difference(b, a), difference(d, c));
  // Around, from a.
  Vectors<P> around[4] = {{none, none, none},
                          axes.components(difference(c, a)),
                          axes.components(difference(b, a)),
                          axes.components(difference(d, a))};
  P least = packs::filled<P>(1e30f), cosine = packs::filled<P>(1), sine = none;
  for (int i = 0; i < 4; ++i) {
    const Vectors<P> edge = difference(around[(i + 1) % 4], around[i]);
    P low_x = none, high_x = none, low_y = none, high_y = none;  // of a
    for (int k = 1; k < 4; ++k) {  // along the edge and across, times its length
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
