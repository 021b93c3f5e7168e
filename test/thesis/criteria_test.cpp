// The fitness criteria mean what refit_policy.h says, with either propagation.
#include <gtest/gtest.h>

#include <set>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/query.h"
#include "support/brute_force.h"

namespace adaptive_bvh_test {
namespace criteria_test {

using adaptive_bvh::FitnessCriterion;
using adaptive_bvh::Propagation;
using adaptive_bvh::QueryWork;
using adaptive_bvh::RefitPolicy;
using Model = adaptive_bvh::AdaptiveBVHModeld;

const fcl::Transform3d kOrigin = fcl::Transform3d::Identity();

fcl::Transform3d above() {
  fcl::Transform3d tf = kOrigin;
  tf.linear() = Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 3).normalized()).matrix();
  tf.translation() = Eigen::Vector3d(-0.4, 0.4, 0.6);
  return tf;
}

class Criteria : public testing::TestWithParam<Propagation> {
 protected:
  Criteria() : sheet_(plate(14, 14)), hose_(tube(8, 20)) {}

  RefitPolicy policy(FitnessCriterion criterion) const {
    RefitPolicy policy;
    policy.propagation = GetParam();
    policy.criterion = criterion;
    policy.max_inflation = 0.3;
    policy.child_distance_ratio = 0.3;
    policy.min_inflation = 0.05;
    return policy;
  }

  /// Nodes refitted in 40 frames of an update and a query each.
  int refitsWith(FitnessCriterion criterion) const {
    Model first(policy(criterion)), second(policy(criterion));
    fillModel(sheet_, first);
    fillModel(hose_, second);
    Deformation bend(sheet_, Deformation::Kind::Smooth, 1),
        swing(hose_, Deformation::Kind::Smooth, 2);
    int refits = 0;
    for (int frame = 0; frame < 40; ++frame) {
      first.update(bend.next());
      second.update(swing.next());
      if (frame > 0) refits += first.lastUpdate().refitted() + second.lastUpdate().refitted();
      fcl::DistanceResultd result;
      adaptive_bvh::distance(&first, kOrigin, &second, above(), fcl::DistanceRequestd(), result);
      if (frame % 13 == 0) {
        EXPECT_NEAR(BruteForce(first, kOrigin, second, above()).distance(), result.min_distance,
                    1e-12);
      }
    }
    return refits;
  }

  TriangleMesh sheet_, hose_;
};

INSTANTIATE_TEST_SUITE_P(Propagations, Criteria,
                         testing::Values(Propagation::TranslationCompensated,
                                         Propagation::Displacements),
                         [](const auto& info) {
                           return info.param == Propagation::TranslationCompensated
                                      ? "TranslationCompensated"
                                      : "Displacements";
                         });

TEST_P(Criteria, EveryTestMatters) {
  const int a = refitsWith(FitnessCriterion::A), b = refitsWith(FitnessCriterion::B),
            ab = refitsWith(FitnessCriterion::AB), bc = refitsWith(FitnessCriterion::BC),
            abc = refitsWith(FitnessCriterion::ABC), a_or_bc = refitsWith(FitnessCriterion::AOrBC),
            ab_or_bc = refitsWith(FitnessCriterion::ABOrBC);
  EXPECT_GT(bc, 0);
  EXPECT_GT(abc, 0);
  EXPECT_LT(bc, b);
  EXPECT_LT(ab, a);
  EXPECT_NE(ab, ab_or_bc);
  EXPECT_NE(a, a_or_bc);
}

/// A node that a query went below counts as visited, and its parents with it: a search from the
/// roots gets nowhere else. The next update refits these and no others.
TEST_P(Criteria, BIsEveryNodeThatAQueryWentBelow) {
  Model first(policy(FitnessCriterion::B)), second(policy(FitnessCriterion::B));
  fillModel(sheet_, first);
  fillModel(hose_, second);
  Deformation bend(sheet_, Deformation::Kind::Smooth, 3);
  first.update(bend.next());
  for (const Model* model : {&first, &second})
    for (int i = 0; i < model->getNumBVs(); ++i) ASSERT_FALSE(model->traversed(i));
  fcl::DistanceResultd result;
  adaptive_bvh::distance(&first, kOrigin, &second, above(), fcl::DistanceRequestd(), result);
  for (const Model* model : {&first, &second}) {
    EXPECT_TRUE(model->traversed(0));
    for (int i = 0; i < model->getNumBVs(); ++i) {
      const auto& node = model->getBV(i);
      if (node.isLeaf()) continue;
      if (!model->traversed(i)) {
        ASSERT_FALSE(model->traversed(node.leftChild())) << i;
        ASSERT_FALSE(model->traversed(node.rightChild())) << i;
      }
    }
  }
  std::set<int> visited;
  for (int i = 0; i < first.getNumBVs(); ++i)
    if (first.traversed(i)) visited.insert(i);
  EXPECT_GT(visited.size(), 5u);
  EXPECT_LT(visited.size(), std::size_t(first.getNumBVs()) / 2);
  first.update(bend.next());
  EXPECT_EQ(int(visited.size()), first.lastUpdate().refitted());
}

/// Each kind of test is counted by itself, also against a model of FCL's.
TEST_P(Criteria, CountsAreKeptApart) {
  Model first(policy(FitnessCriterion::AB)), second(policy(FitnessCriterion::AB));
  fillModel(sheet_, first);
  fillModel(hose_, second);
  const fcl::BVHModel<fcl::RSSd> plain(second);
  const auto ask = [&](const fcl::BVHModel<fcl::RSSd>& other) -> QueryWork {
    const QueryWork before = first.recordedWork();
    fcl::DistanceResultd result;
    adaptive_bvh::distance(&first, kOrigin, &other, above(), fcl::DistanceRequestd(), result);
    QueryWork work = first.recordedWork();
    work.box_tests -= before.box_tests;
    work.bv_tests -= before.bv_tests;
    work.leaf_tests -= before.leaf_tests;
    return work;
  };
  for (const QueryWork& work : {ask(second), ask(plain)}) {
    EXPECT_EQ(0, work.box_tests);
    EXPECT_GT(work.bv_tests, work.leaf_tests);
    EXPECT_GT(work.leaf_tests, 0);
  }
  EXPECT_EQ(2, first.recordedWork().queries);
  EXPECT_EQ(1, second.recordedWork().queries);
}

}  // namespace criteria_test
}  // namespace adaptive_bvh_test
