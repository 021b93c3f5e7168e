#pragma once

#include "base/vectors.h"
#include "thesis/volumes/kept_axes.h"

// Rectangle-swept spheres, and boxes with the same axes, around sets of points: one set and one
// volume per lane of a pack P. Also compiled for AVX2: see thesis/volumes/fit_kernels.h.
namespace adaptive_bvh {

/// Operations that depend on the pack's size. kCount is the number of lanes.
template <typename P>
struct Lanes;

template <>
struct Lanes<Float4> {
  static constexpr int kCount = 4;

  /// The vectors whose lane k is the first three numbers of load(k).
  template <typename Load>
  ADAPTIVE_BVH_INLINE static Vectors<Float4> gather(Load&& load) {
    return float4::columns(load(0), load(1), load(2), load(3));
  }
  /// Sets lane k of numbers[i] to number i of load(k).
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

  /// The lower (kHalf = 0) or the upper (1) half of the lanes, in double precision.
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

/// Finds a rectangle in the plane z = `middle` that, swept with a sphere of radius r, encloses some
/// points in the slab |z - middle| <= r: after Larsen et al. (1999), PQP. For a point at height h
/// above the plane, the sphere covers w = sqrt(r^2 - h^2) within the plane, so the rectangle may
/// end w short of a point. Points beyond two sides at once may lie outside the round corner; for
/// them both sides grow. docs/bounds.md, 11.
///
/// Usage with a set of points per lane: `add` all points, `close`, `addCorner` all points,
/// `finish`. Usage with one set of points for all lanes: `enclose`, `encloseCorners`.
template <typename P>
class SlabRectangle {
 public:
  using Points = Vectors<P>;

  SlabRectangle() = default;
  /// For the slab between these heights.
  ADAPTIVE_BVH_INLINE SlabRectangle(const P& low_z, const P& high_z)
      : middle((low_z + high_z) * 0.5f), radius((high_z - low_z) * 0.5f) {}

  /// The length of the side along x (k = 0) or y (1).
  ADAPTIVE_BVH_INLINE P side(int k) const { return high[k] - low[k]; }
  /// Surface area of the volume.
  ADAPTIVE_BVH_INLINE P area() const { return sweptArea(side(0), side(1), radius); }

  /// Encloses all points of one set, except those beyond its round corners. pointsAt(i) returns the
  /// points from i on, one per lane.
  template <typename PointsAt>
  ADAPTIVE_BVH_INLINE void enclose(std::size_t count, PointsAt&& pointsAt) {
    for (std::size_t i = 0; i < count; i += Lanes<P>::kCount) add(pointsAt(i));
    combineLanes();
    close();
  }
  /// Then encloses the points beyond the round corners, too.
  template <typename PointsAt>
  ADAPTIVE_BVH_INLINE void encloseCorners(std::size_t count, PointsAt&& pointsAt) {
    for (std::size_t i = 0; i < count; i += Lanes<P>::kCount) addCorner(pointsAt(i));
    finish();
    combineLanes();
  }

  /// Extends each side until the sphere, moved along it, covers the points in that direction.
  ADAPTIVE_BVH_INLINE void add(const Points& p) {
    const P w = packs::squareRoot(squaredHalfChord(p.z));
    low[0] = packs::lower<P>(low[0], p.x + w);
    high[0] = packs::upper<P>(high[0], p.x - w);
    low[1] = packs::lower<P>(low[1], p.y + w);
    high[1] = packs::upper<P>(high[1], p.y - w);
  }
  /// A side with low > high is empty: the sphere anywhere between the two covers all points in that
  /// direction. Collapses such a side to its middle.
  ADAPTIVE_BVH_INLINE void close() {
    for (int k = 0; k < 2; ++k) {
      const P half = (low[k] + high[k]) * 0.5f;
      const auto is_empty = low[k] > high[k];
      low[k] = is_empty ? half : low[k];
      high[k] = is_empty ? half : high[k];
    }
  }

  /// For a point beyond two sides by dx and dy: both sides must grow by at least the smallest equal
  /// step that includes the point, the smaller root g of (dx - g)^2 + (dy - g)^2 = w^2.
  ADAPTIVE_BVH_INLINE void addCorner(const Points& p) {
    const P zero{};
    const P dx = packs::upper<P>(low[0] - p.x, p.x - high[0]),
            dy = packs::upper<P>(low[1] - p.y, p.y - high[1]), w2 = squaredHalfChord(p.z);
    const auto is_beyond = (dx > zero) & (dy > zero) & (dx * dx + dy * dy > w2);
    if (!packs::inAny(is_beyond)) return;
    const P difference = dx - dy;
    const P root = packs::squareRoot(packs::upper<P>(w2 + w2 - difference * difference, zero));
    const P step = is_beyond ? (dx + dy - root) * 0.5f : zero;
    const auto is_left = p.x < low[0], is_below = p.y < low[1];
    growth_low_[0] = packs::upper<P>(growth_low_[0], is_left ? step : zero);
    growth_high_[0] = packs::upper<P>(growth_high_[0], is_left ? zero : step);
    growth_low_[1] = packs::upper<P>(growth_low_[1], is_below ? step : zero);
    growth_high_[1] = packs::upper<P>(growth_high_[1], is_below ? zero : step);
  }
  /// Moves each end of the sides by the largest step that a point beyond it needs.
  ADAPTIVE_BVH_INLINE void finish() {
    for (int k = 0; k < 2; ++k) {
      low[k] -= growth_low_[k];
      high[k] += growth_high_[k];
    }
  }

  P middle = {}, radius = {};
  /// The ends of the sides in x and y. Before the first point, low is far above high.
  P low[2] = {packs::filled<P>(kFar), packs::filled<P>(kFar)},
    high[2] = {packs::filled<P>(-kFar), packs::filled<P>(-kFar)};

 private:
  static constexpr float kFar = 1e30f;

  /// Sets all lanes to the minimum and maximum over all lanes.
  ADAPTIVE_BVH_INLINE void combineLanes() {
    const auto ends = Lanes<P>::largest(-low[0], -low[1], high[0], high[1]);
    for (int k = 0; k < 2; ++k) {
      low[k] = -ends[k] - P{};
      high[k] = ends[k + 2] - P{};
    }
  }

  /// w^2 for points with this z.
  ADAPTIVE_BVH_INLINE P squaredHalfChord(const P& z) const {
    const P height = z - middle;
    return packs::upper<P>(radius * radius - height * height, P{});
  }

  P growth_low_[2] = {}, growth_high_[2] = {};
};

/// The results of fits, one volume per lane, in the coordinates of the points.
template <typename P>
struct BodyVolumes {
  Axes<P> axes;
  Vectors<P> corner;   ///< of the rectangle: the lower ends of both sides
  P sides[2], radius;  ///< lengths of the sides along the first two axes; radius of the sphere
  /// A box around the same points: its centre relative to `corner`, and its half sides, along the
  /// first two axes. Along the third axis it has the sphere's extent.
  P to_middle[2], half[2];

  BodyVolumes() = default;
  /// From components along the axes, relative to the point `origin`: a rectangle from `low` to
  /// `high` in the plane z = `middle`, and a box from `box_low` to `box_high`.
  ADAPTIVE_BVH_INLINE BodyVolumes(const Axes<P>& given_axes, const Vectors<P>& origin,
                                  const P (&low)[2], const P (&high)[2], const P& middle,
                                  const P& sphere_radius, const P (&box_low)[2],
                                  const P (&box_high)[2])
      : axes(given_axes),
        corner(vectors::sum(origin, given_axes.combine(low[0], low[1], middle))),
        radius(sphere_radius) {
    for (int k = 0; k < 2; ++k) {
      sides[k] = high[k] - low[k];
      to_middle[k] = (box_low[k] + box_high[k]) * 0.5f - low[k];
      half[k] = (box_high[k] - box_low[k]) * 0.5f;
    }
  }

  /// Surface areas of the volumes.
  ADAPTIVE_BVH_INLINE P area() const { return sweptArea(sides[0], sides[1], radius); }
};

/// The coordinate ranges of some points, in each lane.
template <typename P>
struct PointRange {
  Vectors<P> low, high;

  ADAPTIVE_BVH_INLINE void add(const Vectors<P>& p) {
    low = {packs::lower<P>(low.x, p.x), packs::lower<P>(low.y, p.y), packs::lower<P>(low.z, p.z)};
    high = {packs::upper<P>(high.x, p.x), packs::upper<P>(high.y, p.y),
            packs::upper<P>(high.z, p.z)};
  }
};

/// The volumes of sets of points along given axes. Lane i of `points[k]` is the k-th point of set
/// i, as components along the axes relative to `origin`.
template <typename P>
ADAPTIVE_BVH_INLINE BodyVolumes<P> volumesAround(const Axes<P>& axes, const Vectors<P>& origin,
                                                 const Vectors<P>* points, int count) {
  PointRange<P> range{points[0], points[0]};
  for (int k = 1; k < count; ++k) range.add(points[k]);
  SlabRectangle<P> rectangle(range.low.z, range.high.z);
  for (int k = 0; k < count; ++k) rectangle.add(points[k]);
  rectangle.close();
  for (int k = 0; k < count; ++k) rectangle.addCorner(points[k]);
  rectangle.finish();
  return {axes,
          origin,
          rectangle.low,
          rectangle.high,
          rectangle.middle,
          rectangle.radius,
          {range.low.x, range.low.y},
          {range.high.x, range.high.y}};
}

/// The volumes of triangles pqr: the rectangle on the longest edge, whose area is twice the
/// triangle's, the least possible. The axes of a needle are inaccurate, so that the apex may lie
/// outside the plane of the rectangle: half its height becomes the radius.
template <typename P>
ADAPTIVE_BVH_INLINE BodyVolumes<P> triangleVolumes(const Vectors<P>& p, const Vectors<P>& q,
                                                   const Vectors<P>& r) {
  using vectors::difference;
  using vectors::dot;
  using vectors::select;
  const Vectors<P> pq = difference(q, p), qr = difference(r, q), rp = difference(p, r);
  const P squares_pq = dot(pq, pq), squares_qr = dot(qr, qr), squares_rp = dot(rp, rp);
  const auto qr_beats_pq = squares_qr > squares_pq,
             rp_is_longest = squares_rp > packs::upper<P>(squares_pq, squares_qr);
  const Vectors<P> base = select(rp_is_longest, rp, select(qr_beats_pq, qr, pq));
  // The edge that leads from the apex to the beginning of the base.
  const Vectors<P> back = select(rp_is_longest, qr, select(qr_beats_pq, pq, rp));
  const Vectors<P> apex = {-back.x, -back.y, -back.z};
  const Axes<P> axes = axesAlong(base, apex);
  PointRange<P> range{};  // relative to the beginning of the base
  range.add(axes.components(base));
  range.add(axes.components(apex));
  const P low[2] = {range.low.x, range.low.y}, high[2] = {range.high.x, range.high.y};
  return {axes,
          select(rp_is_longest, r, select(qr_beats_pq, q, p)),
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
  const P zero{};
  const Axes<P> axes = axesAlong(difference(b, a), difference(d, c));
  // The corners in cyclic order, relative to a.
  Vectors<P> corners[4] = {{zero, zero, zero},
                           axes.components(difference(c, a)),
                           axes.components(difference(b, a)),
                           axes.components(difference(d, a))};
  P least_area = packs::filled<P>(1e30f), cosine = packs::filled<P>(1), sine = zero;
  for (int i = 0; i < 4; ++i) {
    const Vectors<P> edge = difference(corners[(i + 1) % 4], corners[i]);
    P low_x = zero, high_x = zero, low_y = zero, high_y = zero;  // starting with a
    for (int k = 1; k < 4; ++k) {  // along the edge and perpendicular to it, times its length
      const P along = edge.x * corners[k].x + edge.y * corners[k].y,
              across = edge.x * corners[k].y - edge.y * corners[k].x;
      low_x = packs::lower<P>(low_x, along);
      high_x = packs::upper<P>(high_x, along);
      low_y = packs::lower<P>(low_y, across);
      high_y = packs::upper<P>(high_y, across);
    }
    const P squares = edge.x * edge.x + edge.y * edge.y, scale = 1 / packs::squareRoot(squares);
    const P area = (high_x - low_x) * (high_y - low_y) * scale * scale;
    const auto is_better = (squares > kTiny) & (area < least_area);
    least_area = is_better ? area : least_area;
    cosine = is_better ? edge.x * scale : cosine;
    sine = is_better ? edge.y * scale : sine;
  }
  for (int k = 1; k < 4; ++k)  // to the axes along the best edge
    corners[k] = {corners[k].x * cosine + corners[k].y * sine,
                  corners[k].y * cosine - corners[k].x * sine, corners[k].z};
  return volumesAround(axes.turned(cosine, sine), a, corners, 4);
}

}  // namespace adaptive_bvh
