// The distance of two triangles, and of a point and a triangle, is exact up to the error stated,
// for triangles of every shape: against quadruple precision.
#include "triangles/triangle_gap.h"

#include <gtest/gtest.h>

#include "support/degenerate_triangles.h"
#include "support/long_mode.h"
#include "support/quad_geometry.h"

namespace adaptive_bvh_test {
namespace triangle_gap_test {

using adaptive_bvh::gapOf;
using adaptive_bvh::TriangleGap;
using Triangle = DegenerateTriangles::Triangle;
using Point = DegenerateTriangles::Point;

quad::Triangle of(const Triangle& t) { return {quad::of(t[0]), quad::of(t[1]), quad::of(t[2])}; }

double extentOf(const Triangle& a, const Triangle& b) {
  double extent = 0;
  for (const Triangle* t : {&a, &b})
    for (const Point& p : *t) extent = std::max(extent, (p - a[0]).lpNorm<Eigen::Infinity>());
  return extent;
}

/// The error of the distance in units of 2^-53 of the extent; infinite where the points are wrong.
double errorOf(const Triangle& a, const Triangle& b) {
  const TriangleGap gap = gapOf(a, b);
  const double extent = extentOf(a, b), unit = std::max(extent, 1e-300) * 0x1p-53;
  const quad::Real exact = quad::distance(of(a), of(b));
  double coordinate = extent;
  for (const Point& p : a) coordinate = std::max(coordinate, p.lpNorm<Eigen::Infinity>());
  const Point &on_a = gap.points.first, &on_b = gap.points.second;
  const double off = double(
      std::max(quad::distance(quad::of(on_a), of(a)), quad::distance(quad::of(on_b), of(b))));
  const double apart = std::abs((on_a - on_b).norm() - gap.distance);
  if (off > 0x1p-49 * coordinate || apart > 0x1p-46 * coordinate)
    return std::numeric_limits<double>::infinity();
  return double(quad::absolute(quad::Real(gap.distance) - exact)) / unit;
}

TEST(TriangleGap, IsExactForTrianglesOfEveryShape) {
  DegenerateTriangles triangles(1999);
  double worst = 0;
  int touching = 0;
  const int rounds = manySteps(50000);
  for (int round = 0; round < rounds; ++round) {
    auto [a, b] = triangles.pair();
    // At any scale and place.
    if (triangles.random().oneIn(4)) {
      const double scale = std::ldexp(1., triangles.random().below(400) - 200);
      for (Triangle* t : {&a, &b})
        for (Point& p : *t) p *= scale;
    }
    const double error = errorOf(a, b);
    ASSERT_LT(error, 64) << round;
    ASSERT_NEAR(gapOf(a, b).distance, gapOf(b, a).distance, 0x1p-47 * extentOf(a, b)) << round;
    worst = std::max(worst, error);
    touching += gapOf(a, b).distance == 0;
  }
  std::printf("worst error: %.1f u of the extent; %d of %d touch\n", worst, touching, rounds);
  EXPECT_GT(touching, rounds / 20);
  EXPECT_LT(touching, rounds / 2);
}

/// Issues of this kind, by hand.
TEST(TriangleGap, OfParallelEdges) {
  const Triangle a = {Point(1.3, 0.3, 0), Point(1.3, 1.7, 0), Point(-0.7, 0.3, 0)},
                 b = {Point(-0.5, 1.2, -0.9), Point(-0.5, -0.5, -0.9), Point(-0.5, 1.2, -0.6)};
  EXPECT_NEAR(0.717656316, gapOf(a, b).distance, 1e-9);
  const Triangle c = {Point(0.7, 0.4, -1.8), Point(-0.9, 0.4, -1.8), Point(0.7, 0.4, -1.9)},
                 d = {Point(-0.3, -1, -1.8), Point(1.1, -1, -1.8), Point(-0.3, 0.9, -1.8)};
  EXPECT_EQ(0, gapOf(c, d).distance);
}

TEST(TriangleGap, OfSliversThatCross) {
  const Triangle p = {Point(3722.8, -1630.09, -3376.6), Point(-.59, -.06, .47),
                      Point(-.72, -.68, .96)},
                 q = {Point(-.69, 1, -.68), Point(3722.75, -1630.11, -3376.49),
                      Point(3722.47, -1629.96, -3376.53)};
  EXPECT_EQ(0, gapOf(p, q).distance);
  EXPECT_EQ(0, gapOf(q, p).distance);
}

TEST(TriangleGap, OfAPointInANeedle) {
  const double e = 0x1p-26;
  const Triangle t = {Point(0, 0, 0), Point(6, 5, 4), Point(6, 5 + e, 4 - e)};
  const Point x(4.5 - e, 3.75 - e / 2, 3 - e);
  EXPECT_NEAR(double(quad::distance(quad::of(x), of(t))),
              (adaptive_bvh::nearestPoint(t, x) - x).norm(), 3e-14);
}

}  // namespace triangle_gap_test
}  // namespace adaptive_bvh_test
