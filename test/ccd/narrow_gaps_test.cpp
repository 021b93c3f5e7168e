// Triangles, segments and points whose gap is far narrower than they are long, in one plane: the
// direction between nearest points has lost its digits, and normals do not separate them. The
// distances are quad_geometry.h's.
#include "adaptive_bvh/motion_clearance.h"

#include <gtest/gtest.h>

#include "support/quad_geometry.h"
#include "support/random_geometry.h"

namespace adaptive_bvh_test {
namespace narrow_gaps_test {

using adaptive_bvh::DeformableMesh;
using adaptive_bvh::Motion;
using adaptive_bvh::MotionClearance;
using P = fcl::Vector3d;
using Corners = std::array<P, 3>;

class NarrowGaps : public testing::Test {
 protected:
  /// Beyond x, away along `across`: a triangle, one with a side along `edge`, a segment, a point.
  Corners beyond(const P& x, const P& edge, const P& across) {
    switch (random_.below(4)) {
      case 0: return {x, x + across + 0.2 * edge, x + across - 0.3 * edge};
      case 1: return {x - 0.1 * edge, x + 0.5 * edge, x + across};
      case 2: return {x - 0.1 * edge, x + 0.5 * edge, x + 0.2 * edge};
      default: return {x, x, x};
    }
  }
  static double distanceOf(const Corners& a, const Corners& b) {
    const auto of = [](const Corners& t) -> quad::Triangle {
      return {quad::of(t[0]), quad::of(t[1]), quad::of(t[2])};
    };
    return static_cast<double>(quad::distance(of(a), of(b)));
  }
  /// The second one goes from its place by `step`, along the gap.
  static MotionClearance leastDistance(const Corners& a, const Corners& b, const P& step) {
    const std::vector<fcl::Triangle> triangles = {fcl::Triangle(0, 1, 2)};
    const DeformableMesh first({a.begin(), a.end()}, triangles),
        second({b.begin(), b.end()}, triangles);
    fcl::Transform3d from = fcl::Transform3d::Identity(), to = from;
    to.translation() = step;
    return adaptive_bvh::leastDistance(Motion::rigid(first, from, from),
                                       Motion::rigid(second, from, to), 1e-3);
  }

  RandomGeometry random_{99};
};

TEST_F(NarrowGaps, AreNoContacts) {
  for (int i = 0; i < manySteps(400); ++i) {
    SCOPED_TRACE(i);
    const P edge = random_.direction(), across = edge.cross(random_.direction()).normalized(),
            corner = random_.point();
    const double gap = random_.size(-9, -6);
    const Corners a = beyond(corner, edge, -across),
                  b = beyond(corner + gap * across, edge, across);
    const double step = random_.oneIn(2) ? 0. : 0.05, distance = distanceOf(a, b);
    const MotionClearance found = leastDistance(a, b, step * edge);
    EXPECT_FALSE(found.meet()) << distance;
    EXPECT_LE(found.lower, distance);
    if (step == 0) {
      EXPECT_NEAR(found.upper, distance, 1e-12);
    }
  }
}

}  // namespace narrow_gaps_test
}  // namespace adaptive_bvh_test
