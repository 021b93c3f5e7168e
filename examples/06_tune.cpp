// Which refit policy suits your simulation? tune() runs it with many policies and keeps the best.
// Here: a helmet that deforms above a plate that is FCL's own model. FCL's volumes answer its
// queries, so it matters which of the helmet's are refitted.
// examples/tools/tune searches for your mesh files, at the thesis's length, and saves the policy.
#include <cstdio>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/query.h"
#include "adaptive_bvh/tuning.h"
#include "scenarios.h"

using adaptive_bvh::AdaptiveBVHModeld;
using adaptive_bvh::FitnessCriterion;
using adaptive_bvh::RefitPolicy;
using adaptive_bvh::SimulationWork;

int main() {
  const scenarios::Scenario scenario = scenarios::thesisScenarios().back();
  fcl::BVHModel<fcl::RSSd> plate;
  fillModel(scenario.second.mesh(), plate);
  const auto origin = fcl::Transform3d::Identity();

  // All steps with one policy; returns what they cost.
  const adaptive_bvh::Simulation simulation = [&](const RefitPolicy& policy) {
    AdaptiveBVHModeld helmet(policy);
    fillModel(scenario.first.mesh(), helmet);
    SimulationWork work;
    for (int step = 1; step <= scenario.first.frames(); ++step) {
      work.add(helmet.update(scenario.first.positions(step)));
      fcl::DistanceResultd result;
      adaptive_bvh::distance(&helmet, origin, &plate, origin, fcl::DistanceRequestd(), result);
      work.add(helmet.recordedWork());
    }
    return work;
  };

  adaptive_bvh::TuningOptions options;
  options.population = 10;
  options.generations = 12;
  options.criteria = {FitnessCriterion::A, FitnessCriterion::AB, FitnessCriterion::ABOrBC};
  options.max_inflation.high = 0.5;  // where p_max is searched
  options.progress = [](const adaptive_bvh::TuningProgress& progress) {
    if (progress.generation == 0)
      std::printf("%3.0f %%: searching %s\n", 100 * progress.share_done,
                  toString(progress.criterion));
    return true;  // false stops
  };
  const adaptive_bvh::TuningResult result = tune(simulation, options);

  for (const adaptive_bvh::TunedPolicy& tuned : result.by_criterion)
    std::printf("%-8s p_max %.3f: %.2f ms, after %ld runs\n", toString(tuned.policy.criterion),
                tuned.policy.max_inflation, 1e3 * tuned.cost, tuned.evaluations);
  std::printf("default: %.2f ms\n", 1e3 * options.costs.seconds(simulation(RefitPolicy())));
  std::printf("the best policy: %s\n", toJson(result.best().policy).c_str());
}
