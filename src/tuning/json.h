#pragma once

#include "adaptive_bvh/tuning.h"
#include "policy_json/json.h"

namespace adaptive_bvh {

nlohmann::json asJson(const TunedPolicy& tuned);

/// Throws std::invalid_argument or nlohmann::json::exception.
TunedPolicy tunedFrom(const nlohmann::json& json);

}  // namespace adaptive_bvh
