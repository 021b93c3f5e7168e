#include "adaptive_bvh/tuning.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <stdexcept>

#include <pagmo/algorithm.hpp>
#include <pagmo/problem.hpp>

#include "genetic.h"
#include "json.h"
#include "policy_parameters.h"

namespace adaptive_bvh {
namespace {

/// Where a search is, as it stands in the checkpoint.
struct SearchState {
  std::size_t criterion = 0;            // index of the one being searched
  int generation = 0;                   // generations done of it
  std::vector<pagmo::vector_double> x;  // its population; empty before the first
  std::vector<pagmo::vector_double> f;
  std::vector<TunedPolicy> done;  // of the criteria before it, and its best so far
};

class Search {
 public:
  Search(const Simulation& simulation, const TuningOptions& options)
      : simulation_(simulation), options_(options) {
    check();
    cost_ = [this](const RefitPolicy& policy) { return evaluate(policy); };
    if (!options_.checkpoint.empty()) load();
    done_at_start_ = shareDone();
  }

  TuningResult run() {
    while (state_.criterion < options_.criteria.size())
      if (!searchCriterion()) return {state_.done, false};
    return {state_.done, true};
  }

 private:
  void check() const {
    const auto require = [](bool holds, const char* what) {
      if (!holds) throw std::invalid_argument(std::string("tune: ") + what);
    };
    const auto isShare = [](double x) { return x >= 0 && x <= 1; };
    require(bool(simulation_), "there is no simulation");
    require(options_.population >= 2, "population must be at least 2");
    require(options_.generations >= 0, "generations must not be negative");
    require(options_.overlap >= 0 && options_.overlap < 1, "overlap must be in [0, 1)");
    require(isShare(options_.crossover), "crossover must be in [0, 1]");
    require(isShare(options_.mutation), "mutation must be in [0, 1]");
    require(!options_.criteria.empty(), "there is no criterion to search");
    for (const ParameterRange& range :
         {options_.max_inflation, options_.child_distance_ratio, options_.min_inflation})
      require(range.low >= 0 && range.low <= range.high && std::isfinite(range.high),
              "a parameter range must be finite, not negative, and in order");
    options_.base.check();
  }

  double evaluate(const RefitPolicy& policy) {
    ++evaluations_;
    const SimulationWork work = simulation_(policy);
    const double cost = options_.objective == TuningObjective::MeasuredTime
                            ? work.seconds
                            : options_.costs.seconds(work);
    if (!std::isfinite(cost)) throw std::runtime_error("tune: the simulation's cost is not finite");
    return cost;
  }

  /// Returns false when the user stops.
  bool searchCriterion() {
    const PolicyParameters parameters(options_.criteria[state_.criterion], options_);
    const int generations = parameters.none() ? 0 : options_.generations;
    pagmo::population population = begin(parameters);
    for (;;) {
      remember(parameters, population);
      if (state_.generation >= generations) break;
      save();
      if (!report()) return false;
      const pagmo::algorithm algorithm(
          OverlappingGeneration(options_.overlap, options_.crossover, options_.mutation, seed()));
      population = algorithm.evolve(population);
      ++state_.generation;
    }
    const bool go_on = report();
    ++state_.criterion;
    state_.generation = 0;
    state_.x.clear();
    state_.f.clear();
    save();
    return go_on || state_.criterion == options_.criteria.size();
  }

  /// Of this criterion and generation: so a search that was stopped goes on as it would have.
  unsigned seed() const {
    return options_.seed + 7919 * unsigned(state_.criterion) + 104729 * unsigned(state_.generation);
  }

  pagmo::population begin(const PolicyParameters& parameters) {
    evaluations_ = 0;
    if (parameters.none()) {
      state_.x = {pagmo::vector_double()};
      state_.f = {{evaluate(parameters.policyAt({}))}};
      return {};
    }
    const pagmo::problem problem(TuningProblem{&parameters, &cost_});
    if (state_.x.empty())
      return pagmo::population(problem, pagmo::population::size_type(options_.population), seed());
    pagmo::population population(problem, 0, seed());
    for (std::size_t i = 0; i < state_.x.size(); ++i)
      population.push_back(state_.x[i], state_.f[i]);
    return population;
  }

  void remember(const PolicyParameters& parameters, const pagmo::population& population) {
    if (!parameters.none()) {
      state_.x = population.get_x();
      state_.f = population.get_f();
    }
    const auto best =
        std::size_t(std::min_element(state_.f.begin(), state_.f.end(),
                                     [](const auto& a, const auto& b) { return a[0] < b[0]; }) -
                    state_.f.begin());
    state_.done.resize(state_.criterion + 1);
    TunedPolicy& tuned = state_.done.back();
    tuned.policy = parameters.policyAt(state_.x[best]);
    tuned.cost = state_.f[best][0];
    tuned.evaluations += evaluations_;
    evaluations_ = 0;
  }

  double shareDone() const {
    const double steps = options_.generations + 1;
    return (double(state_.criterion) + std::min(1., (state_.generation + 1) / steps)) /
           double(options_.criteria.size());
  }

  bool report() const {
    if (!options_.progress) return true;
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start_;
    TuningProgress progress;
    progress.criterion = options_.criteria[state_.criterion];
    progress.generation = state_.generation;
    progress.best = TuningResult{state_.done, false}.best();
    progress.share_done = shareDone();
    const double here = progress.share_done - done_at_start_;
    progress.seconds_left = here > 0 ? elapsed.count() * (1 - progress.share_done) / here : 0;
    return options_.progress(progress);
  }

  // ---- checkpoint -------------------------------------------------------------------------------

  /// What must not change between stop and start.
  nlohmann::json identity() const {
    nlohmann::json json = {
        {"population", options_.population},
        {"generations", options_.generations},
        {"overlap", options_.overlap},
        {"crossover", options_.crossover},
        {"mutation", options_.mutation},
        {"seed", options_.seed},
        {"base", asJson(options_.base)},
        {"objective", options_.objective == TuningObjective::MeasuredTime ? "time" : "work"}};
    for (FitnessCriterion criterion : options_.criteria)
      json["criteria"].push_back(toString(criterion));
    for (const ParameterRange& range :
         {options_.max_inflation, options_.child_distance_ratio, options_.min_inflation})
      json["ranges"].push_back({range.low, range.high});
    const WorkCosts& c = options_.costs;
    json["costs"] = {c.bv_test,       c.leaf_test,      c.propagated,
                     c.refitted_leaf, c.refitted_inner, c.refitted_primitive};
    return json;
  }

  void save() const {
    if (options_.checkpoint.empty()) return;
    nlohmann::json json = {{"options", identity()},
                           {"criterion", state_.criterion},
                           {"generation", state_.generation},
                           {"x", state_.x},
                           {"f", state_.f}};
    for (const TunedPolicy& tuned : state_.done) json["done"].push_back(asJson(tuned));
    const std::string draft = options_.checkpoint + ".new";  // a stop in between loses nothing
    std::ofstream out(draft);
    out << json.dump() << '\n';
    out.close();
    if (!out || std::rename(draft.c_str(), options_.checkpoint.c_str()) != 0)
      throw std::runtime_error("tune: cannot write '" + options_.checkpoint + "'");
  }

  void load() {
    std::ifstream in(options_.checkpoint);
    if (!in) return;
    const auto fail = [this](const std::string& why) {
      throw std::runtime_error("tune: '" + options_.checkpoint + "' " + why);
    };
    try {
      const nlohmann::json json = nlohmann::json::parse(in);
      if (json.at("options") != identity()) fail("belongs to a search with other options");
      state_.criterion = json.at("criterion");
      state_.generation = json.at("generation");
      state_.x = json.at("x").get<std::vector<pagmo::vector_double>>();
      state_.f = json.at("f").get<std::vector<pagmo::vector_double>>();
      for (const auto& tuned : json.at("done")) state_.done.push_back(tunedFrom(tuned));
    } catch (const nlohmann::json::exception& error) {
      fail(std::string("is no checkpoint: ") + error.what());
    } catch (const std::invalid_argument& error) {
      fail(std::string("is no checkpoint: ") + error.what());
    }
  }

  const Simulation& simulation_;
  const TuningOptions& options_;
  std::function<double(const RefitPolicy&)> cost_;
  SearchState state_;
  long evaluations_ = 0;
  double done_at_start_ = 0;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace

const TunedPolicy& TuningResult::best() const {
  return *std::min_element(
      by_criterion.begin(), by_criterion.end(),
      [](const TunedPolicy& a, const TunedPolicy& b) { return a.cost < b.cost; });
}

TuningResult tune(const Simulation& simulation, const TuningOptions& options) {
  return Search(simulation, options).run();
}

}  // namespace adaptive_bvh
