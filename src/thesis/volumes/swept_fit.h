#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/rounding.h"
#include "thesis/volumes/body_volumes.h"
#include "thesis/volumes/point_arrays.h"

namespace adaptive_bvh {

/// What a fit of many points decides: axes, and along given axes a rectangle with a sphere.
/// Rounding errors here cost tightness, never containment: a volume in the model's numbers measures
/// its radius afterwards, and one in single precision is enlarged (docs/bounds.md, 11).

/// A vector in every lane.
template <typename S>
Vectors<Pack<S>> inAllLanes(const fcl::Vector3<S>& v) {
  return {packs::all<S>(v[0]), packs::all<S>(v[1]), packs::all<S>(v[2])};
}

/// Divided by the number of points and by their largest variance along an axis of coordinates.
/// Moments are taken about one of the points, so that a far-off mesh loses no digits.
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
  if (size > std::numeric_limits<S>::min()) covariance /= size;  // squares of its numbers follow
  return covariance;
}

/// A unit vector that m, symmetric and of rank 2, maps to zero: all rows are orthogonal to it.
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

/// Directions of the largest and the second largest eigenvalue of a symmetric matrix whose numbers
/// are about 1, orthogonal to each other, of any lengths.
///
/// With the mean of the eigenvalues subtracted and their spread divided out, the one farthest from
/// the others is the root t in [sqrt(3), 2] of t^3 - 3 t = 2 |r|, r half the determinant (Smith
/// 1961): by Newton's method, from a parabola that is off by 0.002, after two steps by 1e-11.
/// Across its eigenvector what is left is plane.
template <typename S>
void principalDirections(const fcl::Matrix3<S>& matrix, fcl::Vector3<S>& first,
                         fcl::Vector3<S>& second) {
  using Point = fcl::Vector3<S>;
  first = Point::UnitX();
  second = Point::UnitY();
  fcl::Matrix3<S> m = matrix;
  m.diagonal().array() -= matrix.trace() / 3;
  const S spread_squared = m.squaredNorm() / 6;
  if (!(spread_squared > std::numeric_limits<S>::min())) return;  // all directions are alike
  const S spread = std::sqrt(spread_squared);
  const S r = m.col(0).dot(m.col(1).cross(m.col(2))) / (2 * spread_squared * spread);
  const S r_size = std::min(std::abs(r), S(1));
  S t = S(1.7320508) + r_size * (S(0.3333333) - S(0.0653841) * r_size);
  for (int step = 0; step < 2; ++step) t = 2 * (t * t * t + r_size) / (3 * (t * t - 1));
  m.diagonal().array() -= std::copysign(t * spread, r);

  // u and v are as long as each other, which is all that the angle between them and the axes needs.
  const Point pole = kernelOf(m);
  const Point u =
      std::abs(pole[2]) < S(0.8) ? Point(-pole[1], pole[0], 0) : Point(0, -pole[2], pole[1]);
  const Point v = pole.cross(u);
  const Point mv = m * v;
  const S cross = u.dot(mv), half = (u.dot(m * u) - v.dot(mv)) / 2;
  const S root = std::sqrt(half * half + cross * cross);
  // If they differ by rounding errors only (a square), u and v are the axes. So equal shapes with
  // the same orientation get equal axes, and boxes along these are tight around each other.
  constexpr S kNoise = 256 * rounding::epsilon<S>();
  const Point larger = !(root > kNoise) ? u
                       : half > 0       ? Point(u * (half + root) + v * cross)
                                        : Point(u * cross + v * (root - half));
  const bool pole_is_smallest = r < 0;
  first = pole_is_smallest ? larger : pole;
  second = pole_is_smallest ? Point(pole.cross(larger)) : larger;
}

/// Principal axes, largest variance first.
template <typename S>
Axes<Pack<S>> principalAxes(const PointArrays<S>& points) {
  const fcl::Matrix3<S> covariance = scaledCovariance(points);
  fcl::Vector3<S> first, second;
  principalDirections(covariance, first, second);
  // One step of power iteration mends what matters: of a flat set, the normal.
  return axesAlong(inAllLanes<S>(covariance * first), inAllLanes<S>(covariance * second));
}

/// A direction in the plane of the rectangle, of length 1.
template <typename S>
struct Direction {
  S x = 1, y = 0;

  /// By an angle with the given cosine and sine.
  Direction turned(S cosine, S sine) const {
    return {cosine * x - sine * y, sine * x + cosine * y};
  }

  /// The area of the rectangle with this direction around the points, in the plane.
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

/// Principal axes say nothing about a square, and mislead about an L. The least rectangle has a
/// side along two of the points: among four, that is found by trying all pairs. Among more, four
/// directions are tried and the best one refined by halves of the angle between.
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

/// A choice of sides and sphere, with what they need around some points.
template <typename S>
struct Shape {
  Direction<S> side;
  SlabRectangle<Pack<S>> slab;
  S area = std::numeric_limits<S>::infinity();
};

/// Keeps the better of a shape and the one with the sphere that spans [low, high]. Returns half the
/// circumference of the latter's rectangle, without its corners, which only add to the area.
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

/// Keeps the best of the shapes with a given side, along which the points are turned. A sphere of
/// half the thickness is the least that will do, but not always the best: over a dome, a larger one
/// lets the rectangle end far within the rim. Returns false for a set so flat that this cannot
/// matter.
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

/// The points that decide: all, or evenly picked ones.
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

/// The normal is the direction of least variance. Which sides suit it best is judged on a few
/// points.
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

/// The rectangle and the sphere along given axes, about the first point. The sphere is judged on a
/// few points; then all are enclosed.
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
