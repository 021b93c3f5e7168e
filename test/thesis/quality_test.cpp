// measureHierarchy, nodesAtDepth and primitivesBelow: of three volumes by hand, and of real trees.
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/hierarchy.h"
#include "scenarios.h"
#include "support/meshes.h"
#include "support/trees.h"

namespace adaptive_bvh_test {
namespace quality_test {

using namespace adaptive_bvh;  // NOLINT: the subject of this file
using Plain = fcl::BVHModel<fcl::RSSd>;
using Point = fcl::Vector3d;

/// Three nodes whose volumes the test writes: the root, and two leaves.
Plain threeNodes(const fcl::RSSd& root, const fcl::RSSd& left, const fcl::RSSd& right) {
  Plain model;
  fillModel(plate(1, 1), model);
  model.getBV(0).bv = root;
  model.getBV(model.getBV(0).leftChild()).bv = left;
  model.getBV(model.getBV(0).rightChild()).bv = right;
  return model;
}

fcl::RSSd rss(const Point& corner, double a, double b, double r) {
  fcl::RSSd bv;
  bv.axis.setIdentity();
  bv.To = corner;
  bv.l[0] = a;
  bv.l[1] = b;
  bv.r = r;
  return bv;
}

TEST(Quality, MeasuresVolumeAreaAndShape) {
  const HierarchyQuality quality = measureHierarchy(
      threeNodes(rss({0, 0, 0}, 4, 2, 0.5), rss({0, 0, 0}, 2, 2, 0), rss({0, 0, 0}, 0, 0, 3)));
  EXPECT_EQ(1, quality.depth);
  EXPECT_DOUBLE_EQ(1, quality.balance);
  ASSERT_EQ(2u, quality.levels.size());
  EXPECT_EQ(1, quality.levels[0].nodes);
  EXPECT_EQ(0, quality.levels[0].leaves);
  EXPECT_EQ(2, quality.levels[1].leaves);
  // A box of 4 x 2 x 1, round all about: half cylinders of 4, 4, 2, 2, and a ball.
  EXPECT_NEAR(8 + M_PI * 0.25 * 6 + M_PI / 6, quality.levels[0].volume, 1e-12);
  EXPECT_NEAR(16 + M_PI * 6 + M_PI, quality.levels[0].area, 1e-12);
  EXPECT_NEAR(36 * M_PI, quality.levels[1].volume, 1e-9) << "a flat square and a ball of radius 3";
  EXPECT_NEAR(8 + 36 * M_PI, quality.levels[1].area, 1e-9);
  EXPECT_NEAR(5. / 3, quality.aspect_ratio, 1e-12);
  EXPECT_EQ(0, quality.levels[1].aspect_ratio) << "leaves do not count";
}

TEST(Quality, MeasuresHowFarSiblingsOverlap) {
  const auto overlap = [](const fcl::RSSd& left, const fcl::RSSd& right) {
    return measureHierarchy(threeNodes(left, left, right)).sibling_overlap;
  };
  const fcl::RSSd square = rss({0, 0, 0}, 1, 1, 0.1);
  EXPECT_DOUBLE_EQ(1, overlap(square, square));
  EXPECT_DOUBLE_EQ(0, overlap(square, rss({1.3, 0, 0}, 1, 1, 0.1)));
  EXPECT_NEAR(0.5, overlap(square, rss({0.6, -1, 0}, 3, 3, 0.1)), 0.04)
      << "half of the smaller lies in the larger, and a tenth is its radius";
  EXPECT_DOUBLE_EQ(1, overlap(rss({0, 0, 0}, 9, 9, 2), square));
  EXPECT_DOUBLE_EQ(1, overlap(rss({0, 0, 0}, 1, 1, 0), rss({0, 0, 0}, 1, 1, 0))) << "flat";
}

TEST(Quality, IsEmptyWithoutATree) {
  const HierarchyQuality quality = measureHierarchy(Plain());
  EXPECT_EQ(0, quality.depth);
  EXPECT_TRUE(quality.levels.empty());
  EXPECT_TRUE(nodesAtDepth(Plain(), 3).empty());
}

/// Of OBBRSS the swept sphere is measured, and both strategies build the same tree as of RSS.
TEST(Quality, OfOBBRSSIsThatOfItsSweptSpheres) {
  for (const auto strategy : {HierarchyStrategy::BottomUp, HierarchyStrategy::TopDown}) {
    AdaptiveBVHModeld swept(strategy);
    AdaptiveOBBRSSModeld both(strategy);
    fillModel(scenarios::helmet().mesh(), swept);
    fillModel(scenarios::helmet().mesh(), both);
    EXPECT_EQ(groupsOf(swept), groupsOf(both));
    const HierarchyQuality a = measureHierarchy(swept), b = measureHierarchy(both);
    ASSERT_EQ(a.levels.size(), b.levels.size());
    for (std::size_t d = 0; d < a.levels.size(); ++d) {
      EXPECT_EQ(a.levels[d].nodes, b.levels[d].nodes);
      EXPECT_DOUBLE_EQ(a.levels[d].volume, b.levels[d].volume);
      EXPECT_DOUBLE_EQ(a.levels[d].area, b.levels[d].area);
    }
    EXPECT_DOUBLE_EQ(a.aspect_ratio, b.aspect_ratio);
    EXPECT_DOUBLE_EQ(a.sibling_overlap, b.sibling_overlap);
    EXPECT_EQ(nodesAtDepth(swept, 3), nodesAtDepth(both, 3));
    EXPECT_EQ(primitivesBelow(swept, 1).size(), primitivesBelow(both, 1).size());
  }
}

TEST(Quality, CutsHoldEveryTriangleOnce) {
  AdaptiveBVHModeld model;
  fillModel(scenarios::helmet().mesh(), model);
  for (int depth : {0, 1, 5, 9, 10, 50}) {
    std::multiset<int> triangles;
    for (int node : nodesAtDepth(model, depth))
      for (int t : primitivesBelow(model, node)) triangles.insert(t);
    ASSERT_EQ(710u, triangles.size()) << depth;
    EXPECT_EQ(710u, std::set<int>(triangles.begin(), triangles.end()).size());
  }
  EXPECT_EQ(8u, nodesAtDepth(model, 3).size());
}

}  // namespace quality_test
}  // namespace adaptive_bvh_test
