// The genetic search: finds known optima, repeats itself, stops and goes on, and speaks JSON.
#include "adaptive_bvh/tuning.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/query.h"
#include "scenarios.h"
#include "support/temporary_file.h"

namespace adaptive_bvh_test {
namespace tuning_test {

using namespace adaptive_bvh;  // NOLINT: the subject of this file

/// A simulation whose best policy is known: (A and B) or (B and C) at p = 3, k = 0.25, gamma = 0.6.
SimulationWork valley(const RefitPolicy& policy) {
  SimulationWork work;
  const double p = policy.max_inflation - 3, k = policy.child_distance_ratio - 0.25,
               gamma = policy.min_inflation - 0.6;
  const double penalty = policy.criterion == FitnessCriterion::ABOrBC ? 0 : 0.5;
  work.seconds = 1 + penalty + 0.01 * p * p + k * k + gamma * gamma;
  work.bv_tests = std::lround(1e9 * work.seconds);
  return work;
}

TuningOptions quick() {
  TuningOptions options;
  options.population = 12;
  options.generations = 12;
  return options;
}

void expectSame(const TuningResult& a, const TuningResult& b) {
  ASSERT_EQ(a.by_criterion.size(), b.by_criterion.size());
  for (std::size_t i = 0; i < a.by_criterion.size(); ++i) {
    const TunedPolicy &p = a.by_criterion[i], &q = b.by_criterion[i];
    EXPECT_EQ(p.policy.criterion, q.policy.criterion);
    EXPECT_EQ(p.policy.max_inflation, q.policy.max_inflation);
    EXPECT_EQ(p.policy.child_distance_ratio, q.policy.child_distance_ratio);
    EXPECT_EQ(p.policy.min_inflation, q.policy.min_inflation);
    EXPECT_EQ(p.cost, q.cost);
  }
}

TEST(Tune, DefaultsAreTheThesiss) {
  const TuningOptions options;
  EXPECT_EQ(30, options.population);
  EXPECT_EQ(50, options.generations);
  EXPECT_EQ(0.5, options.overlap);
  EXPECT_EQ(0.9, options.crossover);
  EXPECT_EQ(0.01, options.mutation);
  EXPECT_EQ(10, options.max_inflation.high);
  EXPECT_EQ(7u, options.criteria.size());
}

TEST(Tune, FindsTheValley) {
  for (TuningObjective objective : {TuningObjective::MeasuredTime, TuningObjective::CountedWork}) {
    TuningOptions options;
    options.objective = objective;
    const TuningResult result = tune(valley, options);
    EXPECT_TRUE(result.finished);
    const RefitPolicy& best = result.best().policy;
    EXPECT_EQ(FitnessCriterion::ABOrBC, best.criterion);
    EXPECT_NEAR(3, best.max_inflation, 0.3);
    EXPECT_NEAR(0.25, best.child_distance_ratio, 0.05);
    EXPECT_NEAR(0.6, best.min_inflation, 0.05);
  }
}

TEST(Tune, SearchesOnlyWhatACriterionUses) {
  const RefitPolicy base;
  for (const TunedPolicy& tuned : tune(valley, quick()).by_criterion) {
    const FitnessCriterion c = tuned.policy.criterion;
    const bool a = c != FitnessCriterion::B && c != FitnessCriterion::BC;
    const bool test_c =
        c != FitnessCriterion::A && c != FitnessCriterion::B && c != FitnessCriterion::AB;
    EXPECT_EQ(a, tuned.policy.max_inflation != base.max_inflation) << toString(c);
    EXPECT_EQ(test_c, tuned.policy.min_inflation != base.min_inflation) << toString(c);
    // 12 at first, then half of them new in each of 12 generations.
    EXPECT_EQ(c == FitnessCriterion::B ? 1 : 12 + 12 * 6, tuned.evaluations) << toString(c);
  }
}

TEST(Tune, StaysInTheRanges) {
  TuningOptions options = quick();
  options.max_inflation = {0.5, 2};
  options.min_inflation = {0.1, 0.2};
  long runs = 0;
  tune(
      [&](const RefitPolicy& policy) {
        ++runs;
        if (policy.criterion == FitnessCriterion::ABOrBC) {
          EXPECT_GE(policy.max_inflation, 0.5);
          EXPECT_LE(policy.max_inflation, 2);
          EXPECT_GE(policy.min_inflation, 0.1);
          EXPECT_LE(policy.min_inflation, 0.2);
        }
        return valley(policy);
      },
      options);
  EXPECT_EQ(6 * 84 + 1, runs);
}

TEST(Tune, ASeedGivesTheSameAnswerTwice) {
  TuningOptions options = quick();
  const TuningResult first = tune(valley, options);
  expectSame(first, tune(valley, options));
  options.seed = 2;
  EXPECT_NE(first.best().policy.max_inflation, tune(valley, options).best().policy.max_inflation);
}

TEST(Checkpoint, ASearchThatWasStoppedGoesOnAsIfItHadNot) {
  TuningOptions options = quick();
  const TuningResult whole = tune(valley, options);
  const TemporaryFile file("checkpoint.json");
  options.checkpoint = file.path();
  int reports = 0, stops = 0;
  options.progress = [&](const TuningProgress& progress) {
    EXPECT_GE(progress.share_done, 0);
    EXPECT_LE(progress.share_done, 1 + 1e-12);
    EXPECT_GT(progress.best.cost, 0);
    return ++reports % 7 != 0;  // now in the middle of a criterion, now at its end
  };
  TuningResult result;
  do {
    result = tune(valley, options);
    ++stops;
    ASSERT_LT(stops, 50);
  } while (!result.finished);
  EXPECT_GT(stops, 5);
  expectSame(whole, result);
}

TEST(Checkpoint, BelongsToItsOptions) {
  TuningOptions options = quick();
  const TemporaryFile file("checkpoint.json");
  options.checkpoint = file.path();
  options.progress = [](const TuningProgress&) { return false; };
  EXPECT_FALSE(tune(valley, options).finished);
  options.seed = 9;
  EXPECT_THROW(tune(valley, options), std::runtime_error);
  options.seed = 1;
  std::ofstream(file.path()) << "nonsense";
  EXPECT_THROW(tune(valley, options), std::runtime_error);
  options.checkpoint = "/no/such/folder/file.json";
  EXPECT_THROW(tune(valley, options), std::runtime_error);
}

TEST(Tune, RefusesOptionsWithoutSense) {
  const auto refused = [](auto&& change) {
    TuningOptions options;
    change(options);
    EXPECT_THROW(tune(valley, options), std::invalid_argument);
  };
  refused([](TuningOptions& o) { o.population = 1; });
  refused([](TuningOptions& o) { o.generations = -1; });
  refused([](TuningOptions& o) { o.overlap = 1; });
  refused([](TuningOptions& o) { o.crossover = 1.1; });
  refused([](TuningOptions& o) { o.mutation = -0.1; });
  refused([](TuningOptions& o) { o.criteria.clear(); });
  refused([](TuningOptions& o) { o.max_inflation = {2, 1}; });
  refused([](TuningOptions& o) { o.min_inflation = {-1, 1}; });
  EXPECT_THROW(tune(Simulation(), {}), std::invalid_argument);
}

TEST(Tune, PassesOnWhatTheSimulationThrows) {
  const Simulation broken = [](const RefitPolicy&) -> SimulationWork {
    throw std::domain_error("no mesh today");
  };
  EXPECT_THROW(tune(broken, quick()), std::domain_error);
}

// On a real scenario the best found is no worse than the defaults, and than refitting all.
TEST(Tune, ImprovesARealScenario) {
  const scenarios::Scenario scenario = scenarios::thesisScenarios()[2];
  const Simulation simulation = [&](const RefitPolicy& policy) {
    AdaptiveBVHModeld a(policy), b(policy);
    fillModel(scenario.first.mesh(), a);
    fillModel(scenario.second.mesh(), b);
    const auto origin = fcl::Transform3d::Identity();
    SimulationWork work;
    for (int frame = 1; frame <= scenario.frames(); ++frame) {
      work.add(a.update(scenario.first.positions(frame)));
      work.add(b.update(scenario.second.positions(frame)));
      fcl::DistanceResultd result;
      adaptive_bvh::distance(&a, origin, &b, origin, fcl::DistanceRequestd(), result);
      work.add(a.recordedWork());
    }
    return work;
  };
  TuningOptions options = quick();
  options.criteria = {FitnessCriterion::AB, FitnessCriterion::ABOrBC};
  options.max_inflation.high = 0.5;
  const TuningResult result = tune(simulation, options);
  RefitPolicy all;
  all.criterion = FitnessCriterion::RefitAll;
  EXPECT_LT(result.best().cost, options.costs.seconds(simulation(all)));
  EXPECT_LE(result.best().cost, 1.02 * options.costs.seconds(simulation(RefitPolicy())));
  EXPECT_EQ(result.best().cost, options.costs.seconds(simulation(result.best().policy)));
}

TEST(Costs, AreMeasuredInPlausibleNanoseconds) {
  for (const auto propagation : {adaptive_bvh::Propagation::TranslationCompensated,
                                 adaptive_bvh::Propagation::Displacements}) {
    const WorkCosts costs = WorkCosts::measured(propagation);
    for (double cost : {costs.bv_test, costs.leaf_test, costs.propagated, costs.refitted_leaf,
                        costs.refitted_primitive}) {
      EXPECT_GT(cost, 0.1);
      EXPECT_LT(cost, 1e5);
    }
    EXPECT_GE(costs.refitted_inner, 0);
  }
}

TEST(Costs, CountEveryKindOfWork) {
  WorkCosts costs;
  costs.bv_test = 1;
  costs.leaf_test = 10;
  costs.propagated = 100;
  costs.refitted_leaf = 1000;
  costs.refitted_inner = 10000;
  costs.refitted_primitive = 100000;
  UpdateReport update;
  update.moved = 3;
  update.inflated = 2;
  update.refitted_leaves = 4;
  update.refitted_inner = 5;
  update.refitted_primitives = 10;  // of them 4 by leaves
  QueryWork query;
  query.bv_tests = 1;
  query.leaf_tests = 2;
  query.box_tests = 7;  // of boxes, which no policy changes
  SimulationWork work, twice;
  work.add(update);
  work.add(query);
  EXPECT_DOUBLE_EQ(654321e-9, costs.seconds(work));
  twice += work;
  twice += work;
  EXPECT_DOUBLE_EQ(2 * 654321e-9, costs.seconds(twice));
}

TEST(Json, AResultReadsAsItsBestPolicy) {
  const TuningResult result = tune(valley, quick());
  EXPECT_EQ(result.best().policy.max_inflation, policyFromJson(toJson(result)).max_inflation);
}

}  // namespace tuning_test
}  // namespace adaptive_bvh_test
