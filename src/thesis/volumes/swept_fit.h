#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/rounding.h"
#include "thesis/volumes/body_volumes.h"
#include "thesis/volumes/point_arrays.h"

// Fits of a rectangle-swept sphere to many points: the choice of its axes (bestAxes), and of its
// rectangle and sphere along given axes (shapeAlong). Both choose the least surface area found.
// Rounding errors here cost tightness, never containment: a volume in the model's precision
// measures its radius afterwards, and one in single precision is enlarged (docs/bounds.md, 11).
namespace adaptive_bvh {

/// A vector repeated in every lane.
template <typename S>
Vectors<Pack<S>> inAllLanes(const fcl::Vector3<S>& v) {
  return {packs::all<S>(v[0]), packs::all<S>(v[1]), packs::all<S>(v[2])};
}

/// The covariance of points, divided by the largest variance along a coordinate axis. Moments are
/// computed about one of the points, so that a mesh far from the origin loses no accuracy.
template <typename S>
fcl::Matrix3<S> scaledCovariance(const PointArrays<S>& points) {
  const Vectors<Pack<S>> first = points.first();
  Pack<S> x{}, y{}, z{}, xx{}, xy{}, xz{}, yy{}, yz{}, zz{};
  points.forEachPack([&](std::size_t, const Vectors<Pack<S>>& point) {
    const Vectors<Pack<S>> p = vectors::difference(point, first);
    x += p.x;
    y += p.y;
    z += p.z;
    xx += p.x * p.x;
    xy += p.x * p.y;
    xz += p.x * p.z;
    yy += p.y * p.y;
    yz += p.y * p.z;
    zz += p.z * p.z;
  });
  const S n = 1 / static_cast<S>(points.size());
  const S mx = packs::sum(x) * n, my = packs::sum(y) * n, mz = packs::sum(z) * n;
  const S cxx = packs::sum(xx) * n - mx * mx, cyy = packs::sum(yy) * n - my * my,
          czz = packs::sum(zz) * n - mz * mz, cxy = packs::sum(xy) * n - mx * my,
          cxz = packs::sum(xz) * n - mx * mz, cyz = packs::sum(yz) * n - my * mz;
  fcl::Matrix3<S> covariance;
  covariance << cxx, cxy, cxz, cxy, cyy, cyz, cxz, cyz, czz;
  const S size = covariance.diagonal().maxCoeff();
  if (size > std::numeric_limits<S>::min())
    covariance /= size;  // so that squares do not overflow or underflow later
  return covariance;
}

/// A unit vector in the kernel of m, a symmetric matrix of rank 2. It is orthogonal to all columns,
/// so it is the cross product of two of them; the longest of the three products is most accurate.
template <typename S>
fcl::Vector3<S> kernelOf(const fcl::Matrix3<S>& m) {
  using Point = fcl::Vector3<S>;
  Point best = m.col(0).cross(m.col(1));
  S best_squared = best.squaredNorm();
  for (const Point& other : {Point(m.col(1).cross(m.col(2))), Point(m.col(2).cross(m.col(0)))}) {
    const S squared = other.squaredNorm();
    if (!(squared > best_squared)) continue;
    best = other;
    best_squared = squared;
  }
  return best_squared > 0 ? Point(best / std::sqrt(best_squared)) : Point::UnitX();
}

/// Orthogonal directions, of any length, of the largest and the second largest eigenvalue of a
/// symmetric matrix with numbers of about 1.
///
/// After subtracting the mean of the eigenvalues and dividing by their spread, the eigenvalue
/// farthest from the others, with the sign of r, has the size t, the root in [sqrt(3), 2] of t^3 -
/// 3 t = 2 |r|, where r is half the determinant (Smith 1961). It is found by Newton's method from a
/// parabola with an error of 0.002, which two steps reduce to 1e-11. Perpendicular to its
/// eigenvector (`pole`), the remaining problem is two-dimensional.
template <typename S>
void principalDirections(const fcl::Matrix3<S>& matrix, fcl::Vector3<S>& first,
                         fcl::Vector3<S>& second) {
  using Point = fcl::Vector3<S>;
  first = Point::UnitX();
  second = Point::UnitY();
  fcl::Matrix3<S> m = matrix;
  m.diagonal().array() -= matrix.trace() / 3;
  const S spread_squared = m.squaredNorm() / 6;
  if (!(spread_squared > std::numeric_limits<S>::min())) return;  // all directions are equivalent
  const S spread = std::sqrt(spread_squared);
  const S r = m.col(0).dot(m.col(1).cross(m.col(2))) / (2 * spread_squared * spread);
  const S r_size = std::min(std::abs(r), S(1));
  S t = S(1.7320508) + r_size * (S(0.3333333) - S(0.0653841) * r_size);
  for (int step = 0; step < 2; ++step) t = 2 * (t * t * t + r_size) / (3 * (t * t - 1));
  m.diagonal().array() -= std::copysign(t * spread, r);

  // u, v and pole are orthogonal. u and v have equal lengths, so within their plane the matrix has
  // the entries u.mu, u.mv and v.mv up to a factor, which does not change its directions.
  const Point pole = kernelOf(m);
  const Point u =
      std::abs(pole[2]) < S(0.8) ? Point(-pole[1], pole[0], 0) : Point(0, -pole[2], pole[1]);
  const Point v = pole.cross(u);
  const Point mv = m * v;
  const S cross = u.dot(mv), half = (u.dot(m * u) - v.dot(mv)) / 2;
  const S root = std::sqrt(half * half + cross * cross);
  // If the eigenvalues differ only by rounding errors (a square), u and v are the axes. So equal
  // shapes with the same orientation get equal axes, and their boxes are tight.
  constexpr S kNoise = 256 * rounding::epsilon<S>();
  const Point larger = !(root > kNoise) ? u
                       : half > 0       ? Point(u * (half + root) + v * cross)
                                        : Point(u * cross + v * (root - half));
  const bool pole_is_smallest = r < 0;
  first = pole_is_smallest ? larger : pole;
  second = pole_is_smallest ? Point(pole.cross(larger)) : larger;
}

/// The principal axes, largest variance first.
template <typename S>
Axes<Pack<S>> principalAxes(const PointArrays<S>& points) {
  const fcl::Matrix3<S> covariance = scaledCovariance(points);
  fcl::Vector3<S> first, second;
  principalDirections(covariance, first, second);
  // One step of power iteration corrects what matters: the normal of a flat set.
  return axesAlong(inAllLanes<S>(covariance * first), inAllLanes<S>(covariance * second));
}

/// A unit vector in the plane of the rectangle: the direction of one side.
template <typename S>
struct Direction {
  S x = 1, y = 0;

  /// Rotates the direction by an angle with the given cosine and sine.
  Direction turned(S cosine, S sine) const {
    return {cosine * x - sine * y, sine * x + cosine * y};
  }

  /// The area of the points' bounding rectangle with this direction.
  S boundingArea(const PointArrays<S>& points) const {
    Extent<S> along, across;
    points.forEachPack([&](std::size_t, const Vectors<Pack<S>>& p) {
      along.add(x * p.x + y * p.y);
      across.add(x * p.y - y * p.x);
    });
    return along.length() * across.length();
  }
};

/// The direction whose bounding rectangle has the least area among those tried, beginning with x.
template <typename S>
struct LeastRectangle {
  explicit LeastRectangle(const PointArrays<S>& enclosed)
      : points(enclosed), area(direction.boundingArea(enclosed)) {}

  void attempt(const Direction<S>& other) {
    const S other_area = other.boundingArea(points);
    if (!(other_area < area)) return;
    area = other_area;
    direction = other;
  }

  const PointArrays<S>& points;
  Direction<S> direction;
  S area;
};

/// The direction of the least bounding rectangle of the points' x and y, or nearly. Principal axes
/// do not determine it for a square, and mislead for an L shape. A side of the least rectangle
/// passes through two of the points: for up to four points all pairs are tried. For more points,
/// four directions 22.5 degrees apart are tried, and the best one is refined by steps of half and
/// of a quarter of that angle.
template <typename S>
Direction<S> bestDirection(const PointArrays<S>& points) {
  LeastRectangle<S> least(points);
  if (points.size() <= 4) {
    for (std::size_t i = 0; i < points.size(); ++i)
      for (std::size_t j = 0; j < i; ++j) {
        const fcl::Vector3<S> d = points[i] - points[j];
        const S length = std::sqrt(d[0] * d[0] + d[1] * d[1]);
        if (length > std::numeric_limits<S>::min()) least.attempt({d[0] / length, d[1] / length});
      }
    return least.direction;
  }
  constexpr S kCos45 = S(0.70710678118654752), kCos22 = S(0.92387953251128674),
              kSin22 = S(0.38268343236508977), kCos11 = S(0.98078528040323043),
              kSin11 = S(0.19509032201612825), kCos6 = S(0.99518472667219693),
              kSin6 = S(0.098017140329560604);
  least.attempt({kCos22, kSin22});
  least.attempt({kCos45, kCos45});
  least.attempt({kSin22, kCos22});
  for (const auto& [cosine, sine] : {std::array<S, 2>{kCos11, kSin11}, {kCos6, kSin6}}) {
    const Direction<S> middle = least.direction;
    least.attempt(middle.turned(cosine, sine));
    least.attempt(middle.turned(cosine, -sine));
  }
  return least.direction;
}

/// A choice of sides and sphere, with the resulting rectangle around some points.
template <typename S>
struct Shape {
  Direction<S> side;
  SlabRectangle<Pack<S>> slab;
  S area = std::numeric_limits<S>::infinity();  ///< surface area of the volume
};

/// Replaces `best` by the shape whose side has this direction and whose sphere spans [low, high] in
/// z, if that has less area; `turned` are the points along that side. Returns the sum of both sides
/// of that shape before its corners are enclosed, which increases the area.
template <typename S>
S attempt(Shape<S>& best, const PointArrays<S>& turned, const Direction<S>& side, S low, S high) {
  SlabRectangle<Pack<S>> slab(packs::all(low), packs::all(high));
  slab.enclose(turned.size(), [&](std::size_t i) -> Vectors<Pack<S>> { return turned.at(i); });
  const S sides = slab.side(0)[0] + slab.side(1)[0];
  if (!(slab.area()[0] < best.area)) return sides;
  slab.encloseCorners(turned.size(),
                      [&](std::size_t i) -> Vectors<Pack<S>> { return turned.at(i); });
  const S area = slab.area()[0];
  if (area < best.area) best = {side, slab, area};
  return sides;
}

/// The range of the points' z.
template <typename S>
Extent<S> heights(const PointArrays<S>& points) {
  Extent<S> z;
  points.forEachPack([&](std::size_t, const Vectors<Pack<S>>& p) { z.add(p.z); });
  return z;
}

/// Replaces `best` by the best shape whose side has this direction, if that has less area; `turned`
/// are the points along that side. A sphere of half the thickness is the smallest possible, but not
/// always the best: over a dome, a larger sphere lets the rectangle end far inside the rim. So two
/// larger ones are tried as well, unless the points are too flat for that to matter. Returns
/// whether they were tried.
template <typename S>
bool improve(Shape<S>& best, const PointArrays<S>& turned, const Direction<S>& side) {
  const Extent<S> z = heights(turned);
  const S sides = attempt(best, turned, side, z.low(), z.high()), thickness = z.length();
  const bool thick = thickness > S(0.2) * sides;
  if (thick) {
    attempt(best, turned, side, z.low() - thickness / 2, z.high());
    attempt(best, turned, side, z.low(), z.high() + thickness / 2);
  }
  return thick;
}

/// The points on which decisions are made: all points, or at most 64 of them, stored in `sample`.
template <typename S>
const PointArrays<S>& sampleOf(const PointArrays<S>& points, PointArrays<S>& sample) {
  constexpr std::size_t kSamples = 64;
  if (points.size() <= kSamples) return points;
  sample.assign(points, (points.size() + kSamples - 1) / kSamples);
  return sample;
}

/// Work space of a fit.
template <typename S>
struct FitMemory {
  PointArrays<S> sample;  ///< see sampleOf
  PointArrays<S> local;   ///< points along the axes of the fit
};

/// The best axes found: the normal z is the direction of least variance, and the sides are chosen
/// on a sample of the points.
template <typename S>
Axes<Pack<S>> bestAxes(const PointArrays<S>& points, FitMemory<S>& memory) {
  PointArrays<S>& local = memory.local;
  const Axes<Pack<S>> axes = principalAxes(points);
  local.assign(sampleOf(points, memory.sample), axes);
  Shape<S> shape;
  const Direction<S> side = bestDirection(local);
  if (side.y == 0) return axes;
  local.turn(side.x, side.y);
  if (improve(shape, local, side)) {
    // The least rectangle of a thick set may not give the least volume: try another side, too.
    local.turn(side.x, -side.y);
    improve(shape, local, Direction<S>());
  }
  return axes.turned(packs::all(shape.side.x), packs::all(shape.side.y));
}

/// The rectangle and the sphere along given axes, relative to the first point. The sphere is chosen
/// on a sample of the points; then it is enlarged to span the heights of all points, and the
/// rectangle is computed for all points.
template <typename S>
SlabRectangle<Pack<S>> shapeAlong(const Axes<Pack<S>>& axes, const PointArrays<S>& points,
                                  FitMemory<S>& memory) {
  PointArrays<S>& local = memory.local;
  Shape<S> shape;
  const PointArrays<S>& sample = sampleOf(points, memory.sample);
  local.assign(sample, axes);
  improve(shape, local, Direction<S>());
  if (&sample == &points) return shape.slab;
  local.assign(points, axes);
  const Extent<S> z = heights(local);
  const S middle = shape.slab.middle[0],
          radius = std::max({shape.slab.radius[0], z.high() - middle, middle - z.low()});
  Shape<S> around_all;
  attempt(around_all, local, Direction<S>(), middle - radius, middle + radius);
  return around_all.slab;
}

}  // namespace adaptive_bvh
