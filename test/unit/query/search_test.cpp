// The walk over pairs of nodes, with a visitor that writes down what it is asked.
#include "query/search.h"

#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

namespace adaptive_bvh_test {
namespace {

/// Pairs are named by the way to them: from "" to "L" and "R", and so on, `depth` times.
///
///           ""
///         /    \        .
///       L        R
///     /   \    /   \    .
///    LL   LR  RL   RR
struct ScriptedVisitor {
  using Pair = std::string;

  bool prune(Pair& pair) {
    asked.push_back(pair);
    pair += pruned.count(pair) ? "!" : "";  // a visitor may keep what it learns in the pair
    return pair.back() == '!';
  }
  bool isLeafPair(const Pair& pair) const { return pair.size() == depth + 1; }
  void testLeaves(const Pair& pair) {
    leaves.push_back(pair);
    done |= pair == last;
  }
  std::vector<Pair> split(const Pair& pair) {
    if (right_first.count(pair)) return {pair + "R", pair + "L"};
    return {pair + "L", pair + "R"};
  }
  bool isDone() const { return done; }

  std::size_t depth = 2;
  std::set<Pair> pruned, right_first;
  Pair last;  // the leaf after which the answer is known
  std::vector<Pair> asked, leaves;
  bool done = false;
};

using Names = std::vector<std::string>;

ScriptedVisitor search(ScriptedVisitor visitor) {
  std::string root = "*";
  adaptive_bvh::searchPairs(visitor, root);
  return visitor;
}

/// Depth first, in the order in which split gives the pairs; every pair is asked once, before it is
/// tested or split.
TEST(SearchPairs, VisitsAllPairsInTheirOrder) {
  const ScriptedVisitor all = search({});
  EXPECT_EQ((Names{"*", "*L", "*LL", "*LR", "*R", "*RL", "*RR"}), all.asked);
  EXPECT_EQ((Names{"*LL", "*LR", "*RL", "*RR"}), all.leaves);
}

TEST(SearchPairs, GoesFirstWhereSplitSays) {
  ScriptedVisitor visitor;
  visitor.right_first = {"*", "*L"};
  EXPECT_EQ((Names{"*RL", "*RR", "*LR", "*LL"}), search(visitor).leaves);
}

/// Nothing below a pruned pair is asked or tested; a pruned root ends it all.
TEST(SearchPairs, StopsWhereItIsPruned) {
  ScriptedVisitor visitor;
  visitor.pruned = {"*L", "*RR"};
  const ScriptedVisitor some = search(visitor);
  EXPECT_EQ((Names{"*", "*L", "*R", "*RL", "*RR"}), some.asked);
  EXPECT_EQ((Names{"*RL"}), some.leaves) << "a pruned leaf is not tested";
  visitor.pruned = {"*"};
  EXPECT_EQ((Names{"*"}), search(visitor).asked);
}

/// Once the answer is known nothing more is asked, on any level.
TEST(SearchPairs, EndsOnceTheAnswerIsKnown) {
  ScriptedVisitor visitor;
  visitor.last = "*LR";
  EXPECT_EQ((Names{"*", "*L", "*LL", "*LR"}), search(visitor).asked);
  visitor.last = "*LL";
  EXPECT_EQ((Names{"*LL"}), search(visitor).leaves);
  visitor.depth = 5;
  visitor.last = "*LLLLL";
  EXPECT_EQ(6u, search(visitor).asked.size());
}

/// Two leaves are tested at once, without a split.
TEST(SearchPairs, OfTwoLeaves) {
  ScriptedVisitor visitor;
  visitor.depth = 0;
  EXPECT_EQ((Names{"*"}), search(visitor).leaves);
}

}  // namespace
}  // namespace adaptive_bvh_test
