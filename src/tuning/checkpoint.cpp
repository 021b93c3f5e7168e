#include "checkpoint.h"

#include <fstream>
#include <stdexcept>
#include <system_error>

#include <nlohmann/json.hpp>

#include "adaptive_bvh/detail/write_file.h"

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

/// The options that a search and its resumption must have in common.
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
  const json checkpoint = {{"options", identityOf(options)}, {"state", state}};
  try {
    detail::writeFile(options.checkpoint, [&](std::ostream& out) { out << checkpoint << '\n'; });
  } catch (const std::system_error& error) {
    throw std::runtime_error(std::string("tune: ") + error.what());
  }
}

SearchState loadSearch(const TuningOptions& options) {
  std::ifstream in;
  if (!options.checkpoint.empty()) in.open(options.checkpoint);
  if (!in.is_open()) return {};
  const std::string subject = "tune: '" + options.checkpoint + "' ";
  json checkpoint;
  try {
    checkpoint = json::parse(in);
    if (checkpoint.at("options") == identityOf(options)) return checkpoint.at("state");
  } catch (const std::exception& error) {
    throw std::runtime_error(subject + "is no checkpoint: " + error.what());
  }
  throw std::runtime_error(subject + "belongs to a search with other options");
}

std::string toJson(const TuningResult& result) {
  return json{
      {"best", result.best()}, {"finished", result.finished}, {"by_criterion", result.by_criterion}}
      .dump(2);
}

}  // namespace adaptive_bvh
