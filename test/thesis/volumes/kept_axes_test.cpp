// RefitPolicy::axes_tolerance: the axes of a volume are kept, turned with the node, until they suit
// it no longer.
#include "thesis/volumes/kept_axes.h"

#include <gtest/gtest.h>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "support/long_mode.h"
#include "support/meshes.h"
#include "thesis/volumes/volume.h"

namespace adaptive_bvh_test {
namespace kept_axes_test {

using adaptive_bvh::RefitPolicy;

template <typename BV>
class KeptAxesOf : public testing::Test {
 protected:
  using Model = adaptive_bvh::AdaptiveBVHModel<BV>;
  using Points = std::vector<fcl::Vector3<double>>;

  /// All refitted in every step.
  static RefitPolicy tolerating(double share) {
    RefitPolicy policy;
    policy.criterion = adaptive_bvh::FitnessCriterion::RefitAll;
    policy.axes_tolerance = share;
    return policy;
  }

  KeptAxesOf() {
    for (Model* model : {&default_, &keeping_, &choosing_}) fillModel(mesh_, *model);
  }
  void update(const Points& points) {
    for (Model* model : {&default_, &keeping_, &choosing_}) {
      model->update(points);
      std::string reason;
      ASSERT_TRUE(model->validate(&reason)) << reason;
    }
  }
  static const fcl::Matrix3d& axes(const Model& model, int node) {
    return adaptive_bvh::Volume<BV>::axes(model.getBV(node).bv);
  }
  static double surface(const Model& model, int node) {
    return adaptive_bvh::Volume<BV>::surfaceArea(model.getBV(node).bv);
  }
  /// Calls visit(node) for the nodes whose axes are kept.
  template <typename Visit>
  void forEachLarge(Visit&& visit) const {
    for (int i = 0; i < default_.getNumBVs(); ++i)
      if (default_.getBV(i).num_primitives > 2) visit(i);
  }
  static Points map(Points points, const fcl::Matrix3d& by) {
    for (auto& p : points) p = by * p + fcl::Vector3<double>(0.1, 0.2, 0.3);
    return points;
  }

  const TriangleMesh mesh_ = tube(12, 9);
  Model default_{tolerating(0.25)}, keeping_{tolerating(1e30)}, choosing_{tolerating(0)};
};

using Volumes = testing::Types<fcl::RSSd, fcl::OBBRSSd>;
TYPED_TEST_SUITE(KeptAxesOf, Volumes);

/// Turned by any angle, also with a little strain: the axes turn along, and are not chosen anew.
TYPED_TEST(KeptAxesOf, TurnWithTheirNode) {
  std::vector<fcl::Matrix3d> before(std::size_t(this->default_.getNumBVs()));
  this->forEachLarge([&](int i) { before[std::size_t(i)] = this->axes(this->default_, i); });
  std::mt19937 random(testSeed(5));
  for (int step = 0; step < 10; ++step) {
    const fcl::Matrix3d turn = randomPose(random, 0).linear();
    const double strain = step % 2 ? 1.01 : 1;
    this->update(this->map(this->mesh_.vertices, turn * fcl::Vector3d(strain, 1, 1).asDiagonal()));
    this->forEachLarge([&](int i) {
      const fcl::Matrix3d found = this->axes(this->default_, i);
      ASSERT_LE((found - turn * before[std::size_t(i)]).norm(), 0.02 * strain * strain) << i;
      ASSERT_EQ(this->axes(this->keeping_, i), found) << "chosen anew";
    });
  }
}

/// Where a patch deforms beyond the tolerance, its axes are chosen anew, and are better ones; where
/// it does not, they stay.
TYPED_TEST(KeptAxesOf, AreChosenAnewBeyondTheTolerance) {
  Deformation crumple(this->mesh_, Deformation::Kind::Jerky, 3);
  for (int step = 0; step < 6; ++step) crumple.next();  // of a few vertices
  this->update(crumple.positions());
  int kept = 0, anew = 0;
  this->forEachLarge([&](int i) {
    ASSERT_LE(this->surface(this->default_, i), this->surface(this->keeping_, i) * (1 + 1e-4));
    ASSERT_LE(this->surface(this->choosing_, i), this->surface(this->default_, i) * (1 + 1e-4));
    const bool same = this->axes(this->default_, i) == this->axes(this->keeping_, i);
    (same ? kept : anew) += 1;
    if (same) return;
    EXPECT_LT(this->surface(this->default_, i), this->surface(this->keeping_, i));
  });
  EXPECT_GT(anew, 5);
  EXPECT_GT(kept, 5);
  // From then on the new ones are kept.
  std::vector<fcl::Matrix3d> before(std::size_t(this->default_.getNumBVs()));
  this->forEachLarge([&](int i) { before[std::size_t(i)] = this->axes(this->default_, i); });
  const fcl::Matrix3d turn =
      Eigen::AngleAxisd(2.5, fcl::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
  this->update(this->map(crumple.positions(), turn));
  this->forEachLarge([&](int i) {
    EXPECT_LE((this->axes(this->default_, i) - turn * before[std::size_t(i)]).norm(), 0.02) << i;
  });
}

TEST(RefitPolicyCheck, AxesToleranceIsFiniteAndNotNegative) {
  for (const double wrong :
       {-0.01, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
    RefitPolicy policy;
    policy.axes_tolerance = wrong;
    try {
      policy.check();
      FAIL() << wrong;
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string::npos, std::string(error.what()).find("axes_tolerance"));
    }
  }
  RefitPolicy policy;
  policy.axes_tolerance = 0;
  policy.check();
}

}  // namespace kept_axes_test
}  // namespace adaptive_bvh_test
