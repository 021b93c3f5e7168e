#pragma once

#include <nlohmann/json.hpp>

#include "adaptive_bvh/policy_json.h"

namespace adaptive_bvh {

nlohmann::json asJson(const RefitPolicy& policy);

/// Throws std::invalid_argument or nlohmann::json::exception.
RefitPolicy policyFrom(const nlohmann::json& json);

}  // namespace adaptive_bvh
