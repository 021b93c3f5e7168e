#include "checkpoint.h"

#include <cstdio>
#include <fstream>
#include <stdexcept>

#include <nlohmann/json.hpp>

namespace adaptive_bvh {

using nlohmann::json;

static void to_json(json& out, const RefitPolicy& policy) { out = json::parse(toJson(policy)); }
static void from_json(const json& in, RefitPolicy& policy) { policy = policyFromJson(in.dump()); }

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(TunedPolicy, policy, cost, evaluations)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Individual, x, cost)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(SearchState, criterion, generation, population, done)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ParameterRange, low, high)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(WorkCosts, bv_test, leaf_test, propagated, refitted_leaf,
                                   refitted_inner, refitted_primitive)

/// The options that must not change between stop and start.
static json identityOf(const TuningOptions& options) {
  return {{"population", options.population},
          {"generations", options.generations},
          {"overlap", options.overlap},
          {"crossover", options.crossover},
          {"mutation", options.mutation},
          {"max_inflation", options.max_inflation},
          {"child_distance_ratio", options.child_distance_ratio},
          {"min_inflation", options.min_inflation},
          {"criteria", options.criteria},
          {"base", options.base},
          {"objective", options.objective},
          {"costs", options.costs},
          {"seed", options.seed}};
}

void saveSearch(const SearchState& state, const TuningOptions& options) {
  if (options.checkpoint.empty()) return;
  const std::string draft = options.checkpoint + ".new";  // a stop in between loses nothing
  std::ofstream out(draft);
  out << json{{"options", identityOf(options)}, {"state", state}} << '\n';
  out.close();
  if (!out || std::rename(draft.c_str(), options.checkpoint.c_str()) != 0)
    throw std::runtime_error("tune: cannot write '" + options.checkpoint + "'");
}

SearchState loadSearch(const TuningOptions& options) {
  std::ifstream in;
  if (!options.checkpoint.empty()) in.open(options.checkpoint);
  if (!in.is_open()) return {};
  const std::string start = "tune: '" + options.checkpoint + "' ";
  json checkpoint;
  try {
    checkpoint = json::parse(in);
    if (checkpoint.at("options") == identityOf(options)) return checkpoint.at("state");
  } catch (const std::exception& error) {
    throw std::runtime_error(start + "is no checkpoint: " + error.what());
  }
  throw std::runtime_error(start + "belongs to a search with other options");
}

std::string toJson(const TuningResult& result) {
  return json{
      {"best", result.best()}, {"finished", result.finished}, {"by_criterion", result.by_criterion}}
      .dump(2);
}

}  // namespace adaptive_bvh
