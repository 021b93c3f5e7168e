// FCL's distance of two triangles is wrong for parallel edges and for small triangles. Documented
// here, so that no one takes it for an oracle, and so that we notice when a later FCL mends it.
#include <gtest/gtest.h>

#include <fcl/narrowphase/detail/primitive_shape_algorithm/triangle_distance.h>

#include "support/degenerate_triangles.h"
#include "support/quad_geometry.h"
#include "triangles/triangle_gap.h"

namespace adaptive_bvh_test {
namespace fcl_distance_test {

using Triangle = DegenerateTriangles::Triangle;
using Point = DegenerateTriangles::Point;

double fclsDistance(const Triangle& a, const Triangle& b) {
  Point on_a, on_b;
  return fcl::detail::TriangleDistance<double>::triDistance(a.data(), b.data(), on_a, on_b);
}
double exactDistance(const Triangle& a, const Triangle& b) {
  return double(quad::distance({quad::of(a[0]), quad::of(a[1]), quad::of(a[2])},
                               {quad::of(b[0]), quad::of(b[1]), quad::of(b[2])}));
}

TEST(FclDistance, IsTooLargeForParallelEdges) {
  const Triangle a = {Point(1.3, 0.3, 0), Point(1.3, 1.7, 0), Point(-0.7, 0.3, 0)},
                 b = {Point(-0.5, 1.2, -0.9), Point(-0.5, -0.5, -0.9), Point(-0.5, 1.2, -0.6)};
  EXPECT_NEAR(2.01246118, fclsDistance(a, b), 1e-8);
  EXPECT_NEAR(0.717656316, exactDistance(a, b), 1e-9);
}

TEST(FclDistance, IsTooLargeForSomeTrianglesAlongTheAxes) {
  DegenerateTriangles triangles(280);
  int fcls_errors = 0, our_errors = 0;
  constexpr int kPairs = 20000;
  for (int i = 0; i < kPairs; ++i) {
    const Triangle a = triangles.alongAxes(), b = triangles.alongAxes();
    const double exact = exactDistance(a, b);
    fcls_errors += fclsDistance(a, b) > exact + 1e-9;
    our_errors += std::abs(adaptive_bvh::gapOf(a, b).distance - exact) > 1e-13;
  }
  std::printf("FCL: %d of %d too large\n", fcls_errors, kPairs);
  EXPECT_GT(fcls_errors, kPairs / 1000);
  EXPECT_EQ(0, our_errors);
}

TEST(FclDistance, IsWrongForSmallTriangles) {
  const double s = 1e-5;
  const Triangle face = {Point(0, 0, 0), Point(s, 0, 0), Point(0, s, 0)},
                 above = {Point(s / 4, s / 4, s / 10), Point(s, s, s), Point(s, s / 2, 2 * s)};
  EXPECT_GT(std::abs(fclsDistance(face, above) - exactDistance(face, above)),
            exactDistance(face, above) / 2);
  EXPECT_NEAR(exactDistance(face, above), adaptive_bvh::gapOf(face, above).distance, 1e-20);
}

}  // namespace fcl_distance_test
}  // namespace adaptive_bvh_test
