// Gaps of a point and four triangles are never above their distances in long double, with corners
// that are off by what is allowed.
#include <gtest/gtest.h>

#include "support/long_mode.h"
#include "support/triangle_lanes.h"
#include "triangles/point_gaps4.h"

namespace adaptive_bvh_test {
namespace point_gaps4_test {

using adaptive_bvh::Float4;
using adaptive_bvh::PointGaps4;
using adaptive_bvh::Vector4x3;
using exact::Real;

TEST(PointGaps4, AreLowerBounds) {
  RandomGeometry random(101);
  long lanes = 0, tight = 0, by_middles = 0;
  for (int i = 0; i < manySteps(10000); ++i) {
    const double size = random.size(-3, 0), error = random.oneIn(2) ? 0 : random.size(-7, -4);
    const Eigen::Vector3d point = random.point().cast<float>().cast<double>();
    Vector4x3 corners[3];
    Real distances[4];
    for (int lane = 0; lane < 4; ++lane) {
      const PlainTriangle t =
          anyTriangle(random, point + size * random.size(-2, 1) * random.point(), size);
      setLane(corners, lane, t, error, random);
      distances[lane] = exact::distance(exactly(t), exact::of(point));
    }
    const Vector4x3 from = adaptive_bvh::vectors::all(point);
    for (Vector4x3& corner : corners) corner = adaptive_bvh::vectors::difference(corner, from);
    const auto allowed = static_cast<float>(error + kLaneRounding);
    const PointGaps4 gaps(corners, adaptive_bvh::float4::all(allowed));
    const Float4 coarse = gaps.byMiddles(), fine = gaps.byNearest();
    for (int lane = 0; lane < 4; ++lane) {
      const Real d = distances[lane];
      EXPECT_LE(coarse[lane], d);
      EXPECT_LE(fine[lane], d);
      ++lanes;
      tight += fine[lane] >= 0.99L * d - 6 * allowed - 1e-5L * size;
      by_middles += coarse[lane] > d / 2;
    }
  }
  EXPECT_GT(double(tight), 0.9 * double(lanes));
  EXPECT_GT(double(by_middles), 0.3 * double(lanes));
  std::printf("%ld bounds, %ld tight, %ld by middles\n", lanes, tight, by_middles);
}

/// Of lengths whose squares underflow or overflow nothing is claimed that is not so.
TEST(PointGaps4, OfAnyLength) {
  RandomGeometry random(102);
  for (int i = 0; i < manySteps(2000); ++i) {
    const double size = random.size(-37, 18);
    Vector4x3 corners[3];
    Real distances[4];
    for (int lane = 0; lane < 4; ++lane) {
      const PlainTriangle t = anyTriangle(random, size * random.point(), size * random.size(-3, 0));
      setLane(corners, lane, t, 0, random);
      PlainTriangle rounded;
      for (std::size_t c = 0; c < 3; ++c)
        rounded[c] = {corners[c].x[lane], corners[c].y[lane], corners[c].z[lane]};
      distances[lane] = exact::distance(exactly(rounded), exact::Point::Zero());
    }
    const PointGaps4 gaps(corners, adaptive_bvh::float4::all(0));
    const Float4 coarse = gaps.byMiddles(), fine = gaps.byNearest();
    for (int lane = 0; lane < 4; ++lane) {
      EXPECT_FALSE(coarse[lane] > distances[lane]) << size;
      EXPECT_FALSE(fine[lane] > distances[lane]) << size;
    }
  }
}

}  // namespace point_gaps4_test
}  // namespace adaptive_bvh_test
