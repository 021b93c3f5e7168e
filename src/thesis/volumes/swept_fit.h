#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/rounding.h"
#include "thesis/volumes/body_volumes.h"
#include "thesis/volumes/point_arrays.h"

namespace adaptive_bvh {

/// Fits of many points: the choice of axes, and of a rectangle with a sphere along given axes.
/// Rounding errors here cost tightness, never containment: a volume in the model's precision
/// measures its radius afterwards, and one in single precision is enlarged (docs/bounds.md, 11).

/// Repeats a vector in every lane.
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
  points.forEachPack([&](std::size_t, const Vectors<Pack<S>>& at) {
    const Vectors<Pack<S>> p = vectors::difference(at, first);
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

/// A unit vector in the kernel of m, a symmetric matrix of rank 2: it is orthogonal to all rows.
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
/// farthest from the others is the root t in [sqrt(3), 2] of t^3 - 3 t = 2 |r|, where r is half the
/// determinant (Smith 1961). It is found by Newton's method from a parabola with an error of 0.002,
/// which two steps reduce to 1e-11. Perpendicular to its eigenvector, the remaining problem is
/// two-dimensional.
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

  // u and v have equal lengths, which suffices to determine the angle between them and the axes.
  const Point pole = kernelOf(m);
  const Point u =
      std::abs(pole[2]) < S(0.8) ? Point(-pole[1], pole[0], 0) : Point(0, -pole[2], pole[1]);
  const Point v = pole.cross(u);
  const Point mv = m * v;
  const S cross = u.dot(mv), half = (u.dot(m * u) - v.dot(mv)) / 2;
  const S root = std::sqrt(half * half + cross * cross);
  // If the eigenvalues differ only by rounding errors (a square), u and v are the axes. So equal
  // shapes with the same orientation get equal axes, and boxes along these are tight around each
  // other.
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

/// A unit direction in the plane of the rectangle.
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
    points.forEachPack([&](std::size_t, const Vectors<Pack<S>>& at) {
      along.add(x * at.x + y * at.y);
      across.add(x * at.y - y * at.x);
    });
    return along.length() * across.length();
  }
};

template <typename S>
struct LeastRectangle {
  explicit LeastRectangle(const PointArrays<S>& around)
      : points(around), area(direction.boundingArea(around)) {}

  void attempt(const Direction<S>& d) {
    const S a = d.boundingArea(points);
    if (!(a < area)) return;
    area = a;
    direction = d;
  }

  const PointArrays<S>& points;
  Direction<S> direction;
  S area;
};

/// The direction of the least bounding rectangle, or nearly. Principal axes do not determine it for
/// a square, and mislead for an L shape. The least rectangle has a side along two of the points:
/// for up to four points all pairs are tried. For more points, four directions are tried, and the
/// best one is refined by halving the angle.
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
  S area = std::numeric_limits<S>::infinity();
};

/// Keeps the better of a shape and the shape with the sphere that spans [low, high]. Returns half
/// the circumference of the latter's rectangle without corners, which only increase the area.
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

template <typename S>
Extent<S> heights(const PointArrays<S>& points) {
  Extent<S> z;
  points.forEachPack([&](std::size_t, const Vectors<Pack<S>>& at) { z.add(at.z); });
  return z;
}

/// Keeps the best shape with a given side; `turned` are the points along that side. A sphere of
/// half the thickness is the smallest possible, but not always the best: over a dome, a larger
/// sphere lets the rectangle end far inside the rim. Returns false for a set so flat that this
/// cannot matter.
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

/// The points used for decisions: all points, or an even selection.
template <typename S>
const PointArrays<S>& judges(const PointArrays<S>& points, PointArrays<S>& few) {
  constexpr std::size_t kJudges = 64;
  if (points.size() <= kJudges) return points;
  few.assign(points, (points.size() + kJudges - 1) / kJudges);
  return few;
}

/// Work space of a fit.
template <typename S>
struct FitMemory {
  PointArrays<S> few, local;
};

/// The best axes found: the normal is the direction of least variance, and the sides are chosen on
/// a few points.
template <typename S>
Axes<Pack<S>> bestAxes(const PointArrays<S>& points, FitMemory<S>& memory) {
  PointArrays<S>& local = memory.local;
  const Axes<Pack<S>> axes = principalAxes(points);
  local.assign(judges(points, memory.few), axes);
  Shape<S> shape;
  const Direction<S> side = bestDirection(local);
  if (side.y == 0) return axes;
  local.turn(side.x, side.y);
  if (improve(shape, local, side)) {
    local.turn(side.x, -side.y);
    improve(shape, local, Direction<S>());
  }
  return axes.turned(packs::all(shape.side.x), packs::all(shape.side.y));
}

/// The rectangle and the sphere along given axes, relative to the first point. The sphere is chosen
/// on a few points; then all points are enclosed.
template <typename S>
SlabRectangle<Pack<S>> shapeAlong(const Axes<Pack<S>>& axes, const PointArrays<S>& points,
                                  FitMemory<S>& memory) {
  PointArrays<S>& local = memory.local;
  Shape<S> shape;
  const PointArrays<S>& deciding = judges(points, memory.few);
  local.assign(deciding, axes);
  improve(shape, local, Direction<S>());
  if (&deciding == &points) return shape.slab;
  local.assign(points, axes);
  const Extent<S> z = heights(local);
  const S middle = shape.slab.middle[0],
          radius = std::max({shape.slab.radius[0], z.high() - middle, middle - z.low()});
  Shape<S> around_all;
  attempt(around_all, local, Direction<S>(), middle - radius, middle + radius);
  return around_all.slab;
}

}  // namespace adaptive_bvh
