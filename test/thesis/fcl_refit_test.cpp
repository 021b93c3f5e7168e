// FCL's default refit, bottom-up, is wrong for RSS and OBBRSS. Documented here, so that no one
// takes it for an oracle, and so that we notice when a later FCL mends it.
#include <gtest/gtest.h>

#include <fcl/narrowphase/distance.h>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "support/brute_force.h"
#include "support/long_mode.h"

namespace adaptive_bvh_test {
namespace fcl_refit_test {

template <typename BV>
class FclRefit : public testing::Test {};
using Volumes = testing::Types<fcl::RSSd, fcl::OBBRSSd>;
TYPED_TEST_SUITE(FclRefit, Volumes);

template <typename Model, typename Plain>
double distanceAfter(Model& model, const std::vector<fcl::Vector3<double>>& positions,
                     bool bottomup, const Plain& obstacle, const fcl::Transform3d& tf) {
  model.beginReplaceModel();
  model.replaceSubModel(positions);
  model.endReplaceModel(true, bottomup);
  fcl::DistanceResultd result;
  return fcl::distance(&model, fcl::Transform3d::Identity(), &obstacle, tf, fcl::DistanceRequestd(),
                       result);
}

TYPED_TEST(FclRefit, BottomUpOverestimatesDistancesAndTopDownDoesNot) {
  fcl::BVHModel<TypeParam> bottom_up, top_down, obstacle;
  adaptive_bvh::AdaptiveBVHModel<TypeParam> adaptive;
  const TriangleMesh mesh = plate(8, 8);
  fillModel(mesh, bottom_up);
  fillModel(mesh, top_down);
  fillModel(mesh, adaptive);
  fillModel(dome(12, 5), obstacle);
  Deformation deformation(mesh, Deformation::Kind::Smooth, 21);
  std::mt19937 random(testSeed(4));

  int bottom_up_wrong = 0;
  double worst = 0;
  for (int frame = 0; frame < 60; ++frame) {
    const fcl::Transform3d tf = randomPose(random, 0.8);
    const auto& positions = deformation.next();
    const double by_top_down = distanceAfter(top_down, positions, false, obstacle, tf);
    const double by_bottom_up = distanceAfter(bottom_up, positions, true, obstacle, tf);
    const double by_us = distanceAfter(adaptive, positions, true, obstacle, tf);
    const double exact =
        BruteForce(top_down, fcl::Transform3d::Identity(), obstacle, tf).distance();
    EXPECT_NEAR(exact, by_top_down, 1e-12);
    EXPECT_NEAR(exact, by_us, 1e-12) << "the flag that breaks FCL's refit has no effect on ours";
    EXPECT_GE(by_bottom_up, exact - 1e-12);
    bottom_up_wrong += by_bottom_up > exact + 1e-6;
    worst = std::max(worst, by_bottom_up - exact);
  }
  EXPECT_GT(bottom_up_wrong, 0) << "has FCL mended RSS::operator+? Then say so in the docs";
  this->RecordProperty("frames_wrong_of_60", bottom_up_wrong);
  this->RecordProperty("worst_error_in_mm", int(1000 * worst));
}

}  // namespace fcl_refit_test
}  // namespace adaptive_bvh_test
