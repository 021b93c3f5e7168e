// Which volumes the last update recomputed: thesis/adaptive_tree.h, and
// AdaptiveBVHModel::refittedNodes.
#include "thesis/adaptive_tree.h"

#include <gtest/gtest.h>

#include <numeric>
#include <vector>

#include "adaptive_bvh/adaptive_bvh_model.h"

namespace adaptive_bvh_test {
namespace refit_marks_test {

using adaptive_bvh::AdaptiveBVHModeld;
using adaptive_bvh::FitnessCriterion;
using adaptive_bvh::RefitMarks;
using adaptive_bvh::RefitPolicy;

std::vector<int> allNodes(const AdaptiveBVHModeld& model) {
  std::vector<int> nodes(static_cast<std::size_t>(model.getNumBVs()));
  std::iota(nodes.begin(), nodes.end(), 0);
  return nodes;
}

/// Marks hold for one step, also where the number of steps starts again.
TEST(RefitMarks, HoldForOneStep) {
  RefitMarks marks;
  EXPECT_TRUE(marks.marked().empty());
  marks.reset(5);
  for (int step = 0; step < 600; ++step) {
    EXPECT_TRUE(marks.marked().empty()) << "step " << step;
    marks.mark(4);
    marks.mark(step % 4);
    EXPECT_EQ(marks.marked(), (std::vector<int>{step % 4, 4}));
    marks.clear();
  }
  marks.markAll();
  EXPECT_EQ(marks.marked().size(), 5u);
}

/// A model of two rows of triangles, and its positions at time t.
std::vector<fcl::Vector3d> strip(double t) {
  std::vector<fcl::Vector3d> points;
  for (int i = 0; i < 40; ++i)
    for (int k = 0; k < 2; ++k) points.emplace_back(i, k * (1 + t * i), 0.1 * t * i * i);
  return points;
}
void build(AdaptiveBVHModeld& model) {
  std::vector<fcl::Triangle> triangles;
  for (std::size_t i = 0; i + 2 < 80; ++i) triangles.emplace_back(i, i + 1, i + 2);
  model.beginModel();
  model.addSubModel(strip(0), triangles);
  model.endModel();
}

/// As many as the report says, by every criterion: none, some or all.
TEST(RefittedNodes, AreThoseThatTheReportCounts) {
  for (const auto criterion : {FitnessCriterion::A, FitnessCriterion::AB,
                               FitnessCriterion::RefitAll, FitnessCriterion::RefitNone}) {
    for (const RefitPolicy& policy : {RefitPolicy::thesis(criterion), [&] {
                                        RefitPolicy ours;
                                        ours.criterion = criterion;
                                        return ours;
                                      }()}) {
      AdaptiveBVHModeld model(policy);
      build(model);
      EXPECT_TRUE(model.refittedNodes().empty()) << "a build";
      for (int step = 1; step <= 5; ++step) {
        model.update(strip(0.02 * step));
        const std::vector<int> nodes = model.refittedNodes();
        EXPECT_EQ(nodes.size(), static_cast<std::size_t>(model.lastUpdate().refitted()));
        for (const int node : nodes)
          EXPECT_NEAR(model.getBV(node).bv.r, model.originalRadius(node), 1e-12);
      }
      if (criterion == FitnessCriterion::RefitAll) {
        EXPECT_EQ(model.refittedNodes(), allNodes(model));
      }
      const AdaptiveBVHModeld copy(model);
      EXPECT_EQ(copy.refittedNodes(), model.refittedNodes());
      model.update(strip(0.1));
      model.update(strip(0.1));
      EXPECT_EQ(model.refittedNodes().size(),
                static_cast<std::size_t>(model.lastUpdate().refitted()))
          << "at rest";
    }
  }
}

/// A refused step leaves them as they were; a repair recomputes all.
TEST(RefittedNodes, RefusalsAndRepairs) {
  AdaptiveBVHModeld model;
  build(model);
  model.update(strip(0.3));
  const std::vector<int> before = model.refittedNodes();
  EXPECT_FALSE(before.empty());
  EXPECT_THROW(model.update({fcl::Vector3d::Zero()}), std::invalid_argument);
  EXPECT_EQ(model.refittedNodes(), before);

  fcl::BVHModel<fcl::RSSd>& foreign = model;
  foreign.beginReplaceModel();
  foreign.replaceSubModel(strip(0.5));
  foreign.endReplaceModel();
  EXPECT_EQ(model.refittedNodes(), allNodes(model));
}

}  // namespace refit_marks_test
}  // namespace adaptive_bvh_test
