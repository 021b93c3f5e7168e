// The depth of triangles in cylinders, cones and ellipsoids: against the certified depth of any
// convex set, and against motions in any direction.
#include <gtest/gtest.h>

#include "solids/cone.h"
#include "solids/cylinder.h"
#include "solids/ellipsoid.h"
#include "support/long_mode.h"
#include "support/random_geometry.h"

namespace adaptive_bvh_test {
namespace round_penetration_test {

using adaptive_bvh::Penetration;
using Point = fcl::Vector3d;
using Triangle = adaptive_bvh::TrianglePoints;

/// A shape inside a box of half the sides `box`, by its formulas.
class Shape : public adaptive_bvh::ConvexSet {
 public:
  explicit Shape(const Point& sides) : box(sides) {}
  virtual bool holds(const Point& x) const = 0;
  virtual Penetration depthOf(const Triangle& triangle) const = 0;

  /// How far the shape moves along a direction until it is apart from a triangle.
  double wayAlong(const Triangle& t, const Point& direction) const {
    const Point m = direction.normalized();
    return std::max({m.dot(t[0]), m.dot(t[1]), m.dot(t[2])}) - m.dot(support(-m));
  }
  const Point box;

 protected:
  Point rim(const Point& d, double z) const {
    const double length = std::hypot(d[0], d[1]);
    return length > 0 ? Point(box[0] * d[0] / length, box[0] * d[1] / length, z)
                      : Point(box[0], 0, z);
  }
};

struct Cylinder final : Shape {
  explicit Cylinder(const Point& sides) : Shape({sides[0], sides[0], sides[2]}) {}
  Point support(const Point& d) const override { return rim(d, d[2] < 0 ? -box[2] : box[2]); }
  bool holds(const Point& x) const override {
    return std::hypot(x[0], x[1]) <= box[0] && std::abs(x[2]) <= box[2];
  }
  Penetration depthOf(const Triangle& t) const override {
    return adaptive_bvh::CylinderSolid(box[0], box[2]).penetration(t);
  }
};
struct Cone final : Shape {
  explicit Cone(const Point& sides) : Shape({sides[0], sides[0], sides[2]}) {}
  Point support(const Point& d) const override {
    const Point tip(0, 0, box[2]), base = rim(d, -box[2]);
    return d.dot(tip) > d.dot(base) ? tip : base;
  }
  bool holds(const Point& x) const override {
    return std::abs(x[2]) <= box[2] &&
           std::hypot(x[0], x[1]) <= box[0] * (box[2] - x[2]) / (2 * box[2]);
  }
  Penetration depthOf(const Triangle& t) const override {
    return adaptive_bvh::ConeSolid(box[0], box[2]).penetration(t);
  }
};
struct Ellipsoid final : Shape {
  explicit Ellipsoid(const Point& sides) : Shape(sides) {}
  Point support(const Point& d) const override {
    const Point scaled = box.cwiseProduct(d.normalized());
    return box.cwiseProduct(scaled.normalized());
  }
  bool holds(const Point& x) const override { return x.cwiseQuotient(box).norm() <= 1; }
  Penetration depthOf(const Triangle& t) const override {
    return adaptive_bvh::EllipsoidSolid(box).penetration(t);
  }
};

template <typename S>
class RoundDepth : public testing::Test {
 protected:
  Point sides() {
    Point sides;
    for (int k = 0; k < 3; ++k) sides[k] = random_.oneIn(3) ? 1 : random_.size(-1.5, 0.5);
    if (random_.oneIn(20)) sides[random_.below(3)] *= 1 + 1e-9 * random_.uniform(-1, 1);
    return sides;
  }
  /// One corner inside, or near; whole numbers, thin, upright, level, on the axis; turned a little.
  Triangle triangle(const Point& box) {
    Triangle t;
    const int kind = random_.below(7);
    for (Point& x : t) {
      x = 2 * random_.point().cwiseProduct(box);
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
    if (random_.oneIn(4)) {
      const Eigen::AngleAxisd turn(random_.size(-12, -3), random_.direction());
      for (Point& x : t) x = turn * x;
    }
    return t;
  }
  /// By small steps from a direction.
  double shorterWay(const Shape& shape, const Triangle& t, Point at) {
    double way = shape.wayAlong(t, at);
    for (double step = 0.1; step > 1e-8; step /= 2)
      for (int i = 0; i < 4; ++i) {
        const Point next = (at + step * random_.direction()).normalized();
        const double other = shape.wayAlong(t, next);
        if (other < way) at = next, way = other;
      }
    return way;
  }

  RandomGeometry random_{93};
};

using Shapes = testing::Types<Cylinder, Cone, Ellipsoid>;
TYPED_TEST_SUITE(RoundDepth, Shapes);

TYPED_TEST(RoundDepth, IsTheLeastWayOut) {
  auto& random = this->random_;
  int seen = 0, slanted = 0;
  for (int round = 0; round < manySteps(10000); ++round) {
    const TypeParam shape(this->sides());
    const Triangle t = this->triangle(shape.box);
    if (!shape.holds(t[0])) continue;  // it touches with its first corner
    ++seen;
    double extent = shape.box.sum();
    for (const Point& x : t) extent = std::max(extent, x.norm());
    const double slack = 1e-12 * extent;
    const Penetration found = shape.depthOf(t);
    ASSERT_NEAR(1, found.normal.norm(), 1e-12);
    ASSERT_NEAR(shape.wayAlong(t, found.normal), found.depth, slack) << round;
    const Penetration other = adaptive_bvh::penetrationOf(t, shape);
    ASSERT_LE(found.depth, other.depth + slack) << round;
    ASSERT_GE(found.depth, other.depth - other.error - slack) << round;
    for (const Point& start : {found.normal, other.normal, random.direction()})
      ASSERT_GE(this->shorterWay(shape, t, start), found.depth - slack) << round;
    const double up = std::abs(found.normal[2]);
    slanted += up > 0.01 && up < 0.99;
  }
  EXPECT_GT(seen, manySteps(10000) / 10);
  EXPECT_GT(slanted, seen / 50);
}

}  // namespace round_penetration_test
}  // namespace adaptive_bvh_test
