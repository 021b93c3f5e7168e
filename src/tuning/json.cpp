#include "tuning/json.h"

#include <stdexcept>

namespace adaptive_bvh {
namespace {

constexpr FitnessCriterion kCriteria[] = {
    FitnessCriterion::A,      FitnessCriterion::B,        FitnessCriterion::AB,
    FitnessCriterion::BC,     FitnessCriterion::ABC,      FitnessCriterion::AOrBC,
    FitnessCriterion::ABOrBC, FitnessCriterion::RefitAll, FitnessCriterion::RefitNone};

FitnessCriterion criterionNamed(const std::string& name) {
  for (FitnessCriterion criterion : kCriteria)
    if (name == toString(criterion)) return criterion;
  throw std::invalid_argument("'" + name + "' is no fitness criterion");
}

const char* nameOf(InflationReference reference) {
  return reference == InflationReference::NodeSize ? "node size" : "original radius";
}

InflationReference referenceNamed(const std::string& name) {
  for (auto reference : {InflationReference::NodeSize, InflationReference::OriginalRadius})
    if (name == nameOf(reference)) return reference;
  throw std::invalid_argument("'" + name + "' is no inflation reference");
}

const char* nameOf(Propagation propagation) {
  return propagation == Propagation::Boxes ? "boxes" : "displacements";
}

Propagation propagationNamed(const std::string& name) {
  for (auto propagation : {Propagation::Boxes, Propagation::Displacements})
    if (name == nameOf(propagation)) return propagation;
  throw std::invalid_argument("'" + name + "' is no propagation");
}

}  // namespace

nlohmann::json asJson(const RefitPolicy& policy) {
  return {{"propagation", nameOf(policy.propagation)},
          {"criterion", toString(policy.criterion)},
          {"max_inflation", policy.max_inflation},
          {"child_distance_ratio", policy.child_distance_ratio},
          {"min_inflation", policy.min_inflation},
          {"reference", nameOf(policy.reference)},
          {"leaf_radius_may_shrink", policy.leaf_radius_may_shrink}};
}

nlohmann::json asJson(const TunedPolicy& tuned) {
  return {
      {"policy", asJson(tuned.policy)}, {"cost", tuned.cost}, {"evaluations", tuned.evaluations}};
}

RefitPolicy policyFrom(const nlohmann::json& json) {
  RefitPolicy policy;
  if (!json.is_object()) throw std::invalid_argument("not an object");
  for (const auto& [key, value] : json.items()) {
    if (key == "criterion")
      policy.criterion = criterionNamed(value.get<std::string>());
    else if (key == "max_inflation")
      policy.max_inflation = value;
    else if (key == "child_distance_ratio")
      policy.child_distance_ratio = value;
    else if (key == "min_inflation")
      policy.min_inflation = value;
    else if (key == "propagation")
      policy.propagation = propagationNamed(value.get<std::string>());
    else if (key == "reference")
      policy.reference = referenceNamed(value.get<std::string>());
    else if (key == "leaf_radius_may_shrink")
      policy.leaf_radius_may_shrink = value;
    else
      throw std::invalid_argument("'" + key + "' is no member of a policy");
  }
  policy.check();
  return policy;
}

TunedPolicy tunedFrom(const nlohmann::json& json) {
  TunedPolicy tuned;
  tuned.policy = policyFrom(json.at("policy"));
  tuned.cost = json.at("cost");
  tuned.evaluations = json.at("evaluations");
  return tuned;
}

std::string toJson(const RefitPolicy& policy) { return asJson(policy).dump(2); }

std::string toJson(const TuningResult& result) {
  nlohmann::json json = {{"best", asJson(result.best())}, {"finished", result.finished}};
  for (const TunedPolicy& tuned : result.by_criterion)
    json["by_criterion"].push_back(asJson(tuned));
  return json.dump(2);
}

RefitPolicy policyFromJson(const std::string& text) {
  try {
    const nlohmann::json json = nlohmann::json::parse(text);
    return json.is_object() && json.contains("best") ? tunedFrom(json["best"]).policy
                                                     : policyFrom(json);
  } catch (const std::exception& error) {
    throw std::invalid_argument(std::string("RefitPolicy from JSON: ") + error.what());
  }
}

}  // namespace adaptive_bvh
