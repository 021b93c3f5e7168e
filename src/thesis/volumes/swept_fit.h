#pragma once

#include <cmath>
#include <limits>

#include <fcl/common/types.h>

#include "base/rounding.h"
#include "thesis/volumes/swept_rectangle.h"

namespace adaptive_bvh {

/// The frame of a fit. Errors here cost tightness, never containment.

/// A right-handed orthonormal frame whose first axis lies along a and whose second lies in the
/// plane of a and b. Any frame where a or b leaves the choice open.
template <typename S>
fcl::Matrix3<S> frameAlong(const fcl::Vector3<S>& a, const fcl::Vector3<S>& b) {
  using Point = fcl::Vector3<S>;
  // Squares above this have lost no digits to underflow.
  const S tiny = std::numeric_limits<S>::min();
  const S a_squared = a.squaredNorm();
  const Point x = a_squared > tiny ? Point(a * (1 / std::sqrt(a_squared))) : Point::UnitX();

  Point y = b - x * x.dot(b);
  // What is left of b must stand clear of its rounding error, or its direction is noise.
  constexpr S kNoise = 256 * rounding::epsilon<S>() * rounding::epsilon<S>();
  const S rest = y.squaredNorm();
  if (!(rest > kNoise * b.squaredNorm() && rest > tiny)) y = x.unitOrthogonal();
  y -= x * x.dot(y);  // once more: the first difference may have cancelled
  y *= 1 / y.norm();

  fcl::Matrix3<S> frame;
  frame << x, y, x.cross(y);
  return frame;
}

/// Divided by the number of points and by their largest variance along an axis of coordinates.
/// Moments are taken about one of the points, so that a far-off mesh loses no digits.
template <typename S>
fcl::Matrix3<S> scaledCovariance(const PointArrays<S>& points) {
  const fcl::Vector3<S> first = points[0];
  Pack<S> x{}, y{}, z{}, xx{}, xy{}, xz{}, yy{}, yz{}, zz{};
  for (std::size_t i = 0; i < points.size(); i += packs::kSize<S>) {
    const Pack<S> px = points.pack(0, i) - first[0], py = points.pack(1, i) - first[1],
                  pz = points.pack(2, i) - first[2];
    x += px;
    y += py;
    z += pz;
    xx += px * px;
    xy += px * py;
    xz += px * pz;
    yy += py * py;
    yz += py * pz;
    zz += pz * pz;
  }
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
fcl::Matrix3<S> principalAxes(const PointArrays<S>& points) {
  const fcl::Matrix3<S> covariance = scaledCovariance(points);
  fcl::Vector3<S> first, second;
  principalDirections(covariance, first, second);
  // One step of power iteration mends what matters: of a flat set, the normal.
  return frameAlong<S>(covariance * first, covariance * second);
}

/// What a fit decides: axes, and along given axes a rectangle with a sphere. Rounding errors here
/// cost tightness, never containment: whoever fits measures the radius afterwards.

/// A choice of sides and sphere, with what they need around some points.
template <typename S>
struct Shape {
  Direction<S> side;
  Slab<S> slab;
  Rectangle<S> rectangle;
  S area = std::numeric_limits<S>::infinity();
};

/// Keeps the better of a shape and the one with another slab. Returns the rectangle of the latter:
/// without its corners when it is larger already, for these only add to the area.
template <typename S>
Rectangle<S> attempt(Shape<S>& best, const LocalPoints<S>& turned, const Direction<S>& side,
                     const Slab<S>& slab) {
  Rectangle<S> rectangle = rectangleWithoutCorners(turned, slab);
  if (!(rectangle.sweptArea(slab.radius) < best.area)) return rectangle;
  growCorners(rectangle, turned, slab);
  const S area = rectangle.sweptArea(slab.radius);
  if (area < best.area) best = {side, slab, rectangle, area};
  return rectangle;
}

/// Keeps the best of the shapes with a given side, along which the points are turned. A sphere of
/// half the thickness is the least that will do, but not always the best: over a dome, a larger one
/// lets the rectangle end far within the rim. Returns false for a set so flat that this cannot
/// matter.
template <typename S>
bool improve(Shape<S>& best, const LocalPoints<S>& turned, const Direction<S>& side) {
  const Interval<S> z = heights(turned);
  const S middle = (z.low + z.high) / 2, half = z.length() / 2;
  const Rectangle<S> least = attempt(best, turned, side, {middle, half});
  const bool thick = half > S(0.1) * (least.x.length() + least.y.length());
  if (thick)
    for (S shift : {-half / 2, half / 2})
      attempt(best, turned, side, {middle + shift, S(1.5) * half});
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

/// The normal is the direction of least variance. Which sides suit it best is judged on a few
/// points. `few` and `local` are work space.
template <typename S>
fcl::Matrix3<S> bestAxes(const PointArrays<S>& points, PointArrays<S>& few, PointArrays<S>& local) {
  const fcl::Matrix3<S> axes = principalAxes(points);
  local.assign(judges(points, few), axes);
  Shape<S> shape;
  const Direction<S> side = bestDirection(local);
  if (side.y == 0) return axes;
  local.turn(side.x, side.y);
  if (improve(shape, local, side)) {
    local.turn(side.x, -side.y);
    improve(shape, local, Direction<S>());
  }
  const auto& [x, y] = shape.side;
  fcl::Matrix3<S> turned;
  turned << axes.col(0) * x + axes.col(1) * y, axes.col(1) * x - axes.col(0) * y, axes.col(2);
  return turned;
}

/// The rectangle and the sphere along given axes; `local` becomes the points along them, about the
/// first. The sphere is judged on a few points; then all are enclosed.
template <typename S>
Shape<S> shapeAlong(const fcl::Matrix3<S>& axes, const PointArrays<S>& points, PointArrays<S>& few,
                    PointArrays<S>& local) {
  Shape<S> shape;
  const PointArrays<S>& deciding = judges(points, few);
  local.assign(deciding, axes);
  improve(shape, local, Direction<S>());
  if (&deciding == &points) return shape;
  local.assign(points, axes);
  const Interval<S> z = heights(local);
  Slab<S>& slab = shape.slab;
  slab.radius = std::max({slab.radius, z.high - slab.middle, slab.middle - z.low});
  shape.rectangle = rectangleWithoutCorners(local, slab);
  growCorners(shape.rectangle, local, slab);
  shape.area = shape.rectangle.sweptArea(slab.radius);
  return shape;
}

}  // namespace adaptive_bvh
