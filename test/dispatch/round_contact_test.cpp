// Signed distances of meshes and round shapes in shallow contact, judged by closed forms: of any
// depth, by few searches.
#include <gtest/gtest.h>

#include "adaptive_bvh/penetration.h"
#include "support/closed_bodies.h"
#include "support/meshes.h"
#include "support/random_geometry.h"
#include "support/shape_oracle.h"

namespace adaptive_bvh_test {
namespace round_contact_test {

using adaptive_bvh::DeformableMesh;
using exact::Real;

/// [0, 1]^3, cut into `cells` along each edge.
DeformableMesh cube(int cells) {
  TriangleMesh mesh = latticeBox(cells);
  for (auto& p : mesh.vertices) p /= cells;
  return DeformableMesh(mesh);
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
  void lower(const JudgedShape& shape, const fcl::Matrix3d& turn, std::size_t most) {
    SCOPED_TRACE(shape.name);
    for (const int cells : {1, 3})
      for (double d = 1e-2; d > 5e-10; d /= std::sqrt(10.)) {
        fcl::Transform3d tf = fcl::Transform3d::Identity();
        tf.linear() = turn;
        const Real below = shape.reach(exact::of(fcl::Vector3d(-turn.row(2).transpose())));
        tf.translation() = fcl::Vector3d(0.6 + 0.02 * random_.uniform(), 0.57, 1 + double(below));
        tf.translation()[2] -= d;
        const auto found = adaptive_bvh::signedDistance(cube(cells), fcl::Transform3d::Identity(),
                                                        *shape.geometry, tf, d / 10);
        const double slack = 1e-12, width = std::max(d / 10, 4e-9);
        ASSERT_LE(found.lower, -d + slack) << d;
        ASSERT_GE(found.upper, -d - slack) << d;
        ASSERT_LE(found.upper - found.lower, width) << d;
        ASSERT_LE(found.searches, most) << d;
      }
  }

  RandomGeometry random_{52};
};

TEST_F(RoundContacts, OfASphere) { lower(judged_shapes::sphere(0.05), anyTurn(), 100); }
TEST_F(RoundContacts, OfACapsule) {
  for (int i = 0; i < 3; ++i)
    lower(judged_shapes::capsule(0.05, 0.2), i ? lying() : anyTurn(), 100);
}
TEST_F(RoundContacts, OfAnEllipsoid) {
  for (int i = 0; i < 3; ++i)
    lower(judged_shapes::ellipsoid(fcl::Vector3d(0.05, 0.03, 0.08)), anyTurn(), 100);
}
TEST_F(RoundContacts, OfACylinder) {
  const auto cylinder = judged_shapes::cylinder(0.05, 0.2);
  for (int i = 0; i < 2; ++i) lower(cylinder, lying(), 20);
  lower(cylinder, leaning(0), 20);
  lower(cylinder, anyTurn(), 20);
}
TEST_F(RoundContacts, OfACoin) {
  const auto coin = judged_shapes::cylinder(0.05, 0.02);
  for (const double angle : {0., 1e-6, 1e-4, 0.01, 0.3, 1.5}) lower(coin, leaning(angle), 20);
  lower(coin, lying(), 20);
}
/// On its base, on its tip, on its side, and leaning.
TEST_F(RoundContacts, OfACone) {
  const auto cone = judged_shapes::cone(0.05, 0.1);
  const double half_turn = 2 * std::acos(0.), on_side = std::atan2(0.05, 0.1) - half_turn / 2;
  for (const double angle : {0., half_turn, half_turn - 0.4, 0.2, 1e-4}) {
    lower(cone, leaning(angle), 20);
  }
  lower(cone, Eigen::AngleAxisd(on_side, fcl::Vector3d::UnitX()).toRotationMatrix(), 20);
}
TEST_F(RoundContacts, OfABox) {
  const auto box = judged_shapes::box(fcl::Vector3d(0.1, 0.05, 0.2));
  for (const double angle : {0., 1e-4, 0.3}) lower(box, leaning(angle), 20);
  lower(box, anyTurn(), 20);
}

}  // namespace round_contact_test
}  // namespace adaptive_bvh_test
