#pragma once

#include <cmath>
#include <limits>

#include <fcl/common/types.h>

#include "geometry/rounding.h"
#include "volume/point_arrays.h"

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
  // Where only rounding errors tell them apart (a square), u and v are the axes: so equal shapes
  // that lie alike get equal axes, and boxes along these are tight around each other.
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

}  // namespace adaptive_bvh
