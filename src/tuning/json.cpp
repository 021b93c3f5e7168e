#include "json.h"

namespace adaptive_bvh {

nlohmann::json asJson(const RefitPolicy& policy) { return nlohmann::json::parse(toJson(policy)); }

nlohmann::json asJson(const TunedPolicy& tuned) {
  return {
      {"policy", asJson(tuned.policy)}, {"cost", tuned.cost}, {"evaluations", tuned.evaluations}};
}

TunedPolicy tunedFrom(const nlohmann::json& json) {
  TunedPolicy tuned;
  tuned.policy = policyFromJson(json.at("policy").dump());
  tuned.cost = json.at("cost");
  tuned.evaluations = json.at("evaluations");
  return tuned;
}

std::string toJson(const TuningResult& result) {
  nlohmann::json json = {{"best", asJson(result.best())}, {"finished", result.finished}};
  for (const TunedPolicy& tuned : result.by_criterion)
    json["by_criterion"].push_back(asJson(tuned));
  return json.dump(2);
}

}  // namespace adaptive_bvh
