// Whether two triangles have a common point is decided without any error, for triangles of every
// shape: against whole numbers.
#include "triangles/triangle_intersection.h"

#include <gtest/gtest.h>

#include "support/integer_triangles.h"
#include "support/long_mode.h"
#include "triangles/orientation.h"
#include "triangles/triangle_gap.h"

namespace adaptive_bvh_test {
namespace triangle_intersection_test {

using adaptive_bvh::TriangleIntersection;
using adaptive_bvh::TrianglePoints;

TrianglePoints scaled(const integer::Triangle& t, double scale) {
  TrianglePoints points;
  for (std::size_t k = 0; k < 3; ++k)
    points[k] = scale * fcl::Vector3d(double(t[k].x), double(t[k].y), double(t[k].z));
  return points;
}

TEST(TriangleIntersection, IsThatOfWholeNumbers) {
  IntegerTriangles triangles(4711);
  const double scales[] = {1, -1, 0x1p-40, 0x1p-180, 0x1p200};
  int touching = 0, crossing = 0;
  const int rounds = manySteps(40000);
  for (int round = 0; round < rounds; ++round) {
    const auto pair = triangles.pair();
    const bool expected = integer::touch(pair.first, pair.second);
    const double scale = scales[round % 5];
    const auto a = scaled(pair.first, scale), b = scaled(pair.second, scale);
    const TriangleIntersection intersection(a, b);
    ASSERT_EQ(expected, intersection.exists()) << round;
    ASSERT_EQ(expected, TriangleIntersection(b, a).exists()) << round;
    // As the distance and the contact query see it.
    ASSERT_EQ(expected, adaptive_bvh::gapOf(a, b).distance == 0) << round;
    ASSERT_EQ(expected, adaptive_bvh::touch(a, b)) << round;
    touching += expected;
    crossing += intersection.isCrossing();
  }
  std::printf("%d of %d touch, %d of them cross\n", touching, rounds, crossing);
  EXPECT_GT(touching, rounds / 10);
  EXPECT_LT(touching, rounds * 2 / 3);
  EXPECT_LT(crossing, touching - rounds / 50);
}

TEST(TriangleIntersection, OfPlanarPointsIsTheirOrientation) {
  RandomGeometry random(5);
  int on_a_line = 0;
  for (int round = 0; round < manySteps(100000); ++round) {
    const int size = 1 << (1 + random.below(30));
    std::int64_t c[6];
    for (std::int64_t& x : c) x = random.below(size);
    if (random.oneIn(2)) {  // the third on the line of the others, or next to it
      c[4] = 2 * c[2] - c[0] + random.below(2);
      c[5] = 2 * c[3] - c[1];
    }
    const integer::Wide exact =
        integer::Wide(c[0] - c[4]) * (c[3] - c[5]) - integer::Wide(c[1] - c[5]) * (c[2] - c[4]);
    const double scale = round % 2 ? 0x1p-300 : 0x1p20;
    double x[6];
    for (int k = 0; k < 6; ++k) x[k] = scale * double(c[k]);
    ASSERT_EQ(integer::sign(exact),
              adaptive_bvh::planarOrientation(x[0], x[1], x[2], x[3], x[4], x[5]))
        << round;
    on_a_line += exact == 0;
  }
  EXPECT_GT(on_a_line, 1000);
}

}  // namespace triangle_intersection_test
}  // namespace adaptive_bvh_test
