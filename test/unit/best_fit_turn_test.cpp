// The rotation of a body as a whole, found again from a few of its vertices.
#include "deformable/body_axes.h"

#include <gtest/gtest.h>

#include "support/random_geometry.h"
#include "volumes/adaptive_tree.h"

namespace adaptive_bvh_test {
namespace best_fit_turn_test {

using adaptive_bvh::BestFitTurn;
using adaptive_bvh::Topology;

template <typename S>
class BestFit : public testing::Test {
 protected:
  using BV = fcl::RSS<S>;

  void start(const TriangleMesh<S>& mesh, const fcl::Matrix3d& axes = fcl::Matrix3d::Identity()) {
    mesh_ = mesh;
    fillModel(mesh, model_);
    model_.computeLocalAABB();
    topology_.adopt(model_);
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

  bool turnsNow() { return fit_.turn(model_.vertices, axes_); }

  static fcl::Matrix3<S> turn(double angle, const fcl::Vector3d& axis) {
    return Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix().template cast<S>();
  }

  TriangleMesh<S> mesh_;
  fcl::BVHModel<BV> model_;
  Topology topology_;
  fcl::Matrix3d axes_;
  BestFitTurn fit_;
};

using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(BestFit, Scalars);

/// A body turned and carried along, by any rotation of more than 12 degrees: the axes are turned
/// alike, whatever they were at the start.
TYPED_TEST(BestFit, FindsTheRotationOfABody) {
  using S = TypeParam;
  RandomGeometry<S> random(31);
  for (int round = 0; round < 60; ++round) {
    const fcl::Matrix3d start = random.rotation().template cast<double>();
    this->start(round % 2 ? tube<S>(5, 6) : plate<S>(6, 4, 2, 1), start);
    const fcl::Matrix3<S> R = this->turn(0.22 + 2.8 * std::abs(double(random.uniform())),
                                         fcl::Vector3d(1, 2, round - 30));
    const Vector3<S> shift = random.point() * S(10);
    this->place([&](const Vector3<S>& p) -> Vector3<S> { return R * p + shift; });
    ASSERT_TRUE(this->turnsNow()) << round;
    const fcl::Matrix3d expected = R.template cast<double>() * start;
    ASSERT_TRUE(this->axes_.isApprox(expected, std::is_same<S, float>::value ? 1e-4 : 1e-9))
        << this->axes_ << "\n\n"
        << expected;
    EXPECT_FALSE(this->turnsNow()) << "they are those in use by now";
  }
}

/// Slivers as long as the body: all first corners lie on one side, on one line.
TYPED_TEST(BestFit, FindsTheRotationOfABodyOfSlivers) {
  using S = TypeParam;
  this->start(plate<S>(1, 60));
  const fcl::Matrix3<S> R = this->turn(0.7, fcl::Vector3d(1, -2, 0.6));
  this->place([&](const Vector3<S>& p) -> Vector3<S> { return R * p; });
  ASSERT_TRUE(this->turnsNow());
  EXPECT_TRUE(
      this->axes_.isApprox(R.template cast<double>(), std::is_same<S, float>::value ? 1e-4 : 1e-9));
}

/// A few degrees are not worth new axes; they add up until they are.
TYPED_TEST(BestFit, LeavesSmallTurnsUntilTheyAddUp) {
  using S = TypeParam;
  this->start(tube<S>(5, 6));
  int turned_at = 0;
  for (int degrees = 1; degrees < 30 && turned_at == 0; ++degrees) {
    const fcl::Matrix3<S> R = this->turn(degrees * M_PI / 180, fcl::Vector3d(0, 1, 0));
    this->place([&](const Vector3<S>& p) -> Vector3<S> { return R * p; });
    if (this->turnsNow()) turned_at = degrees;
  }
  EXPECT_EQ(12, turned_at) << "at cos < 0.98";
}

/// What bends is no body that turns: a sheet that rolls up, a soup whose parts fly apart.
TYPED_TEST(BestFit, LeavesABodyThatDeforms) {
  using S = TypeParam;
  this->start(plate<S>(8, 8));
  this->place([](const Vector3<S>& p) -> Vector3<S> {
    return {std::cos(4 * p[0]), p[1], std::sin(4 * p[0])};
  });
  EXPECT_FALSE(this->turnsNow());
  EXPECT_EQ(fcl::Matrix3d(fcl::Matrix3d::Identity()), this->axes_);
}

/// Of vertices along one line no rotation about it shows; of a point none at all.
TYPED_TEST(BestFit, LeavesALineAndAPoint) {
  using S = TypeParam;
  for (const S width : {S(1), S(0)}) {
    TriangleMesh<S> mesh = plate<S>(6, 1);
    for (auto& p : mesh.vertices) p = Vector3<S>(p[0] * width, 0, 0);
    this->start(mesh);
    this->place([](const Vector3<S>& p) -> Vector3<S> { return {0, p[0], 0}; });
    EXPECT_FALSE(this->turnsNow());
  }
}

/// Axes stay a rotation where the body is turned inside out: a reflection is none.
TYPED_TEST(BestFit, NeverReflects) {
  using S = TypeParam;
  this->start(plate<S>(6, 4, 2, 1));  // flat: its mirror image is the plate turned over
  this->place([](const Vector3<S>& p) -> Vector3<S> { return {-p[0], p[1], p[2]}; });
  EXPECT_TRUE(this->turnsNow());
  EXPECT_NEAR(1, this->axes_.determinant(), 1e-5);
  this->start(tube<S>(5, 6));
  this->place([](const Vector3<S>& p) -> Vector3<S> { return {-p[0], p[1], p[2]}; });
  this->turnsNow();
  EXPECT_NEAR(1, this->axes_.determinant(), 1e-5);
}

/// At most twelve vertices, each of the mesh, spread over it; one for each triangle of a small one.
TYPED_TEST(BestFit, SamplesAFewVerticesAllOver) {
  using S = TypeParam;
  this->start(plate<S>(1, 1));
  EXPECT_EQ(2, this->fit_.samples().size());
  this->start(tube<S>(8, 20));
  EXPECT_EQ(12, this->fit_.samples().size());
  S low = 2, high = 0;
  for (Eigen::Index i = 0; i < this->fit_.samples().size(); ++i) {
    const unsigned v = this->fit_.samples()[i];
    ASSERT_LT(v, this->mesh_.vertices.size());
    low = std::min(low, this->mesh_.vertices[v][0]);
    high = std::max(high, this->mesh_.vertices[v][0]);
  }
  EXPECT_GT(high - low, 1) << "of a hose of length 2";
}

}  // namespace best_fit_turn_test
}  // namespace adaptive_bvh_test
