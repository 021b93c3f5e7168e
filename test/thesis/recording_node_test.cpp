// What a recording traversal leaves behind: visits (test B) and child gaps (test C), by hand.
#include "thesis/recording_node.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <thread>
#include <vector>

#include <fcl/narrowphase/detail/traversal/collision_node.h>
#include <fcl/narrowphase/detail/traversal/distance/distance_traversal_node_base.h>

namespace adaptive_bvh_test {
namespace recording_node_test {

using adaptive_bvh::PairStatistics;
using adaptive_bvh::QueryWork;
using adaptive_bvh::TraversalStatistics;

/// Two trees of the same shape, and distances as the test writes them down.
///
///        0
///      /   \         .
///    1(T)   2
///         /   \      .
///       3(T)  4(T)
///
/// The first tree is split as long as it is not at a leaf.
class ScriptedNode : public fcl::detail::DistanceTraversalNodeBase<double> {
 public:
  static bool isLeaf(int b) { return b == 1 || b == 3 || b == 4; }
  static int left(int b) { return b == 0 ? 1 : 3; }

  bool isFirstNodeLeaf(int b) const override { return isLeaf(b); }
  bool isSecondNodeLeaf(int b) const override { return isLeaf(b); }
  bool firstOverSecond(int b1, int) const override { return !isLeaf(b1); }
  int getFirstLeftChild(int b) const override { return left(b); }
  int getFirstRightChild(int b) const override { return left(b) + 1; }
  int getSecondLeftChild(int b) const override { return left(b); }
  int getSecondRightChild(int b) const override { return left(b) + 1; }
  void enableStatistics(bool) override {}

  double BVTesting(int b1, int b2) const override {
    ++tests;
    return distances.at({b1, b2});
  }
  void leafTesting(int b1, int b2) const override {
    least = std::min(least, triangle_distances.at({b1, b2}));
  }
  bool canStop(double c) const override { return c >= least; }

  std::map<std::pair<int, int>, double> distances, triangle_distances;
  mutable double least = 1e9;
  mutable int tests = 0;
};

class Recording : public testing::Test {
 protected:
  Recording() : first_(statistics(5)), second_(statistics(5)) {}

  static TraversalStatistics statistics(int nodes) {
    TraversalStatistics e;
    e.reset(nodes);
    return e;
  }

  /// Runs FCL's recursion; returns the number of volume tests.
  int run(const ScriptedNode& script) {
    PairStatistics sides;
    sides.side[0] = &first_;
    sides.side[1] = &second_;
    adaptive_bvh::RecordingDistanceNode<ScriptedNode> node(sides);
    node.distances = script.distances;
    node.triangle_distances = script.triangle_distances;
    fcl::detail::distance(&node);
    return node.tests;
  }

  TraversalStatistics first_, second_;
};

// (0,0) is split in the first tree: (1,0) = 2, (2,0) = 5. No distance of (0,0) is known.
//   (1,0), D = 2, is split in the second: (1,1) = 3, (1,2) = 4.5. alpha = 1, beta = 2.5.
//     (1,1): the triangles are 3.2 apart.
//     (1,2) = 4.5 and (2,0) = 5 are pruned.
TEST_F(Recording, KeepsVisitsAndTheSmallerOfAlphaAndBeta) {
  ScriptedNode script;
  script.distances = {{{1, 0}, 2}, {{2, 0}, 5}, {{1, 1}, 3}, {{1, 2}, 4.5}};
  script.triangle_distances = {{{1, 1}, 3.2}};
  EXPECT_EQ(4, run(script)) << "no test beyond FCL's own";

  const bool first_visited[] = {true, true, false, false, false};
  const bool second_visited[] = {true, true, false, false, false};
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(first_visited[i], first_.visited(i)) << i;
    EXPECT_EQ(second_visited[i], second_.visited(i)) << i;
  }
  EXPECT_FLOAT_EQ(1, second_.childGap(0));
  EXPECT_LT(first_.childGap(0), -1e30) << "visited, yet without a parent distance";
  for (const QueryWork& work : {first_.work(), second_.work()}) {
    EXPECT_EQ(1, work.queries);
    EXPECT_EQ(4, work.bv_tests);
    EXPECT_EQ(1, work.leaf_tests);
  }
}

// Likewise, but (2,0) = 2.5 must be entered after (1,0) was left: its D is its own 2.5, not the
// last one seen. (2,0) is split in the first tree: (3,0) = 2.9, (4,0) = 2.7: alpha 0.4, beta 0.2.
TEST_F(Recording, ComparesChildrenWithTheirOwnParent) {
  ScriptedNode script;
  script.distances = {{{1, 0}, 2},   {{2, 0}, 2.5}, {{1, 1}, 3},
                      {{1, 2}, 4.5}, {{3, 0}, 2.9}, {{4, 0}, 2.7}};
  script.triangle_distances = {{{1, 1}, 2.6}};
  run(script);
  EXPECT_FLOAT_EQ(1, second_.childGap(0));
  EXPECT_NEAR(0.2f, first_.childGap(2), 2e-4);
  EXPECT_TRUE(first_.visited(2));
  EXPECT_FALSE(first_.visited(3));
}

// A second query that sees another gap at the same node: the larger one decides, for test C asks
// whether any visit passed.
TEST_F(Recording, QueriesSinceTheUpdateCountTogether) {
  ScriptedNode script;
  script.distances = {{{1, 0}, 2}, {{2, 0}, 5}, {{1, 1}, 3}, {{1, 2}, 4.5}};
  script.triangle_distances = {{{1, 1}, 3.2}};
  run(script);
  script.distances = {{{1, 0}, 2}, {{2, 0}, 5}, {{1, 1}, 4.25}, {{1, 2}, 3.75}};
  script.triangle_distances = {{{1, 2}, 3.8}, {{1, 1}, 9}, {{1, 3}, 3.8}, {{1, 4}, 3.8}};
  script.distances[{1, 3}] = script.distances[{1, 4}] = 3.75;
  run(script);
  EXPECT_FLOAT_EQ(1.75f, second_.childGap(0));
  EXPECT_EQ(2, second_.work().queries);
  second_.clear();
  EXPECT_EQ(0, second_.work().queries);
  EXPECT_FALSE(second_.visited(0));
}

TEST(TraversalStatisticsThreads, TheLargestGapWinsWhateverTheOrder) {
  TraversalStatistics statistics;
  statistics.reset(3);
  QueryWork work;
  work.box_tests = 7;
  work.bv_tests = 5;
  work.leaf_tests = 2;
  std::vector<std::thread> threads;
  for (int t = 0; t < 8; ++t)
    threads.emplace_back([&statistics, &work, t] {
      for (int i = 0; i < 1000; ++i) {
        statistics.recordQuery(work);
        statistics.recordVisit(1);
        statistics.recordChildGap(2, (i * 7 + t * 131) % 1000 + 0.001 * t);
      }
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(8000, statistics.work().queries);
  EXPECT_EQ(40000, statistics.work().bv_tests);
  EXPECT_EQ(16000, statistics.work().leaf_tests);
  EXPECT_EQ(56000, statistics.work().box_tests);
  EXPECT_FALSE(statistics.visited(0));
  EXPECT_TRUE(statistics.visited(1));
  EXPECT_LE(statistics.childGap(2), 999.007f);
  EXPECT_NEAR(999.007f, statistics.childGap(2), 1);
}

TEST(TraversalStatisticsCopy, IsDeep) {
  TraversalStatistics a;
  a.reset(2);
  a.recordChildGap(1, 0.5);
  TraversalStatistics b = a;
  a.clear();
  EXPECT_FLOAT_EQ(0.5f, b.childGap(1));
  EXPECT_FALSE(a.visited(1));
}

/// What is kept of a gap: its sign and order, and three digits.
TEST(TraversalStatisticsGaps, KeepSignOrderAndThreeDigits) {
  const float gaps[] = {
      -std::numeric_limits<float>::max(), -3e9f, -1.5f, -1e-30f, 0, 1e-30f, 1e-3f, 0.7f, 1.5f, 3e9f,
      std::numeric_limits<float>::max()};
  float last = -std::numeric_limits<float>::infinity();
  for (const float gap : gaps) {
    TraversalStatistics statistics;
    statistics.reset(1);
    statistics.recordChildGap(0, std::nan(""));
    EXPECT_TRUE(statistics.visited(0)) << "a visit without a gap";
    EXPECT_EQ(-std::numeric_limits<float>::infinity(), statistics.childGap(0));
    statistics.recordChildGap(0, gap);
    statistics.recordVisit(0);
    EXPECT_LE(statistics.childGap(0), gap);
    EXPECT_GE(statistics.childGap(0), gap - std::abs(gap) * 1e-3f);
    EXPECT_GT(statistics.childGap(0), last);
    last = statistics.childGap(0);
  }
}

/// Clearing counts on; nothing of an earlier count shows, however often it was cleared.
TEST(TraversalStatisticsClear, ForgetsWhateverTheCount) {
  TraversalStatistics statistics;
  statistics.reset(2);
  for (int round = 0; round < 10000; ++round) {
    if (round % 97 == 0) statistics.recordChildGap(0, 0.1 * round);
    if (round % 89 == 0) statistics.recordVisit(1);
    ASSERT_EQ(round % 97 == 0, statistics.visited(0)) << round;
    ASSERT_EQ(round % 89 == 0, statistics.visited(1)) << round;
    statistics.clear();
    ASSERT_FALSE(statistics.visited(0) || statistics.visited(1)) << round;
  }
}

}  // namespace recording_node_test
}  // namespace adaptive_bvh_test
