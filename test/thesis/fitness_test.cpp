// The fitness tests of thesis 4.4 and the criteria of 4.5, by hand.
#include "thesis/refit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace adaptive_bvh_test {
namespace fitness_test {

using namespace adaptive_bvh;  // NOLINT: the subject of this file

constexpr double kNoGap = -std::numeric_limits<double>::infinity();

/// R = 2, R' = 3: grown by 1, a factor of 1/2.
NodeFitness grownByHalf() { return {1, 2, true, kNoGap}; }

TEST(InflationFactor, ComparesTheGrowthWithTheReference) {
  NodeFitness node = grownByHalf();
  EXPECT_DOUBLE_EQ(0.5, inflationFactor(node));
  node.reference = 4;
  EXPECT_DOUBLE_EQ(0.25, inflationFactor(node));
}

TEST(InflationFactor, StaysFiniteWithoutAnyReference) {
  EXPECT_EQ(0, inflationFactor({0, 0, true, kNoGap}));
  const double factor = inflationFactor({1e-3, 0, true, kNoGap});
  EXPECT_TRUE(std::isfinite(factor));
  EXPECT_GT(factor, 1e300);
  EXPECT_EQ(0, inflationFactor({-0.1, 2, true, kNoGap})) << "a leaf that shrank is not inflated";
}

TEST(TestA, PassesAbovePMax) {
  RefitPolicy policy;
  policy.max_inflation = 0.49;
  EXPECT_TRUE(testA(grownByHalf(), policy));
  policy.max_inflation = 0.5;
  EXPECT_FALSE(testA(grownByHalf(), policy)) << "4.4.1: larger than, not equal";
}

TEST(TestB, PassesWhenVisited) {
  NodeFitness node = grownByHalf();
  EXPECT_TRUE(testB(node));
  node.visited = false;
  EXPECT_FALSE(testB(node));
}

// (R' - R) / R >= gamma and alpha > k (R' - R) and beta > k (R' - R), with R' - R = 1.
TEST(TestC, PassesWhenBothChildrenAreFarEnough) {
  RefitPolicy policy;
  policy.min_inflation = 0.5;
  policy.child_distance_ratio = 0.4;
  NodeFitness node = grownByHalf();
  node.child_gap = 0.41;  // min(alpha, beta)
  EXPECT_TRUE(testC(node, policy)) << "gamma is reached exactly: >=";
  node.child_gap = 0.4;
  EXPECT_FALSE(testC(node, policy)) << "k (R' - R) must be exceeded: >";
  node.child_gap = 0.41;
  policy.min_inflation = 0.51;
  EXPECT_FALSE(testC(node, policy));
  node.child_gap = kNoGap;
  policy.min_inflation = 0;
  EXPECT_FALSE(testC(node, policy)) << "no statistics";
}

struct Row {
  FitnessCriterion criterion;
  bool (*formula)(bool a, bool b, bool c);
};

/// Thesis 4.5, i to vii, in the thesis's own words; every combination of outcomes.
TEST(Criteria, FollowTheirTruthTables) {
  const Row rows[] = {
      {FitnessCriterion::A, [](bool a, bool, bool) { return a; }},
      {FitnessCriterion::B, [](bool, bool b, bool) { return b; }},
      {FitnessCriterion::AB, [](bool a, bool b, bool) { return a && b; }},
      {FitnessCriterion::BC, [](bool, bool b, bool c) { return b && c; }},
      {FitnessCriterion::ABC, [](bool a, bool b, bool c) { return a && b && c; }},
      {FitnessCriterion::AOrBC, [](bool a, bool b, bool c) { return a || (b && c); }},
      {FitnessCriterion::ABOrBC, [](bool a, bool b, bool c) { return (a && b) || (b && c); }},
      {FitnessCriterion::RefitAll, [](bool, bool, bool) { return true; }},
      {FitnessCriterion::RefitNone, [](bool, bool, bool) { return false; }},
  };
  for (const Row& row : rows)
    for (int outcome = 0; outcome < 8; ++outcome) {
      const bool a = outcome & 1, b = outcome & 2, c = outcome & 4;
      RefitPolicy policy;
      policy.criterion = row.criterion;
      policy.max_inflation = a ? 0.4 : 0.6;
      policy.min_inflation = 0;
      policy.child_distance_ratio = 0.5;
      NodeFitness node = grownByHalf();
      node.visited = b;
      node.child_gap = c ? 0.6 : 0.4;
      ASSERT_EQ(a, testA(node, policy));
      ASSERT_EQ(b, testB(node));
      ASSERT_EQ(c, testC(node, policy));
      EXPECT_EQ(row.formula(a, b, c), isUnfit(node, policy))
          << toString(row.criterion) << ": A " << a << " B " << b << " C " << c;
    }
}

TEST(Presets, AreTheRowsOfTable2) {
  const auto expect = [](FitnessCriterion criterion, double p_max, double k, double gamma) {
    const RefitPolicy policy = RefitPolicy::thesis(criterion);
    EXPECT_EQ(criterion, policy.criterion);
    EXPECT_EQ(InflationReference::OriginalRadius, policy.reference);
    EXPECT_FALSE(policy.leaf_radius_may_shrink);
    EXPECT_EQ(adaptive_bvh::Propagation::Displacements, policy.propagation);
    if (p_max >= 0) {
      EXPECT_EQ(p_max, policy.max_inflation);
    }
    if (k >= 0) {
      EXPECT_EQ(k, policy.child_distance_ratio);
    }
    if (gamma >= 0) {
      EXPECT_EQ(gamma, policy.min_inflation);
    }
    EXPECT_NO_THROW(policy.check());
  };
  expect(FitnessCriterion::A, 1.884184, -1, -1);
  expect(FitnessCriterion::B, -1, -1, -1);
  expect(FitnessCriterion::AB, 1.498741, -1, -1);
  expect(FitnessCriterion::BC, -1, 0.333928, 0.053803);
  expect(FitnessCriterion::AOrBC, 3.383383, 0.416571, 0.111757);
  expect(FitnessCriterion::ABC, 1.967193, 0.221836, 0.002197);
  expect(FitnessCriterion::ABOrBC, 1.359579, 0.891981, 0.590829);
  expect(FitnessCriterion::RefitAll, -1, -1, -1);
  expect(FitnessCriterion::RefitNone, -1, -1, -1);
  EXPECT_EQ(FitnessCriterion::A, RefitPolicy().criterion);
}

TEST(Presets, RefuseParametersThatMeanNothing) {
  for (double RefitPolicy::*member :
       {&RefitPolicy::max_inflation, &RefitPolicy::child_distance_ratio,
        &RefitPolicy::min_inflation})
    for (double bad : {-0.1, std::nan(""), std::numeric_limits<double>::infinity()}) {
      RefitPolicy policy;
      policy.*member = bad;
      EXPECT_THROW(policy.check(), std::invalid_argument);
    }
}

}  // namespace fitness_test
}  // namespace adaptive_bvh_test
