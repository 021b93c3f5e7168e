// The post-order traversal, judged by recursion: a value is an expression that says how it came
// about, so that a wrong order shows.
#include "thesis/post_order.h"

#include <gtest/gtest.h>

#include <set>
#include <string>

#include "support/long_mode.h"
#include "support/trees.h"

namespace adaptive_bvh_test {
namespace post_order_test {

/// The value of a leaf is its number, of an inner node "(left right)", of a subtree that is left
/// out "[node]".
class ExpressionRule {
 public:
  explicit ExpressionRule(const NumberedTree& tree, std::set<int> left_out = {})
      : tree_(tree), left_out_(std::move(left_out)), left_(tree.nodes()) {}

  int nextPair() {
    do left_ -= 2;
    while (left_ > 0 && isBelowOneLeftOut(left_));
    return left_;
  }
  bool isLeaf(int node) const { return tree_.isLeaf(node); }
  static void leaf(int node, std::string& value) { value = std::to_string(node); }
  bool isTraversed(int node) const { return left_out_.count(node) == 0; }
  static void skipped(int node, std::string& value) { value = "[" + std::to_string(node) + "]"; }
  static void merge(std::string& a, const std::string& b) { a = "(" + a + " " + b + ")"; }
  void apply(int left, const std::string& a, const std::string& b) {
    applied.push_back(left);
    EXPECT_EQ(expected(left), a);
    EXPECT_EQ(expected(left + 1), b);
  }
  void applyRoot(const std::string& a) { root = a; }

  std::string expected(int node) const {
    if (isLeaf(node)) return std::to_string(node);
    if (!isTraversed(node)) return "[" + std::to_string(node) + "]";
    const int left = tree_.left[std::size_t(node)];
    return "(" + expected(left) + " " + expected(left + 1) + ")";
  }

  std::vector<int> applied;
  std::string root;

 private:
  bool isBelowOneLeftOut(int node) const {
    for (int above = tree_.parent[std::size_t(node)]; above >= 0;
         above = tree_.parent[std::size_t(above)])
      if (left_out_.count(above)) return true;
    return false;
  }

  const NumberedTree& tree_;
  const std::set<int> left_out_;
  int left_;
};

/// Traverses on a stack of the size that Topology::stackCapacity gives, with a mark behind it.
std::string traverse(const NumberedTree& tree, ExpressionRule& rule) {
  std::vector<std::string> stack(std::size_t(tree.depth) + 2 + 1);
  stack.back() = "untouched";
  adaptive_bvh::traversePostOrder(stack.data(), rule);
  EXPECT_EQ("untouched", stack.back()) << "the stack is as deep as the tree, and two";
  return rule.root;
}

//          0
//        /   \           .
//      1       2
//    /   \   /   \       .
//   3     4 9    10
//  / \   / \             .
// 5   6 7   8
TEST(PostOrder, HandsValuesUpASmallTree) {
  const NumberedTree tree{
      {1, 3, 9, 5, 7, -1, -1, -1, -1, -1, -1}, {-1, 0, 0, 1, 1, 3, 3, 4, 4, 2, 2}, 3};
  ExpressionRule rule(tree);
  EXPECT_EQ("(((5 6) (7 8)) (9 10))", traverse(tree, rule));
  EXPECT_EQ((std::vector<int>{9, 7, 5, 3, 1}), rule.applied) << "children before parents";
}

/// Subtrees whose values are known are not walked, and theirs stand where the walk's would.
TEST(PostOrder, TakesKnownValuesOfSubtreesLeftOut) {
  const NumberedTree tree{
      {1, 3, 9, 5, 7, -1, -1, -1, -1, -1, -1}, {-1, 0, 0, 1, 1, 3, 3, 4, 4, 2, 2}, 3};
  ExpressionRule rule(tree, {2, 3});
  EXPECT_EQ("(([3] (7 8)) [2])", traverse(tree, rule));
  EXPECT_EQ((std::vector<int>{7, 3, 1}), rule.applied);
  ExpressionRule nothing(tree, {0});
  EXPECT_EQ("[0]", traverse(tree, nothing));
}

TEST(PostOrder, OfARootAlone) {
  const NumberedTree tree{{-1}, {-1}, 0};
  ExpressionRule rule(tree);
  EXPECT_EQ("0", traverse(tree, rule));
  EXPECT_TRUE(rule.applied.empty());
}

/// Trees of any shape, chains among them, with any subtrees left out.
TEST(PostOrder, IsThatOfRecursion) {
  std::mt19937 random(testSeed(3));
  for (int round = 0; round < 500; ++round) {
    const NumberedTree tree = randomTree(1 + round % 40, random);
    std::set<int> left_out;
    for (int node = 0; node < tree.nodes(); ++node)
      if (round % 3 > 0 && !tree.isLeaf(node) && random() % 6 == 0) left_out.insert(node);
    ExpressionRule rule(tree, left_out);
    ASSERT_EQ(rule.expected(0), traverse(tree, rule));
  }
}

}  // namespace post_order_test
}  // namespace adaptive_bvh_test
