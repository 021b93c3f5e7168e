#pragma once

#include <functional>
#include <string>
#include <vector>

#include "adaptive_bvh/policy_json.h"
#include "adaptive_bvh/refit_policy.h"
#include "adaptive_bvh/update_report.h"

namespace adaptive_bvh {

/// Component `tuning`: searches for the best RefitPolicy of a simulation by a genetic algorithm
/// (thesis chapter IV). Needs pagmo, and nlohmann-json to build.

/// Cost of a run of a simulation: counted work, and seconds.
struct SimulationWork {
  long bv_tests = 0;             ///< QueryWork::bv_tests, summed
  long leaf_tests = 0;           ///< QueryWork::leaf_tests, summed
  long propagated = 0;           ///< UpdateReport::propagated, summed
  long refitted_leaves = 0;      ///< UpdateReport::refitted_leaves, summed
  long refitted_inner = 0;       ///< UpdateReport::refitted_inner, summed
  long refitted_primitives = 0;  ///< UpdateReport::refitted_primitives, summed
  double seconds = 0;  ///< for TuningObjective::MeasuredTime: measured time of updates and queries

  /// Adds the work of an update. Call it once for each update, with the model's lastUpdate().
  void add(const UpdateReport& update);
  /// Adds the work of a query. Call it once for each query; for a pair of adaptive models add the
  /// work of one of them.
  void add(const QueryWork& queries);
  /// Adds the work of another simulation.
  SimulationWork& operator+=(const SimulationWork& other);
};

/// Runs all steps with a policy: set it on your models, update, query (by query.h, which records
/// traversal statistics), and add up. Called some thousand times; must not depend on the previous
/// run. May throw; `tune` passes the exception on.
using Simulation = std::function<SimulationWork(const RefitPolicy&)>;

/// Nanoseconds for each kind of work. The defaults were measured on a 2 GHz x86-64 server; only
/// their ratios matter to the search.
struct WorkCosts {
  double bv_test = 110;            ///< a volume test, including FCL's traversal around it
  double leaf_test = 88;           ///< a test of two triangles
  double propagated = 10;          ///< each volume that the propagation changes
  double refitted_leaf = 97;       ///< each refitted volume of one triangle
  double refitted_inner = 400;     ///< each other refitted volume, in addition to its triangles
  double refitted_primitive = 12;  ///< each triangle that an inner refit reads

  /// The cost of this work in seconds.
  double seconds(const SimulationWork& work) const;

  /// Measures the costs on this machine, in about a second, for models with this propagation.
  /// Repeated measurements differ slightly: keep the result to repeat a search.
  static WorkCosts measured(Propagation propagation = Propagation::TranslationCompensated);
};

/// The objective of `tune`.
enum class TuningObjective {
  CountedWork,   ///< WorkCosts times counts: the same seed gives the same answer
  MeasuredTime,  ///< SimulationWork::seconds, as in the thesis
};

/// Range of a parameter; low <= high.
struct ParameterRange {
  double low;   ///< smallest value of the search
  double high;  ///< largest value of the search
};

/// A policy and its cost, in seconds of the objective.
struct TunedPolicy {
  RefitPolicy policy;    ///< with the best parameters found
  double cost = 0;       ///< cost of the whole simulation
  long evaluations = 0;  ///< number of runs of the simulation for its criterion
};

/// Progress of a search.
struct TuningProgress {
  FitnessCriterion criterion;  ///< the criterion of the present search
  int generation = 0;          ///< of this criterion, from 0
  TunedPolicy best;            ///< of all criteria so far
  double share_done = 0;       ///< 0 to 1, of all criteria
  double seconds_left = 0;     ///< at the speed so far
};

/// The defaults are the thesis's settings.
struct TuningOptions {
  int population = 30;     ///< number of policies, at least 2
  int generations = 50;    ///< for each criterion
  double overlap = 0.5;    ///< share of the population that is kept; the rest are children
  double crossover = 0.9;  ///< probability
  double mutation = 0.01;  ///< probability, for each parameter
  ParameterRange max_inflation = {0, 10};        ///< of RefitPolicy::max_inflation
  ParameterRange child_distance_ratio = {0, 1};  ///< of RefitPolicy::child_distance_ratio
  ParameterRange min_inflation = {0, 1};         ///< of RefitPolicy::min_inflation
  /// Criteria to search, one after the other.
  std::vector<FitnessCriterion> criteria = {
      FitnessCriterion::A,   FitnessCriterion::B,     FitnessCriterion::AB,    FitnessCriterion::BC,
      FitnessCriterion::ABC, FitnessCriterion::AOrBC, FitnessCriterion::ABOrBC};
  /// Values that are not searched: the inflation reference and the leaf rule.
  RefitPolicy base;
  TuningObjective objective = TuningObjective::CountedWork;  ///< is minimised
  WorkCosts costs;                                           ///< for CountedWork
  unsigned seed = 1;                                         ///< of all random numbers
  /// Called after every generation. Return false to stop; the result then holds the best so far.
  std::function<bool(const TuningProgress&)> progress;
  /// A file that is written after every generation. If it exists at the start, the search continues
  /// from it, as if it had never stopped; its other options must be equal.
  std::string checkpoint;
};

/// Result of a search.
struct TuningResult {
  /// The best policy of each criterion, in the order of the options, without criteria that were not
  /// searched before a stop.
  std::vector<TunedPolicy> by_criterion;
  bool finished = false;  ///< false when `progress` stopped the search

  /// The cheapest. There is at least one.
  const TunedPolicy& best() const;
};

/// Searches for the best policy of a simulation. Parameters that a criterion does not use keep the
/// value of `base`. Throws std::invalid_argument on options that are out of range, and
/// std::runtime_error if the checkpoint cannot be read or written or belongs to other options.
TuningResult tune(const Simulation& simulation, const TuningOptions& options = {});

/// Returns the result as JSON text. `policyFromJson` (policy_json.h) reads its best policy.
std::string toJson(const TuningResult& result);

}  // namespace adaptive_bvh
