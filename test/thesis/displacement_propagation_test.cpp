// Thesis 4.2 and 4.3 by hand: displacements, leaf inflation, upward propagation, reset on refit.
#include "thesis/displacement_propagation.h"

#include <gtest/gtest.h>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "support/meshes.h"

namespace adaptive_bvh_test {
namespace displacement_propagation_test {

using adaptive_bvh::AdaptiveBVHModeld;
using adaptive_bvh::FitnessCriterion;
using adaptive_bvh::RefitPolicy;
using Point = fcl::Vector3d;

constexpr double kRounding = 1e-14;

/// Four triangles in a row along x, ten apart in pairs, so that FCL's mean split gives
///
///                 0
///             /       \           .
///           1           2
///         /   \       /   \       .
///       3(T)  4(T)  5(T)  6(T)
///
/// The tree determines which leaf holds which triangle. Vertices 3t, 3t+1, 3t+2 belong to triangle
/// t.
class FourTriangles : public testing::Test {
 protected:
  FourTriangles() {
    for (double x : {0.0, 2.0, 12.0, 14.0}) {
      positions_.push_back({x, 0, 0});
      positions_.push_back({x + 1, 0, 0});
      positions_.push_back({x, 1, 0});
    }
    model_.beginModel();
    std::vector<fcl::Triangle> triangles;
    for (std::size_t t = 0; t < 4; ++t) triangles.emplace_back(3 * t, 3 * t + 1, 3 * t + 2);
    model_.addSubModel(positions_, triangles);
    EXPECT_EQ(fcl::BVH_OK, model_.endModel());
    for (int i = 0; i < 7; ++i) {
      const auto& node = model_.getBV(i);
      if (!node.isLeaf()) continue;
      leaf_[node.primitiveId()] = i;
    }
    for (int i : {1, 2})
      for (int child : {model_.getBV(i).leftChild(), model_.getBV(i).rightChild()})
        parent_[model_.getBV(child).primitiveId()] = i;
    EXPECT_EQ(parent_[0], parent_[1]);
    EXPECT_EQ(parent_[2], parent_[3]);
    EXPECT_NE(parent_[0], parent_[2]);
    use(FitnessCriterion::RefitNone);
  }

  void use(FitnessCriterion criterion, bool may_shrink = false, double p_max = 0.1) {
    RefitPolicy policy = RefitPolicy::thesis(criterion);
    policy.reference = adaptive_bvh::InflationReference::NodeSize;
    policy.leaf_radius_may_shrink = may_shrink;
    policy.max_inflation = p_max;
    model_.setRefitPolicy(policy);
  }

  const adaptive_bvh::UpdateReport& move(std::size_t vertex, const Point& by) {
    positions_[vertex] += by;
    const auto& report = model_.update(positions_);
    std::string reason;
    EXPECT_TRUE(model_.validate(&reason)) << reason;
    return report;
  }

  double radius(int node) const { return model_.getBV(node).bv.r; }
  double growth(int node) const { return radius(node) - model_.originalRadius(node); }

  AdaptiveBVHModeld model_;
  std::vector<Point> positions_;
  int leaf_[4] = {}, parent_[4] = {};
};

TEST_F(FourTriangles, OriginalAndCurrentRadiusAreEqualAfterTheBuild) {
  for (int i = 0; i < 7; ++i) EXPECT_EQ(0, growth(i));
}

// Triangle 0: one corner moves by (0.3, 0, 0.4), |.| = 0.5, another by 0.2. D = max = 0.5.
TEST_F(FourTriangles, ATrianglesDisplacementIsTheLargestOfItsCorners) {
  positions_[0] += Point(0.3, 0, 0.4);
  move(1, {0, 0.2, 0});
  EXPECT_NEAR(0.5, model_.latestDisplacement(0), kRounding);
  EXPECT_NEAR(0.5, model_.overallDisplacement(0), kRounding);
  EXPECT_EQ(0, model_.latestDisplacement(1));
  EXPECT_NEAR(0.5, model_.lastUpdate().largest_displacement, kRounding);
}

// Only triangle 0 moves: its leaf, its parent and the root grow by 0.5; the other four do not.
TEST_F(FourTriangles, TheErrorPropagatesFromTheLeafToTheRootAndNowhereElse) {
  const auto& report = move(0, {0.3, 0, 0.4});
  for (int i = 0; i < 7; ++i) {
    const bool above = i == 0 || i == parent_[0] || i == leaf_[0];
    EXPECT_NEAR(above ? 0.5 : 0.0, growth(i), kRounding) << "node " << i;
  }
  EXPECT_EQ(3, report.inflated);
  EXPECT_EQ(7, report.nodes);
  EXPECT_EQ(0, report.refitted());
}

// Triangle 0 moves by 0.5, triangle 2 by 0.2: the root takes the maximum, not the sum.
TEST_F(FourTriangles, AParentTakesTheLargerOfItsChildrensErrors) {
  positions_[6] += Point(0, 0, 0.2);
  move(0, {0.3, 0, 0.4});
  EXPECT_NEAR(0.5, growth(parent_[0]), kRounding);
  EXPECT_NEAR(0.2, growth(parent_[2]), kRounding);
  EXPECT_NEAR(0.5, growth(0), kRounding);
}

// A corner swings out by 0.5 and back. Leaf: D_overall 0.5, then 0; the radius stays (4.3, step 3:
// 0.5 < 0 does not hold). Inner nodes add up the latest displacements: 0.5 + 0.5.
TEST_F(FourTriangles, AnOscillatingVertexInflatesItsLeafOnce) {
  for (int swing = 1; swing <= 4; ++swing) {
    move(0, {0, 0, swing % 2 == 1 ? 0.5 : -0.5});
    EXPECT_NEAR(0.5, model_.latestDisplacement(0), kRounding);
    EXPECT_NEAR(swing % 2 == 1 ? 0.5 : 0.0, model_.overallDisplacement(0), kRounding);
    EXPECT_NEAR(0.5, growth(leaf_[0]), kRounding);
    EXPECT_NEAR(0.5 * swing, growth(parent_[0]), 4 * kRounding);
    EXPECT_NEAR(0.5 * swing, growth(0), 4 * kRounding);
  }
}

TEST_F(FourTriangles, ALeafMayFollowTheVertexBackWhereThePolicySaysSo) {
  use(FitnessCriterion::RefitNone, true);
  move(0, {0, 0, 0.5});
  EXPECT_NEAR(0.5, growth(leaf_[0]), kRounding);
  move(0, {0, 0, -0.4});
  EXPECT_NEAR(0.1, growth(leaf_[0]), kRounding);
}

// The overall displacement is a distance between two positions, not the length of the path.
TEST_F(FourTriangles, TheOverallDisplacementIsMeasuredFromTheReferencePosition) {
  move(0, {0.3, 0, 0});
  move(0, {0, 0.4, 0});
  EXPECT_NEAR(0.4, model_.latestDisplacement(0), kRounding);
  EXPECT_NEAR(0.5, model_.overallDisplacement(0), kRounding);
  EXPECT_NEAR(0.5, growth(leaf_[0]), kRounding);
  EXPECT_NEAR(0.7, growth(parent_[0]), kRounding);
}

TEST_F(FourTriangles, ARefitResetsRadiiAndOverallDisplacement) {
  use(FitnessCriterion::RefitAll);
  const auto& report = move(0, {0.3, 0, 0.4});
  EXPECT_EQ(4, report.refitted_leaves);
  EXPECT_EQ(3, report.refitted_inner);
  EXPECT_EQ(4 * 1 + 2 * 2 + 4, report.refitted_primitives);
  EXPECT_NEAR(0.5, model_.latestDisplacement(0), kRounding) << "the last frame's motion is a fact";
  EXPECT_EQ(0, model_.overallDisplacement(0));
  for (int i = 0; i < 7; ++i) EXPECT_EQ(0, growth(i));

  use(FitnessCriterion::RefitNone);
  move(0, {0, 0, 0.1});  // counted from the refit
  EXPECT_NEAR(0.1, model_.overallDisplacement(0), kRounding);
  EXPECT_NEAR(0.1, growth(leaf_[0]), kRounding);
}

// Half the shorter side is about 0.35 for the leaf and 0.5 for its parent and the root: a growth of
// 0.2 is a factor of 0.57, 0.4 and 0.4. With p_max = 0.5 the leaf alone is unfit.
TEST_F(FourTriangles, RefittingANodeImpliesNothingForTheOthers) {
  use(FitnessCriterion::A, false, 0.5);
  const auto& report = move(0, {0.2, 0, 0});
  EXPECT_EQ(1, report.refitted_leaves);
  EXPECT_EQ(0, report.refitted_inner);
  EXPECT_EQ(0, growth(leaf_[0]));
  EXPECT_NEAR(0.2, growth(parent_[0]), kRounding);
  EXPECT_NEAR(0.2, growth(0), kRounding);
}

// After a two-frame update a volume holds both frames: the leaf still contains where the corner
// was.
TEST_F(FourTriangles, ATwoFrameUpdateKeepsTheFrameBefore) {
  use(FitnessCriterion::RefitNone, true);
  const auto moveOn = [this](const Point& by) {
    positions_[0] += by;
    ASSERT_EQ(fcl::BVH_OK, model_.beginUpdateModel());
    ASSERT_EQ(fcl::BVH_OK, model_.updateSubModel(positions_));
    ASSERT_EQ(fcl::BVH_OK, model_.endUpdateModel());
    std::string reason;
    ASSERT_TRUE(model_.validate(&reason)) << reason;
  };
  moveOn({0, 0, 0.5});
  EXPECT_NEAR(0.5, growth(leaf_[0]), kRounding);
  EXPECT_EQ(0, model_.prev_vertices[0][2]);
  moveOn({0, 0, -0.5});  // back at the reference, but the frame before was 0.5 away
  EXPECT_NEAR(0.5, growth(leaf_[0]), kRounding);
  moveOn({0, 0, 0});  // at rest: both frames are the reference
  EXPECT_LE(growth(leaf_[0]), 0.5 + kRounding);
}

// Also there the latest displacement counts from the frame before, not from the one whose array the
// new frame is written to, two frames back.
TEST_F(FourTriangles, ATwoFrameUpdateMeasuresFromTheFrameBefore) {
  double height = 0;
  for (double step : {0.5, 0.25, -0.125}) {
    height += step;
    positions_[9][2] = height;
    model_.beginUpdateModel();
    model_.updateSubModel(positions_);
    EXPECT_EQ(fcl::BVH_OK, model_.endUpdateModel());
    EXPECT_NEAR(std::abs(step), model_.latestDisplacement(3), kRounding);
    EXPECT_EQ(0, model_.latestDisplacement(0));
    EXPECT_TRUE(model_.validate());
  }
  EXPECT_NEAR(0.875, growth(parent_[3]), 4 * kRounding);
}

}  // namespace displacement_propagation_test
}  // namespace adaptive_bvh_test
