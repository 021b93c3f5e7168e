#include "adaptive_bvh/policy_json.h"

#include <algorithm>
#include <stdexcept>
#include <type_traits>
#include <vector>

#include <nlohmann/json.hpp>

// RefitPolicy to and from JSON: an object with the policy's members. Enumerations are names.
namespace adaptive_bvh {
namespace {

using nlohmann::json;

/// The names of all values of an enumeration, in order. The argument selects the enumeration.
std::vector<std::string> namesOf(Propagation) {
  return {"translation-compensated", "displacements"};
}
std::vector<std::string> namesOf(InflationReference) { return {"node size", "original radius"}; }
std::vector<std::string> namesOf(FitnessCriterion) {
  std::vector<std::string> names;
  for (int i = 0; i <= static_cast<int>(FitnessCriterion::RefitNone); ++i)
    names.emplace_back(toString(static_cast<FitnessCriterion>(i)));
  return names;
}

/// The JSON value of a member.
template <typename Value>
json jsonOf(Value value) {
  if constexpr (std::is_enum_v<Value>)
    return namesOf(value)[static_cast<std::size_t>(value)];
  else
    return value;
}

/// Sets a member to its JSON value. Throws std::invalid_argument for an unknown name, and
/// nlohmann::json::exception for a value of another type.
template <typename Value>
void read(const json& json_value, Value& value) {
  if constexpr (std::is_enum_v<Value>) {
    const std::vector<std::string> names = namesOf(value);
    const auto found = std::find(names.begin(), names.end(), json_value.get<std::string>());
    if (found == names.end())
      throw std::invalid_argument(json_value.dump() + " is none of " + json(names).dump());
    value = static_cast<Value>(found - names.begin());
  } else {
    json_value.get_to(value);
  }
}

/// Calls visit(name, member) for every member of a policy.
template <typename Policy, typename Visit>
void forEachMember(Policy& policy, Visit&& visit) {
  visit("propagation", policy.propagation);
  visit("criterion", policy.criterion);
  visit("max_inflation", policy.max_inflation);
  visit("child_distance_ratio", policy.child_distance_ratio);
  visit("min_inflation", policy.min_inflation);
  visit("reference", policy.reference);
  visit("axes_tolerance", policy.axes_tolerance);
  visit("leaf_radius_may_shrink", policy.leaf_radius_may_shrink);
}

/// The policy with these members; others are defaults. Throws for members that are not valid.
RefitPolicy policyFrom(json members) {
  if (!members.is_object()) throw std::invalid_argument("not an object");
  RefitPolicy policy;
  forEachMember(policy, [&](const char* name, auto& member) {
    if (members.contains(name)) read(members[name], member);
    members.erase(name);
  });
  if (!members.empty())  // what is left is unknown
    throw std::invalid_argument("'" + members.begin().key() + "' is no member of a policy");
  policy.check();
  return policy;
}

}  // namespace

std::string toJson(const RefitPolicy& policy) {
  json members;
  forEachMember(policy, [&](const char* name, auto member) { members[name] = jsonOf(member); });
  return members.dump(2);
}

RefitPolicy policyFromJson(const std::string& text) {
  try {
    const json parsed = json::parse(text);
    // The text may also be the JSON of a TuningResult, whose best policy is returned.
    const bool is_result = parsed.is_object() && parsed.contains("best");
    return policyFrom(is_result ? parsed["best"].at("policy") : parsed);
  } catch (const std::exception& error) {
    throw std::invalid_argument(std::string("RefitPolicy from JSON: ") + error.what());
  }
}

}  // namespace adaptive_bvh
