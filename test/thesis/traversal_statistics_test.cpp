// What queries saw of a tree, against a plain record of it (recording_node_test.cpp has what FCL's
// traversals leave, and threads).
#include "thesis/traversal_statistics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "support/long_mode.h"

namespace adaptive_bvh_test {
namespace traversal_statistics_test {

using adaptive_bvh::PairStatistics;
using adaptive_bvh::QueryWork;
using adaptive_bvh::TraversalStatistics;

/// What was seen of one node, kept plainly.
struct Seen {
  bool visited = false;
  float gap = -std::numeric_limits<float>::infinity();
};

void expectSeen(const std::vector<Seen>& expected, const TraversalStatistics& statistics) {
  for (int node = 0; node < int(expected.size()); ++node) {
    const Seen& seen = expected[std::size_t(node)];
    ASSERT_EQ(seen.visited, statistics.visited(node)) << node;
    const float gap = statistics.childGap(node);
    if (std::isinf(seen.gap)) {
      ASSERT_EQ(seen.gap, gap);
    } else {
      ASSERT_LE(gap, seen.gap);
      ASSERT_NEAR(seen.gap, gap, std::abs(seen.gap) * 1e-3f);
    }
  }
}

/// Any sequence of records and clears, of any node: over more updates than the epoch counts.
TEST(Statistics, AreWhatWasRecordedSinceTheLastClear) {
  std::mt19937 random(testSeed(3));
  TraversalStatistics statistics;
  constexpr int kNodes = 9;
  statistics.reset(kNodes);
  std::vector<Seen> expected(kNodes);
  for (int step = 0; step < 100000; ++step) {
    const int node = int(random() % kNodes);
    Seen& seen = expected[std::size_t(node)];
    const float gap = std::ldexp(float(random() % 2000) - 1000, int(random() % 40) - 20);
    switch (random() % 8) {
      case 0:
      case 1:
      case 2: statistics.recordVisit(node); break;
      case 3:
      case 4:
      case 5:
        statistics.recordChildGap(node, gap);
        seen.gap = std::max(seen.gap, gap);
        break;
      default:
        statistics.clear();
        expected.assign(kNodes, Seen());
        expectSeen(expected, statistics);
        continue;
    }
    seen.visited = true;
    if (step % 16 == 0) expectSeen(expected, statistics);
  }
}

/// A reset to another size forgets everything, and work is what the queries since then did.
TEST(Statistics, BeginAnewWithAReset) {
  TraversalStatistics statistics;
  EXPECT_EQ(0u, statistics.bytes());
  statistics.reset(3);
  statistics.recordChildGap(2, 1.5);
  QueryWork work;
  work.box_tests = 5;
  work.leaf_tests = 2;
  statistics.recordQuery(work);
  statistics.recordQuery(work);
  EXPECT_EQ(2, statistics.work().queries);
  EXPECT_EQ(10, statistics.work().box_tests);
  for (const int nodes : {3, 100, 3}) {
    statistics.reset(nodes);
    EXPECT_EQ(std::size_t(nodes) * 4, statistics.bytes());
    EXPECT_EQ(0, statistics.work().queries);
    EXPECT_EQ(0, statistics.work().box_tests);
    expectSeen(std::vector<Seen>(std::size_t(nodes)), statistics);
    statistics.recordVisit(nodes - 1);
    EXPECT_TRUE(statistics.visited(nodes - 1));
  }
}

/// Copies, by construction and assignment, to any size: neither side sees the other's later
/// records, and both go on counting epochs.
TEST(Statistics, AreCopiedDeeply) {
  TraversalStatistics a, b;
  a.reset(4);
  b.reset(2);
  for (int i = 0; i < 9000; ++i) a.clear();  // to an epoch of its own
  a.recordVisit(1);
  a.recordChildGap(3, 2.f);
  QueryWork work;
  work.bv_tests = 9;
  a.recordQuery(work);
  b = a;
  const TraversalStatistics c(a);
  a.recordVisit(0);
  a.recordChildGap(3, 8.f);
  std::vector<Seen> expected(4);
  expected[1].visited = expected[3].visited = true;
  expected[3].gap = 2;
  expectSeen(expected, b);
  expectSeen(expected, c);
  EXPECT_EQ(9, b.work().bv_tests);
  b.clear();
  expectSeen(std::vector<Seen>(4), b);
  EXPECT_TRUE(a.visited(0) && a.visited(1));
}

/// Of a pair each side gets its own node; a side that is not adaptive none; a model against itself
/// counts a query once.
TEST(PairOfStatistics, GoToTheirSides) {
  TraversalStatistics first, second;
  first.reset(5);
  second.reset(5);
  PairStatistics both{{&first, &second}};
  both.recordVisit(1, 2);
  both.recordQuery({});
  for (int node = 0; node < 5; ++node) {
    EXPECT_EQ(node == 1, first.visited(node)) << node;
    EXPECT_EQ(node == 2, second.visited(node)) << node;
  }
  const PairStatistics half{{nullptr, &second}}, none, self{{&first, &first}};
  half.recordVisit(0, 0);
  half.recordVisit(0, 1);
  half.recordQuery({});
  none.recordVisit(0, 0);
  none.recordQuery({});
  EXPECT_FALSE(first.visited(0));
  EXPECT_TRUE(second.visited(0) && second.visited(1));
  self.recordVisit(0, 2);
  self.recordQuery({});
  EXPECT_TRUE(first.visited(0) && first.visited(2));
  EXPECT_EQ(2, first.work().queries);
  EXPECT_EQ(2, second.work().queries);
}

}  // namespace traversal_statistics_test
}  // namespace adaptive_bvh_test
