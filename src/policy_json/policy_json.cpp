#include "adaptive_bvh/policy_json.h"

#include <initializer_list>
#include <stdexcept>

#include <nlohmann/json.hpp>

namespace adaptive_bvh {
namespace {

const char* nameOf(FitnessCriterion criterion) { return toString(criterion); }

const char* nameOf(InflationReference reference) {
  return reference == InflationReference::NodeSize ? "node size" : "original radius";
}

const char* nameOf(Propagation propagation) {
  return propagation == Propagation::TranslationCompensated ? "translation-compensated"
                                                            : "displacements";
}

template <typename Value>
Value named(const std::string& name, std::initializer_list<Value> values, const char* what) {
  for (const Value value : values)
    if (name == nameOf(value)) return value;
  throw std::invalid_argument("'" + name + "' is no " + what);
}

FitnessCriterion criterionNamed(const std::string& name) {
  return named(
      name,
      {FitnessCriterion::A, FitnessCriterion::B, FitnessCriterion::AB, FitnessCriterion::BC,
       FitnessCriterion::ABC, FitnessCriterion::AOrBC, FitnessCriterion::ABOrBC,
       FitnessCriterion::RefitAll, FitnessCriterion::RefitNone, FitnessCriterion::AD},
      "fitness criterion");
}
InflationReference referenceNamed(const std::string& name) {
  return named(name, {InflationReference::NodeSize, InflationReference::OriginalRadius},
               "inflation reference");
}
Propagation propagationNamed(const std::string& name) {
  return named(name, {Propagation::TranslationCompensated, Propagation::Displacements},
               "propagation");
}

nlohmann::json membersOf(const RefitPolicy& policy) {
  return {{"propagation", nameOf(policy.propagation)},
          {"criterion", toString(policy.criterion)},
          {"max_inflation", policy.max_inflation},
          {"child_distance_ratio", policy.child_distance_ratio},
          {"min_inflation", policy.min_inflation},
          {"reference", nameOf(policy.reference)},
          {"axes_tolerance", policy.axes_tolerance},
          {"leaf_radius_may_shrink", policy.leaf_radius_may_shrink}};
}

/// Throws std::invalid_argument or nlohmann::json::exception.
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
    else if (key == "axes_tolerance")
      policy.axes_tolerance = value;
    else if (key == "leaf_radius_may_shrink")
      policy.leaf_radius_may_shrink = value;
    else
      throw std::invalid_argument("'" + key + "' is no member of a policy");
  }
  policy.check();
  return policy;
}

}  // namespace

std::string toJson(const RefitPolicy& policy) { return membersOf(policy).dump(2); }

RefitPolicy policyFromJson(const std::string& text) {
  try {
    const nlohmann::json json = nlohmann::json::parse(text);
    const bool is_result = json.is_object() && json.contains("best");  // of `tune`
    return policyFrom(is_result ? json["best"].at("policy") : json);
  } catch (const std::exception& error) {
    throw std::invalid_argument(std::string("RefitPolicy from JSON: ") + error.what());
  }
}

}  // namespace adaptive_bvh
