// The depth of triangles in a cylinder: against the certified depth of any convex set, and against
// motions in any direction.
#include "triangles/convex_distance.h"

#include <gtest/gtest.h>

#include "support/long_mode.h"
#include "support/random_geometry.h"

namespace adaptive_bvh_test {
namespace cylinder_penetration_test {

using adaptive_bvh::Penetration;
using Point = fcl::Vector3d;
using Triangle = adaptive_bvh::TrianglePoints<double>;

struct Cylinder final : adaptive_bvh::ConvexSet {
  double radius, half;
  Cylinder(double r, double h) : radius(r), half(h) {}
  Point support(const Point& d) const override {
    const double length = std::hypot(d[0], d[1]);
    const Point rim =
        length > 0 ? Point(radius * d[0] / length, radius * d[1] / length, 0) : Point(radius, 0, 0);
    return rim + Point(0, 0, d[2] < 0 ? -half : half);
  }
};

/// How far the cylinder moves along a direction until it is apart from a triangle.
double wayAlong(const Cylinder& cylinder, const Triangle& t, const Point& direction) {
  const Point m = direction.normalized();
  return std::max({m.dot(t[0]), m.dot(t[1]), m.dot(t[2])}) - m.dot(cylinder.support(-m));
}

class CylinderDepth : public testing::Test {
 protected:
  /// One corner inside, or near; whole numbers, thin, upright, level, on the axis.
  Triangle triangle(const Cylinder& cylinder) {
    Triangle t;
    const int kind = random_.below(7);
    for (Point& x : t) {
      x = random_.point();
      x[0] *= 2 * cylinder.radius;
      x[1] *= 2 * cylinder.radius;
      x[2] *= 2 * cylinder.half;
      if (kind == 1)
        for (int k = 0; k < 3; ++k) x[k] = std::round(2 * x[k]) / 2;
    }
    t[0] *= random_.uniform() / 2;
    if (kind == 2) t[2] = t[0] + (t[1] - t[0]) * random_.uniform();
    if (kind == 3) t[1] = t[0] + Point(0, 0, random_.uniform());
    if (kind == 4) t[1][2] = t[2][2] = t[0][2];
    if (kind == 5)
      for (Point& x : t) x[0] = x[1] = 0;
    if (kind == 6) t[1] = t[2] = t[0];
    return t;
  }

  RandomGeometry<double> random_{93};
};

TEST_F(CylinderDepth, IsTheLeastWayOut) {
  int seen = 0, slanted = 0;
  for (int round = 0; round < manySteps(20000); ++round) {
    const Cylinder cylinder(random_.oneIn(4) ? 1 : random_.size(-1.5, 0.5),
                            random_.oneIn(4) ? 1 : random_.size(-1.5, 0.5));
    const Triangle t = triangle(cylinder);
    double extent = cylinder.radius + cylinder.half;
    for (const Point& x : t) extent = std::max(extent, x.norm());
    if (std::hypot(t[0][0], t[0][1]) > cylinder.radius || std::abs(t[0][2]) > cylinder.half)
      continue;  // it touches with its first corner
    ++seen;
    const Penetration found = adaptive_bvh::cylinderPenetration(t, cylinder.radius, cylinder.half);
    ASSERT_NEAR(1, found.normal.norm(), 1e-12);
    ASSERT_NEAR(wayAlong(cylinder, t, found.normal), found.depth, 1e-12 * extent) << round;
    const Penetration other = adaptive_bvh::penetrationOf(t, cylinder);
    ASSERT_LE(found.depth, other.depth + 1e-12 * extent) << round;
    ASSERT_GE(found.depth, other.depth - other.error - 1e-12 * extent) << round;
    for (int i = 0; i < 10; ++i) {
      const Point near = found.normal + 0.1 * random_.direction() * random_.uniform();
      ASSERT_GE(wayAlong(cylinder, t, near), found.depth - 1e-12 * extent) << round;
      ASSERT_GE(wayAlong(cylinder, t, random_.direction()), found.depth - 1e-12 * extent) << round;
    }
    const double up = std::abs(found.normal[2]);
    slanted += up > 0.01 && up < 0.99;
  }
  EXPECT_GT(slanted, seen / 50);
}

}  // namespace cylinder_penetration_test
}  // namespace adaptive_bvh_test
