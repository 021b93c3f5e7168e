// The rotation of a body as a whole, found again from a few of its vertices.
#include "deformable/body_axes.h"

#include <gtest/gtest.h>

#include "support/random_geometry.h"
#include "thesis/adaptive_tree.h"

namespace adaptive_bvh_test {
namespace body_axes_test {

using adaptive_bvh::BestFitRotation;
using adaptive_bvh::Topology;

class BestFit : public testing::Test {
 protected:
  using BV = fcl::RSSd;

  void start(const TriangleMesh& mesh, const fcl::Matrix3d& axes = fcl::Matrix3d::Identity()) {
    mesh_ = mesh;
    fillModel(mesh, model_);
    model_.computeLocalAABB();
    topology_.assign(model_);
    axes_ = axes;
    fit_.start(model_.vertices, topology_.slots, axes, 1);
  }

  /// Places every vertex where map takes it from rest.
  template <typename Map>
  void place(Map&& map) {
    for (int v = 0; v < model_.num_vertices; ++v)
      model_.vertices[v] = map(mesh_.vertices[std::size_t(v)]);
    model_.computeLocalAABB();
  }

  bool turnsNow() { return fit_.update(model_.vertices, axes_); }

  static fcl::Matrix3d turn(double angle, const fcl::Vector3d& axis) {
    return Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
  }

  TriangleMesh mesh_;
  fcl::BVHModel<BV> model_;
  Topology topology_;
  fcl::Matrix3d axes_;
  BestFitRotation fit_;
};

/// A body turned and carried along, by any rotation of more than 12 degrees: the axes are turned
/// alike, whatever they were at the start.
TEST_F(BestFit, FindsTheRotationOfABody) {
  RandomGeometry random(31);
  for (int round = 0; round < 60; ++round) {
    const fcl::Matrix3d axes = random.rotation();
    start(round % 2 ? tube(5, 6) : plate(6, 4, 2, 1), axes);
    const fcl::Matrix3d R =
        turn(0.22 + 2.8 * std::abs(double(random.uniform())), fcl::Vector3d(1, 2, round - 30));
    const fcl::Vector3d shift = random.point() * 10.;
    place([&](const fcl::Vector3d& p) -> fcl::Vector3d { return R * p + shift; });
    ASSERT_TRUE(turnsNow()) << round;
    const fcl::Matrix3d expected = R * axes;
    ASSERT_TRUE(axes_.isApprox(expected, 1e-9)) << axes_ << "\n\n" << expected;
    EXPECT_FALSE(turnsNow()) << "they are those in use by now";
  }
}

/// Slivers as long as the body: all first corners lie on one side, on one line.
TEST_F(BestFit, FindsTheRotationOfABodyOfSlivers) {
  start(plate(1, 60));
  const fcl::Matrix3d R = turn(0.7, fcl::Vector3d(1, -2, 0.6));
  place([&](const fcl::Vector3d& p) -> fcl::Vector3d { return R * p; });
  ASSERT_TRUE(turnsNow());
  EXPECT_TRUE(axes_.isApprox(R, 1e-9));
}

/// A few degrees are not worth new axes; they add up until they are.
TEST_F(BestFit, LeavesSmallTurnsUntilTheyAddUp) {
  start(tube(5, 6));
  int turned_at = 0;
  for (int degrees = 1; degrees < 30 && turned_at == 0; ++degrees) {
    const fcl::Matrix3d R = turn(degrees * M_PI / 180, fcl::Vector3d(0, 1, 0));
    place([&](const fcl::Vector3d& p) -> fcl::Vector3d { return R * p; });
    if (turnsNow()) turned_at = degrees;
  }
  EXPECT_EQ(12, turned_at) << "at cos < 0.98";
}

/// What bends is no body that turns: a sheet that rolls up, a soup whose parts fly apart.
TEST_F(BestFit, LeavesABodyThatDeforms) {
  start(plate(8, 8));
  place([](const fcl::Vector3d& p) -> fcl::Vector3d {
    return {std::cos(4 * p[0]), p[1], std::sin(4 * p[0])};
  });
  EXPECT_FALSE(turnsNow());
  EXPECT_EQ(fcl::Matrix3d(fcl::Matrix3d::Identity()), axes_);
}

/// Of vertices along one line no rotation about it shows; of a point none at all.
TEST_F(BestFit, LeavesALineAndAPoint) {
  for (const double width : {1., 0.}) {
    TriangleMesh mesh = plate(6, 1);
    for (auto& p : mesh.vertices) p = fcl::Vector3d(p[0] * width, 0, 0);
    start(mesh);
    place([](const fcl::Vector3d& p) -> fcl::Vector3d { return {0, p[0], 0}; });
    EXPECT_FALSE(turnsNow());
  }
}

/// Axes stay a rotation where the body is turned inside out: a reflection is none.
TEST_F(BestFit, NeverReflects) {
  start(plate(6, 4, 2, 1));  // flat: its mirror image is the plate turned over
  place([](const fcl::Vector3d& p) -> fcl::Vector3d { return {-p[0], p[1], p[2]}; });
  EXPECT_TRUE(turnsNow());
  EXPECT_NEAR(1, axes_.determinant(), 1e-5);
  start(tube(5, 6));
  place([](const fcl::Vector3d& p) -> fcl::Vector3d { return {-p[0], p[1], p[2]}; });
  turnsNow();
  EXPECT_NEAR(1, axes_.determinant(), 1e-5);
}

/// At most twelve vertices, each of the mesh, spread over it; one for each triangle of a small one.
TEST_F(BestFit, SamplesAFewVerticesAllOver) {
  start(plate(1, 1));
  EXPECT_EQ(2, fit_.samples().size());
  start(tube(8, 20));
  EXPECT_EQ(12, fit_.samples().size());
  double low = 2, high = 0;
  for (Eigen::Index i = 0; i < fit_.samples().size(); ++i) {
    const unsigned v = fit_.samples()[i];
    ASSERT_LT(v, mesh_.vertices.size());
    low = std::min(low, mesh_.vertices[v][0]);
    high = std::max(high, mesh_.vertices[v][0]);
  }
  EXPECT_GT(high - low, 1) << "of a hose of length 2";
}

}  // namespace body_axes_test
}  // namespace adaptive_bvh_test
