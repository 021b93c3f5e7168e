// Signed distances of meshes and shapes in shallow contact, in random poses and on lattices, with
// one face, with several, and with curved meshes: judged in long double by points spread over the
// shape's surface where it is deep.
#include <gtest/gtest.h>

#include "adaptive_bvh/penetration.h"
#include "adaptive_bvh/query.h"
#include "support/depth_oracle.h"
#include "support/long_mode.h"
#include "support/meshes.h"
#include "support/random_geometry.h"

namespace adaptive_bvh_test {
namespace shallow_contact_test {

using adaptive_bvh::DeformableMesh;
using exact::Point;
using exact::Real;
using fcl::Vector3d;

/// A polygon in the plane of x and z, counter-clockwise from the side of -y, from y = -2 to y = 2.
class Prism {
 public:
  using Outline = std::vector<std::array<double, 2>>;

  explicit Prism(const Outline& outline) {
    for (const double y : {-2., 2.})
      for (const auto& p : outline) mesh_.vertices.emplace_back(p[0], y, p[1]);
    count_ = outline.size();
    for (std::size_t i = 0; i < count_; ++i) {
      const std::size_t next = (i + 1) % count_;
      add(i, next, next + count_);
      add(i, next + count_, i + count_);
    }
  }
  /// Part of both ends.
  Prism& cap(std::size_t a, std::size_t b, std::size_t c) {
    add(a, c, b);
    add(a + count_, b + count_, c + count_);
    return *this;
  }
  operator DeformableMesh() const { return DeformableMesh(mesh_); }

 private:
  void add(std::size_t a, std::size_t b, std::size_t c) { mesh_.triangles.emplace_back(a, c, b); }

  TriangleMesh mesh_;
  std::size_t count_;
};

/// A floor, z < 0, and a wall, x < 0.
DeformableMesh room() {
  return Prism(Prism::Outline{{-1, -1}, {3, -1}, {3, 0}, {0, 0}, {0, 3}, {-1, 3}})
      .cap(0, 1, 2)
      .cap(0, 2, 3)
      .cap(0, 3, 4)
      .cap(0, 4, 5);
}
/// The same and another wall, x > width.
DeformableMesh slot(double width) {
  return Prism(Prism::Outline{{-1, -1},
                              {width + 1, -1},
                              {width + 1, 3},
                              {width, 3},
                              {width, 0},
                              {0, 0},
                              {0, 3},
                              {-1, 3}})
      .cap(0, 1, 4)
      .cap(1, 2, 4)
      .cap(2, 3, 4)
      .cap(0, 4, 5)
      .cap(0, 5, 6)
      .cap(0, 6, 7);
}

class ShallowContacts : public testing::Test {
 protected:
  using Shape = JudgedShape;

  Shape anyShape(int kind) {
    switch (kind % 8) {
      case 0: return judged_shapes::sphere(0.05);
      case 1: return judged_shapes::capsule(0.05, 0.2);
      case 2: return judged_shapes::ellipsoid(Vector3d(0.05, 0.03, 0.08));
      case 3: return judged_shapes::cylinder(0.05, 0.2);
      case 4: return judged_shapes::cylinder(0.05, 0.02);  // a coin
      case 5: return judged_shapes::cone(0.05, 0.1);
      case 6: return judged_shapes::box(Vector3d(0.1, 0.05, 0.2));
      default: return judged_shapes::cone(0.1, 0.05);
    }
  }
  /// Any rotation, or one that maps axes to axes.
  fcl::Matrix3d anyTurn() {
    if (random_.oneIn(2)) return random_.pose(1).linear();
    fcl::Matrix3d turn = fcl::Matrix3d::Zero();
    const int first = random_.below(3), second = (first + 1 + random_.below(2)) % 3;
    turn(first, 0) = random_.oneIn(2) ? 1 : -1;
    turn(second, 1) = random_.oneIn(2) ? 1 : -1;
    turn.col(2) = turn.col(0).cross(turn.col(1));
    return turn;
  }
  /// How far a shape reaches along n, a direction of the world.
  static double reach(const Shape& shape, const fcl::Transform3d& tf, const Vector3d& n) {
    return double(shape.reach(exact::of(Vector3d(tf.linear().transpose() * n))));
  }

  /// A point of a shape's surface that is farthest along n, in its frame; the middle of a face.
  static Point farthest(const Shape& shape, const Point& n) {
    constexpr Real kStep = 1e-6L;
    Point x;
    for (int k = 0; k < 3; ++k) {
      const Point step = kStep * Point::Unit(k);
      x[k] = (shape.reach(n + step) - shape.reach(n - step)) / (2 * kStep);
    }
    return x;
  }
  /// Judges a signed distance by points that are farthest along directions around some.
  void judge(const DeformableMesh& mesh, const Shape& shape, const fcl::Transform3d& tf,
             double tolerance, const std::vector<Vector3d>& along, std::size_t most) {
    SCOPED_TRACE(shape.name);
    const auto still = fcl::Transform3d::Identity();
    const auto found = adaptive_bvh::signedDistance(mesh, still, *shape.geometry, tf, tolerance);
    constexpr Real kSlack = 1e-10L;
    ASSERT_LE(found.lower, found.upper);
    ASSERT_LE(found.upper - found.lower, std::max(tolerance, 2e-8));
    ASSERT_LE(found.searches, most);
    const JudgedMesh body(mesh, still);
    const exact::Placement at = exact::placement(tf);
    for (const Vector3d& direction : along)
      for (Real spread = 1; spread > 1e-6L; spread /= 4) {
        const Vector3d n = direction + double(spread) * random_.point();
        const Point x = at(farthest(shape, at.R.transpose() * exact::of(n).normalized()));
        ASSERT_LE(body.depth(x), -Real(found.lower) + kSlack);
      }
    if (found.upper >= 0) return;
    ++inside_;
    if (found.deep_body == adaptive_bvh::DeepBody::Second) {
      ASSERT_NEAR(double(body.depth(exact::of(found.points[1]))), -found.upper, 1e-10);
      return;
    }
    ASSERT_EQ(found.deep_body, adaptive_bvh::DeepBody::First);
    ASSERT_LE(double(body.distance(exact::of(found.points[0]))), 1e-10);
    const Point x = at.R.transpose() * (exact::of(found.points[0]) - at.T);
    for (int i = 0; i < 100; ++i) {
      const Point n = exact::of(random_.point()).normalized();
      ASSERT_LE(-Real(found.upper), shape.reach(n) - n.dot(x) + kSlack);
    }
  }
  double anyDepth() { return random_.size(-5, -2); }
  static int rounds(int few) { return isLongMode() ? 50 * few : few; }

  RandomGeometry random_{15};
  int inside_ = 0;
};

/// In the corner of a room, against one wall or two.
TEST_F(ShallowContacts, InACorner) {
  const DeformableMesh mesh = room();
  for (int i = 0; i < rounds(80); ++i) {
    const Shape shape = anyShape(i);
    const double d = anyDepth(), beside = random_.oneIn(3) ? 0.1 : random_.oneIn(2) ? -d : 0;
    fcl::Transform3d tf = fcl::Transform3d::Identity();
    tf.linear() = anyTurn();
    tf.translation() = Vector3d(beside + reach(shape, tf, -Vector3d::UnitX()), random_.uniform(),
                                -d + reach(shape, tf, -Vector3d::UnitZ()));
    judge(mesh, shape, tf, d / 10, {-Vector3d::UnitX(), -Vector3d::UnitZ(), Vector3d(-1, 0, -1)},
          beside > 0 ? 60 : 2500);
  }
  EXPECT_EQ(inside_, rounds(80));
}

/// Between two walls that are nearer than the shape is wide, and on the floor.
TEST_F(ShallowContacts, InASlot) {
  for (int i = 0; i < rounds(60); ++i) {
    const Shape shape = anyShape(i);
    const double d = anyDepth();
    fcl::Transform3d tf = fcl::Transform3d::Identity();
    tf.linear() = anyTurn();
    const double left = reach(shape, tf, -Vector3d::UnitX()),
                 right = reach(shape, tf, Vector3d::UnitX());
    tf.translation() = Vector3d(left - d, random_.uniform(),
                                -d * random_.below(2) + reach(shape, tf, -Vector3d::UnitZ()));
    judge(slot(left + right - 2 * d), shape, tf, d / 10,
          {-Vector3d::UnitX(), Vector3d::UnitX(), -Vector3d::UnitZ()}, 3000);
  }
  EXPECT_EQ(inside_, rounds(60));
}

/// Pushed into a curved mesh from any side.
TEST_F(ShallowContacts, WithABall) {
  const DeformableMesh mesh(gridBall(16, 8));
  for (int i = 0; i < rounds(60); ++i) {
    const Shape shape = anyShape(i);
    const double d = anyDepth();
    const Vector3d from = random_.point().normalized();
    fcl::Transform3d tf = fcl::Transform3d::Identity();
    tf.linear() = anyTurn();
    tf.translation() = 2 * from;
    for (int step = 0; step < 200; ++step) {
      fcl::DistanceResultd result;
      const fcl::DistanceRequestd request;
      const double gap = adaptive_bvh::distance(&mesh, fcl::Transform3d::Identity(),
                                                shape.geometry.get(), tf, request, result);
      if (gap < 1e-9) break;
      tf.translation() -= gap * from;
    }
    tf.translation() -= d * from;
    judge(mesh, shape, tf, d / 10, {-from}, 1500);
  }
  EXPECT_GT(inside_, rounds(30));
}

/// Where the depth is not shallow the motion that separates is longer than the depth.
TEST_F(ShallowContacts, NorAreDeepOnesWrong) {
  const DeformableMesh mesh = room();
  for (int i = 0; i < rounds(60); ++i) {
    const Shape shape = anyShape(i);
    fcl::Transform3d tf = fcl::Transform3d::Identity();
    tf.linear() = anyTurn();
    tf.translation() = 0.15 * random_.point() - Vector3d(0.1, 0, 0.1) * random_.below(3);
    judge(mesh, shape, tf, random_.size(-4, -1), {-Vector3d::UnitX(), -Vector3d::UnitZ()}, 20000);
  }
}

/// With a tolerance beyond the depth one motion may say all. The points are on the surfaces even
/// so.
TEST_F(ShallowContacts, PointsAreOnTheSurfacesWhateverTheTolerance) {
  const DeformableMesh mesh = room();
  for (int i = 0; i < rounds(40); ++i) {
    const auto cylinder = std::make_shared<fcl::Cylinderd>(0.5, 1);
    fcl::Transform3d tf = fcl::Transform3d::Identity();
    tf.linear() = anyTurn();
    tf.translation() = Vector3d(1.5, 0, -0.3) + 0.2 * random_.point();
    const double tolerance = random_.size(-3, 1);
    const auto found =
        adaptive_bvh::signedDistance(mesh, fcl::Transform3d::Identity(), *cylinder, tf, tolerance);
    const Vector3d x = tf.inverse() * found.points[1];
    const double radius = std::hypot(x[0], x[1]), height = std::abs(x[2]);
    EXPECT_NEAR(0, std::max(radius - 0.5, height - 0.5), 1e-9) << tolerance;
  }
}

}  // namespace shallow_contact_test
}  // namespace adaptive_bvh_test
