#pragma once

#include <functional>
#include <string>
#include <vector>

#include "adaptive_bvh/policy_json.h"
#include "adaptive_bvh/refit_policy.h"
#include "adaptive_bvh/update_report.h"

namespace adaptive_bvh {

/// Component `tuning`: which RefitPolicy suits a simulation best, by a genetic algorithm (thesis
/// chapter IV). Needs pagmo, and nlohmann-json to build.

/// What a run of a simulation cost: counted, and in seconds.
struct SimulationWork {
  long bv_tests = 0;             ///< QueryWork::bv_tests, summed
  long leaf_tests = 0;           ///< QueryWork::leaf_tests, summed
  long propagated = 0;           ///< UpdateReport::propagated, summed
  long refitted_leaves = 0;      ///< UpdateReport::refitted_leaves, summed
  long refitted_inner = 0;       ///< UpdateReport::refitted_inner, summed
  long refitted_primitives = 0;  ///< UpdateReport::refitted_primitives, summed
  double seconds = 0;  ///< for TuningObjective::MeasuredTime: of updates and queries, by your clock

  /// Once for each update, with the model's lastUpdate().
  void add(const UpdateReport& update);
  /// Once for each query: of a pair of adaptive models add one side's.
  void add(const QueryWork& queries);
  /// The work of two simulations together.
  SimulationWork& operator+=(const SimulationWork& other);
};

/// Runs all steps with a policy: set it on your models, update, query (by query.h, which records
/// traversal statistics), and add up. Called some thousand times; must not depend on the run
/// before. May throw; `tune` passes that on.
using Simulation = std::function<SimulationWork(const RefitPolicy&)>;

/// Nanoseconds for each kind of work. The defaults were measured on a 2 GHz x86-64 server; only
/// their ratios matter to the search.
struct WorkCosts {
  double bv_test = 110;            ///< with all that FCL's traversal does around it
  double leaf_test = 88;           ///< of two triangles
  double propagated = 10;          ///< for each volume that the propagation changes
  double refitted_leaf = 97;       ///< for each volume of one triangle that is fitted
  double refitted_inner = 400;     ///< for each other volume that is fitted, and besides ...
  double refitted_primitive = 12;  ///< for each triangle that an inner refit reads

  /// What so much work costs in all.
  double seconds(const SimulationWork& work) const;

  /// Measured on this machine, in about a second, for models with this propagation. Differs a
  /// little from time to time: keep the result if you want to repeat a search.
  static WorkCosts measured(Propagation propagation = Propagation::TranslationCompensated);
};

/// What `tune` minimises.
enum class TuningObjective {
  CountedWork,   ///< WorkCosts times counts: the same seed gives the same answer
  MeasuredTime,  ///< SimulationWork::seconds, as in the thesis
};

/// Where a parameter is searched; low <= high.
struct ParameterRange {
  double low;   ///< the least value that is tried
  double high;  ///< the largest
};

/// A policy and what it costs, in seconds of the objective.
struct TunedPolicy {
  RefitPolicy policy;    ///< with the parameters that were found
  double cost = 0;       ///< of the whole simulation
  long evaluations = 0;  ///< runs of the simulation that its criterion took
};

/// How far a search is.
struct TuningProgress {
  FitnessCriterion criterion;  ///< that is being searched
  int generation = 0;          ///< of this criterion, from 0
  TunedPolicy best;            ///< of all criteria so far
  double share_done = 0;       ///< 0 to 1, of all criteria
  double seconds_left = 0;     ///< at the speed so far
};

/// The defaults are the thesis's settings.
struct TuningOptions {
  int population = 30;     ///< policies at a time, at least 2
  int generations = 50;    ///< of each criterion
  double overlap = 0.5;    ///< share of the population that stays; the rest are children
  double crossover = 0.9;  ///< probability
  double mutation = 0.01;  ///< probability, for each parameter
  ParameterRange max_inflation = {0, 10};        ///< of RefitPolicy::max_inflation
  ParameterRange child_distance_ratio = {0, 1};  ///< of RefitPolicy::child_distance_ratio
  ParameterRange min_inflation = {0, 1};         ///< of RefitPolicy::min_inflation
  /// One search each.
  std::vector<FitnessCriterion> criteria = {FitnessCriterion::A,      FitnessCriterion::B,
                                            FitnessCriterion::AB,     FitnessCriterion::BC,
                                            FitnessCriterion::ABC,    FitnessCriterion::AOrBC,
                                            FitnessCriterion::ABOrBC, FitnessCriterion::AD};
  /// Gives what is not searched: the inflation reference and the leaf rule.
  RefitPolicy base;
  TuningObjective objective = TuningObjective::CountedWork;  ///< what is minimised
  WorkCosts costs;                                           ///< for CountedWork
  unsigned seed = 1;                                         ///< of all random numbers
  /// After every generation. Return false to stop; the result then holds the best so far.
  std::function<bool(const TuningProgress&)> progress;
  /// A file that is written after every generation. When it is there at the start, the search goes
  /// on from it, as if it had never stopped; its other options must be the same.
  std::string checkpoint;
};

/// What a search found.
struct TuningResult {
  /// In the order of the options; without those that a stop left untouched.
  std::vector<TunedPolicy> by_criterion;
  bool finished = false;  ///< false when `progress` stopped the search

  /// The cheapest. There is at least one.
  const TunedPolicy& best() const;
};

/// Searches. Parameters that a criterion does not use keep the value of `base`.
/// Throws std::invalid_argument on options that make no sense, std::runtime_error when the
/// checkpoint cannot be read or written or belongs to other options.
TuningResult tune(const Simulation& simulation, const TuningOptions& options = {});

/// As JSON text. `policyFromJson` (policy_json.h) reads its best policy.
std::string toJson(const TuningResult& result);

}  // namespace adaptive_bvh
