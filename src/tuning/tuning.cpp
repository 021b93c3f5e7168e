#include "adaptive_bvh/tuning.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <initializer_list>
#include <random>
#include <stdexcept>
#include <utility>

#include <pagmo/utils/genetic_operators.hpp>

#include "checkpoint.h"

// tune: searches the RefitPolicy with the least cost of a simulation.
namespace adaptive_bvh {
namespace {

using Random = pagmo::detail::random_engine_type;

/// Throws std::invalid_argument, with the name of the option, if one is not valid.
void check(const Simulation& simulation, const TuningOptions& options) {
  const auto require = [](bool holds, const char* what) {
    if (!holds) throw std::invalid_argument(std::string("tune: ") + what);
  };
  const auto isShare = [](double x) { return x >= 0 && x <= 1; };
  require(bool(simulation), "there is no simulation");
  require(options.population >= 2, "population must be at least 2");
  require(options.generations >= 0, "generations must not be negative");
  require(options.overlap >= 0 && options.overlap < 1, "overlap must be in [0, 1)");
  require(isShare(options.crossover), "crossover must be in [0, 1]");
  require(isShare(options.mutation), "mutation must be in [0, 1]");
  require(!options.criteria.empty(), "there is no criterion to search");
  for (const ParameterRange& range :
       {options.max_inflation, options.child_distance_ratio, options.min_inflation})
    require(range.low >= 0 && range.low <= range.high && std::isfinite(range.high),
            "a parameter range must be finite, not negative, and in order");
  options.base.check();
}

/// A parameter of a policy to be searched.
struct Parameter {
  double RefitPolicy::*member;
  ParameterRange range;
};

/// The parameters that a criterion uses.
std::vector<Parameter> parametersOf(FitnessCriterion criterion, const TuningOptions& options) {
  using C = FitnessCriterion;
  const auto isOneOf = [criterion](std::initializer_list<C> list) {
    return std::find(list.begin(), list.end(), criterion) != list.end();
  };
  std::vector<Parameter> found;
  if (isOneOf({C::A, C::AB, C::ABC, C::AOrBC, C::ABOrBC}))
    found.push_back({&RefitPolicy::max_inflation, options.max_inflation});
  if (isOneOf({C::BC, C::ABC, C::AOrBC, C::ABOrBC})) {
    found.push_back({&RefitPolicy::child_distance_ratio, options.child_distance_ratio});
    found.push_back({&RefitPolicy::min_inflation, options.min_inflation});
  }
  return found;
}

/// The steady-state genetic algorithm of the thesis (GAlib's, with overlapping populations), one
/// run per criterion, with pagmo's operators. An individual is a policy, given by the values of the
/// criterion's parameters (`x`); a lower cost is better.
class Search {
 public:
  Search(const Simulation& simulation, const TuningOptions& options)
      : simulation_(simulation), options_(options), state_(loadSearch(options)) {
    done_at_start_ = shareDone();
  }

  /// Searches all criteria, or those before the user stops the search.
  TuningResult run() {
    while (state_.criterion < options_.criteria.size())
      if (!searchCriterion()) return {state_.done, false};
    return {state_.done, true};
  }

 private:
  /// Searches one criterion. Returns false if the user stops the search.
  bool searchCriterion() {
    parameters_ = parametersOf(options_.criteria[state_.criterion], options_);
    const int generations = parameters_.empty() ? 0 : options_.generations;
    if (state_.population.empty()) begin();
    for (; state_.generation < generations; ++state_.generation) {
      saveSearch(state_, options_);
      if (!report()) return false;
      evolve();
    }
    const bool go_on = report();
    ++state_.criterion;
    state_.generation = 0;
    state_.population.clear();
    saveSearch(state_, options_);
    return go_on || state_.criterion == options_.criteria.size();
  }

  /// The seed of this criterion and generation, so that a resumed search continues unchanged.
  unsigned seed() const {
    return options_.seed + 7919 * unsigned(state_.criterion) + 104729 * unsigned(state_.generation);
  }

  /// Fills the population with random policies; with one if the criterion has no parameters.
  void begin() {
    Random random(seed());
    state_.done.emplace_back();
    std::vector<std::vector<double>> points(parameters_.empty() ? 1
                                                                : std::size_t(options_.population));
    for (std::vector<double>& x : points)
      for (const Parameter& parameter : parameters_)
        x.push_back(std::uniform_real_distribution<double>(parameter.range.low,
                                                           parameter.range.high)(random));
    add(points);
  }

  /// One generation: adds children of parents chosen by tournament selection, by simulated binary
  /// crossover and polynomial mutation. Then removes the worst policies.
  void evolve() {
    Random random(seed());
    std::pair<std::vector<double>, std::vector<double>> bounds;
    for (const Parameter& parameter : parameters_) {
      bounds.first.push_back(parameter.range.low);
      bounds.second.push_back(parameter.range.high);
    }
    constexpr double kSpread = 10;  // distribution index of both operators, pagmo's default
    const auto count = std::size_t(std::ceil((1 - options_.overlap) * options_.population));
    std::vector<std::vector<double>> children;
    while (children.size() < count) {
      const std::vector<double>&mother = parent(random), &father = parent(random);
      auto [one, other] =
          pagmo::sbx_crossover(mother, father, bounds, 0, options_.crossover, kSpread, random);
      for (std::vector<double>* child : {&one, &other}) {
        pagmo::polynomial_mutation(*child, bounds, 0, options_.mutation, kSpread, random);
        if (children.size() < count) children.push_back(*child);
      }
    }
    add(children);
    state_.population.resize(std::size_t(options_.population));
  }

  /// The better of two random individuals (tournament selection).
  const std::vector<double>& parent(Random& random) const {
    std::uniform_int_distribution<std::size_t> index(0, state_.population.size() - 1);
    const Individual &a = state_.population[index(random)], &b = state_.population[index(random)];
    return a.cost <= b.cost ? a.x : b.x;
  }

  /// Evaluates policies, adds them to the sorted population, and updates the criterion's result.
  void add(const std::vector<std::vector<double>>& points) {
    for (const std::vector<double>& x : points)
      state_.population.push_back({x, costOf(policyAt(x))});
    std::stable_sort(state_.population.begin(), state_.population.end(),
                     [](const Individual& a, const Individual& b) { return a.cost < b.cost; });
    TunedPolicy& tuned = state_.done.back();
    tuned.policy = policyAt(state_.population.front().x);
    tuned.cost = state_.population.front().cost;
    tuned.evaluations += static_cast<long>(points.size());
  }

  /// The policy of the current criterion with these values of its parameters.
  RefitPolicy policyAt(const std::vector<double>& x) const {
    RefitPolicy policy = options_.base;
    policy.criterion = options_.criteria[state_.criterion];
    for (std::size_t i = 0; i < x.size(); ++i) policy.*parameters_[i].member = x[i];
    return policy;
  }

  /// Runs the simulation; returns its measured or computed time. Throws if it is not finite.
  double costOf(const RefitPolicy& policy) const {
    const SimulationWork work = simulation_(policy);
    const double cost = options_.objective == TuningObjective::MeasuredTime
                            ? work.seconds
                            : options_.costs.seconds(work);
    if (!std::isfinite(cost)) throw std::runtime_error("tune: the simulation's cost is not finite");
    return cost;
  }

  /// The share of the whole search that is done, from 0 to 1.
  double shareDone() const {
    const double steps = options_.generations + 1;
    return (double(state_.criterion) + std::min(1., (state_.generation + 1) / steps)) /
           double(options_.criteria.size());
  }

  /// Reports the progress to the user. Returns false if the user stops the search.
  bool report() const {
    if (!options_.progress) return true;
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start_;
    TuningProgress progress;
    progress.criterion = options_.criteria[state_.criterion];
    progress.generation = state_.generation;
    progress.best = TuningResult{state_.done, false}.best();
    progress.share_done = shareDone();
    const double share_since_start = progress.share_done - done_at_start_;
    progress.seconds_left =
        share_since_start > 0 ? elapsed.count() * (1 - progress.share_done) / share_since_start : 0;
    return options_.progress(progress);
  }

  const Simulation& simulation_;
  const TuningOptions& options_;
  SearchState state_;
  std::vector<Parameter> parameters_;  ///< of the criterion being searched
  double done_at_start_ = 0;           ///< shareDone when this search was begun or resumed
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace

const TunedPolicy& TuningResult::best() const {
  return *std::min_element(
      by_criterion.begin(), by_criterion.end(),
      [](const TunedPolicy& a, const TunedPolicy& b) { return a.cost < b.cost; });
}

TuningResult tune(const Simulation& simulation, const TuningOptions& options) {
  check(simulation, options);
  return Search(simulation, options).run();
}

}  // namespace adaptive_bvh
