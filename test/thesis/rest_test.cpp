// A step that moves no vertex is judged like any other (thesis 4.3): by what queries have visited
// since the step before. Which volumes are unfit is computed here from the model's public state.
#include <gtest/gtest.h>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/query.h"
#include "support/containment.h"

namespace adaptive_bvh_test {
namespace rest_test {

using adaptive_bvh::FitnessCriterion;
using adaptive_bvh::InflationReference;
using adaptive_bvh::Propagation;
using adaptive_bvh::RefitPolicy;
using Model = adaptive_bvh::AdaptiveBVHModeld;

class Rest : public testing::TestWithParam<std::tuple<Propagation, FitnessCriterion>> {
 protected:
  Rest() {
    RefitPolicy policy = RefitPolicy::thesis(criterion());
    policy.propagation = std::get<0>(GetParam());
    policy.max_inflation = 0.5;
    model_.setRefitPolicy(policy);
    fillModel(mesh_, model_);
    fillModel(tube(8, 20), other_);
  }
  static FitnessCriterion criterion() { return std::get<1>(GetParam()); }
  /// Whether the criterion depends on test B alone, or on tests A and B: these are computed here.
  static bool isOfAAndB() {
    return criterion() == FitnessCriterion::B || criterion() == FitnessCriterion::AB;
  }

  /// Moves in a few steps. Queries between them visit one corner, so that other volumes are
  /// inflated.
  void move() {
    for (int step = 0; step < 6; ++step) {
      query({2, 2, 0.5});
      model_.update(deformation_.next());
    }
  }
  void query(const Eigen::Vector3d& at) const {
    fcl::Transform3d tf = fcl::Transform3d::Identity();
    tf.linear() = Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 3).normalized()).matrix();
    tf.translation() = at;
    fcl::DistanceResultd result;
    adaptive_bvh::distance(&model_, fcl::Transform3d::Identity(), &other_, tf,
                           fcl::DistanceRequestd(), result);
  }
  /// A step at rest, by `update` or by FCL's calls.
  void rest(bool by_fcl) {
    const std::vector<fcl::Vector3d> same = deformation_.positions();
    if (by_fcl) {
      model_.beginReplaceModel();
      model_.replaceSubModel(same);
      EXPECT_EQ(fcl::BVH_OK, model_.endReplaceModel());
    } else {
      model_.update(same);
    }
    EXPECT_EQ(0, model_.lastUpdate().largest_displacement);
    EXPECT_EQ(0, model_.lastUpdate().propagated());
    EXPECT_FALSE(model_.lastUpdate().resynchronised);
  }
  std::vector<int> visitedNodes(double least_factor) const {
    std::vector<int> nodes;
    for (int i = 0; i < model_.getNumBVs(); ++i) {
      const double before = model_.originalRadius(i);
      if (model_.traversed(i) && model_.getBV(i).bv.r - before > least_factor * before)
        nodes.push_back(i);
    }
    return nodes;
  }

  const TriangleMesh mesh_ = plate(14, 14);
  Deformation deformation_{mesh_, Deformation::Kind::Smooth, 1};
  Model model_, other_;
};

INSTANTIATE_TEST_SUITE_P(
    AllCriteria, Rest,
    testing::Combine(testing::Values(Propagation::TranslationCompensated,
                                     Propagation::Displacements),
                     testing::Values(FitnessCriterion::A, FitnessCriterion::B, FitnessCriterion::AB,
                                     FitnessCriterion::BC, FitnessCriterion::ABC,
                                     FitnessCriterion::AOrBC, FitnessCriterion::ABOrBC,
                                     FitnessCriterion::RefitAll, FitnessCriterion::RefitNone)));

/// What a query visited is unfit in the step at rest after it, and fit in the next one.
TEST_P(Rest, IsJudgedByWhatQueriesVisited) {
  move();
  for (const bool by_fcl : {false, true}) {
    query({-0.4, 0.4, by_fcl ? 0.5 : 0.6});
    const double least = criterion() == FitnessCriterion::B ? -1 : 0.5;
    const std::vector<int> unfit = visitedNodes(least);
    rest(by_fcl);
    const std::vector<int> refitted = model_.refittedNodes();
    EXPECT_EQ(int(refitted.size()), model_.lastUpdate().refitted());
    if (isOfAAndB()) {
      if (!by_fcl) {
        EXPECT_GT(unfit.size(), 3u);
      }
      // With Propagation::TranslationCompensated also nodes whose turn it is, one in 64.
      EXPECT_TRUE(std::includes(refitted.begin(), refitted.end(), unfit.begin(), unfit.end()));
      EXPECT_LE(refitted.size(), unfit.size() + std::size_t(model_.getNumBVs()) / 64 + 1);
    }
    if (criterion() == FitnessCriterion::RefitAll) {
      EXPECT_EQ(model_.getNumBVs(), int(refitted.size()));
    }
    if (criterion() == FitnessCriterion::A || criterion() == FitnessCriterion::RefitNone) {
      EXPECT_TRUE(refitted.empty());
    }
    for (const int node : refitted)
      EXPECT_NEAR(model_.getBV(node).bv.r, model_.originalRadius(node), 1e-12);
    EXPECT_EQ(0, model_.recordedWork().queries);
    long checked = 0;
    EXPECT_EQ(0, failures(model_, checked));
  }
}

/// No corner has moved in the last step.
TEST_P(Rest, HasNoLatestDisplacements) {
  move();
  double overall = 0;
  for (int t = 0; t < model_.num_tris; ++t)
    overall = std::max(overall, model_.overallDisplacement(t));
  rest(false);
  for (int t = 0; t < model_.num_tris; ++t) EXPECT_EQ(0, model_.latestDisplacement(t));
  if (criterion() == FitnessCriterion::RefitNone &&
      std::get<0>(GetParam()) == Propagation::Displacements) {
    EXPECT_GT(overall, 0) << "the overall ones stay";
    EXPECT_GT(model_.overallDisplacement(0), 0);
  }
}

/// Positions that were refused are not what a step at rest fits to.
TEST_P(Rest, FitsToThePositionsThatWereTaken) {
  move();
  auto wrong = deformation_.positions();
  for (fcl::Vector3d& p : wrong) p += fcl::Vector3d(1, 2, 3);
  wrong.back()[0] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(model_.update(wrong), std::invalid_argument);
  query({-0.4, 0.4, 0.6});
  rest(true);
  long checked = 0;
  EXPECT_EQ(0, failures(model_, checked));
}

}  // namespace rest_test
}  // namespace adaptive_bvh_test
