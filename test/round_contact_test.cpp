// Signed distances of meshes and round shapes in shallow contact, judged by closed forms: of any
// depth, by few searches. And shapes with a size that is not positive.
#include <gtest/gtest.h>

#include "adaptive_bvh/penetration.h"
#include "adaptive_bvh/query.h"
#include "query/depth/cutting_planes.h"
#include "support/closed_bodies.h"
#include "support/meshes.h"
#include "support/random_geometry.h"
#include "support/shape_oracle.h"

namespace adaptive_bvh_test {
namespace round_contact_test {

using adaptive_bvh::DeformableMesh;
using exact::Real;

/// [0, 1]^3, cut into `cells` along each edge.
DeformableMesh<double> cube(int cells) {
  TriangleMesh<double> mesh = latticeBox<double>(cells);
  for (auto& p : mesh.vertices) p /= cells;
  return DeformableMesh<double>(mesh);
}

class RoundContacts : public testing::Test {
 protected:
  fcl::Matrix3d anyTurn() { return random_.pose(1).linear(); }
  /// The axis z level.
  fcl::Matrix3d lying() {
    return (Eigen::AngleAxisd(3 * random_.uniform(), fcl::Vector3d::UnitZ()) *
            Eigen::AngleAxisd(std::acos(0.), fcl::Vector3d::UnitX()))
        .toRotationMatrix();
  }

  fcl::Matrix3d leaning(double angle) {
    const fcl::Vector3d axis = fcl::Vector3d(1, random_.uniform(), 0).normalized();
    return Eigen::AngleAxisd(angle, axis).toRotationMatrix();
  }

  /// Lowers a shape by d into the top of a cube, d from 0.01 to 1e-9: so deep each is in the other.
  void lower(const JudgedShape<double>& shape, const fcl::Matrix3d& turn, std::size_t most) {
    SCOPED_TRACE(shape.name);
    for (const int cells : {1, 3})
      for (double d = 1e-2; d > 5e-10; d /= std::sqrt(10.)) {
        fcl::Transform3d tf = fcl::Transform3d::Identity();
        tf.linear() = turn;
        const Real below = shape.reach(exact::of(fcl::Vector3d(-turn.row(2).transpose())));
        tf.translation() = fcl::Vector3d(0.6 + 0.02 * random_.uniform(), 0.57, 1 + double(below));
        tf.translation()[2] -= d;
        const auto found = adaptive_bvh::signedDistance<double>(
            cube(cells), fcl::Transform3d::Identity(), *shape.geometry, tf, d / 10);
        const double slack = 1e-12, width = std::max(d / 10, 4e-9);
        ASSERT_LE(found.lower, -d + slack) << d;
        ASSERT_GE(found.upper, -d - slack) << d;
        ASSERT_LE(found.upper - found.lower, width) << d;
        ASSERT_LE(found.searches, most) << d;
      }
  }

  RandomGeometry<double> random_{52};
};

TEST_F(RoundContacts, OfASphere) { lower(judged_shapes::sphere<double>(0.05), anyTurn(), 100); }
TEST_F(RoundContacts, OfACapsule) {
  for (int i = 0; i < 3; ++i)
    lower(judged_shapes::capsule<double>(0.05, 0.2), i ? lying() : anyTurn(), 100);
}
TEST_F(RoundContacts, OfAnEllipsoid) {
  for (int i = 0; i < 3; ++i)
    lower(judged_shapes::ellipsoid<double>(fcl::Vector3d(0.05, 0.03, 0.08)), anyTurn(), 100);
}
TEST_F(RoundContacts, OfACylinder) {
  const auto cylinder = judged_shapes::cylinder<double>(0.05, 0.2);
  for (int i = 0; i < 2; ++i) lower(cylinder, lying(), 20);
  lower(cylinder, leaning(0), 20);
  lower(cylinder, anyTurn(), 20);
}
TEST_F(RoundContacts, OfACoin) {
  const auto coin = judged_shapes::cylinder<double>(0.05, 0.02);
  for (const double angle : {0., 1e-6, 1e-4, 0.01, 0.3, 1.5}) lower(coin, leaning(angle), 20);
  lower(coin, lying(), 20);
}
/// On its base, on its tip, on its side, and leaning.
TEST_F(RoundContacts, OfACone) {
  const auto cone = judged_shapes::cone<double>(0.05, 0.1);
  const double half_turn = 2 * std::acos(0.), on_side = std::atan2(0.05, 0.1) - half_turn / 2;
  for (const double angle : {0., half_turn, half_turn - 0.4, 0.2, 1e-4}) {
    lower(cone, leaning(angle), 20);
  }
  lower(cone, Eigen::AngleAxisd(on_side, fcl::Vector3d::UnitX()).toRotationMatrix(), 20);
}
TEST_F(RoundContacts, OfABox) {
  const auto box = judged_shapes::box<double>(fcl::Vector3d(0.1, 0.05, 0.2));
  for (const double angle : {0., 1e-4, 0.3}) lower(box, leaning(angle), 20);
  lower(box, anyTurn(), 20);
}

/// The bound is that of a linear program, which a fine grid judges from below.
TEST_F(RoundContacts, CuttingPlanesBoundTheLeastOfThem) {
  for (int round = 0; round < 200; ++round) {
    adaptive_bvh::CuttingPlanes planes;
    std::vector<fcl::Vector3d> all;
    double before = std::numeric_limits<double>::infinity();
    for (int n = 0; n < 6; ++n) {
      fcl::Vector3d plane = random_.point();
      if (random_.oneIn(3)) plane = (2 * plane).array().round();
      all.push_back(plane);
      planes.add(plane);
      ASSERT_LE(planes.bound(), before + 1e-14);
      before = planes.bound();
      double highest = -std::numeric_limits<double>::infinity();
      constexpr int kGrid = 40;
      for (int i = 0; i <= kGrid; ++i)
        for (int j = 0; i + j <= kGrid; ++j) {
          const fcl::Vector3d at = fcl::Vector3d(i, j, kGrid - i - j) / kGrid;
          double least = std::numeric_limits<double>::infinity();
          for (const fcl::Vector3d& p : all) least = std::min(least, p.dot(at));
          highest = std::max(highest, least);
        }
      ASSERT_GE(planes.bound(), highest - 1e-14);
      ASSERT_LE(planes.bound(), highest + 0.2);
    }
  }
}

template <typename S>
class EmptyShapes : public testing::Test {};
TYPED_TEST_SUITE(EmptyShapes, MeshScalars);

/// Of each shape one with each of its sizes 0, negative, infinite and NaN: every query refuses it.
TYPED_TEST(EmptyShapes, AreRefusedByEveryQuery) {
  using S = TypeParam;
  const DeformableMesh<S> mesh(latticeBox<S>(1));
  const auto still = fcl::Transform3<S>::Identity();
  for (const S bad :
       {S(0), S(-1), std::numeric_limits<S>::infinity(), std::numeric_limits<S>::quiet_NaN()}) {
    std::vector<std::shared_ptr<fcl::CollisionGeometry<S>>> shapes = {
        std::make_shared<fcl::Sphere<S>>(bad)};
    for (int k = 0; k < 3; ++k) {
      fcl::Vector3<S> sizes(1, 1, 1);
      sizes[k] = bad;
      shapes.push_back(std::make_shared<fcl::Ellipsoid<S>>(sizes));
      shapes.push_back(std::make_shared<fcl::Box<S>>(sizes));
      shapes.push_back(std::make_shared<fcl::Capsule<S>>(sizes[0], sizes[1]));
      shapes.push_back(std::make_shared<fcl::Cylinder<S>>(sizes[0], sizes[1]));
      shapes.push_back(std::make_shared<fcl::Cone<S>>(sizes[0], sizes[1]));
      if (k == 2) shapes.resize(shapes.size() - 3);
    }
    for (const auto& shape : shapes) {
      const fcl::CollisionGeometry<S>& other = *shape;
      adaptive_bvh::VertexContacts<S> contacts;
      fcl::DistanceResult<S> distance;
      fcl::CollisionResult<S> collision;
      EXPECT_THROW(signedDistance(mesh, still, other, still, S(0.1)), std::invalid_argument);
      EXPECT_THROW(vertexContacts(mesh, still, other, still, S(1), contacts),
                   std::invalid_argument);
      const fcl::DistanceRequest<S> how_far;
      const fcl::CollisionRequest<S> whether;
      EXPECT_THROW(adaptive_bvh::distance<S>(&mesh, still, &other, still, how_far, distance),
                   std::invalid_argument);
      EXPECT_THROW(adaptive_bvh::collide<S>(&mesh, still, &other, still, whether, collision),
                   std::invalid_argument);
    }
  }
}

/// Nothing in a result is left as it was in memory.
TYPED_TEST(EmptyShapes, AHalfSpaceCountsNoSearches) {
  using S = TypeParam;
  const DeformableMesh<S> mesh(latticeBox<S>(1));
  const auto still = fcl::Transform3<S>::Identity();
  for (const S height : {S(-1), S(0), S(0.5)}) {
    const fcl::Halfspace<S> ground(fcl::Vector3<S>::UnitZ(), height);
    const fcl::CollisionGeometry<S>& other = ground;
    std::array<unsigned char, 4096> noise;
    noise.fill(0xa5);
    volatile unsigned char sink = noise[std::size_t(17)];
    (void)sink;
    EXPECT_EQ(0u, signedDistance(mesh, still, other, still, S(0.1)).searches);
  }
}

}  // namespace round_contact_test
}  // namespace adaptive_bvh_test
