#pragma once

#include <nlohmann/json.hpp>

#include "adaptive_bvh/tuning.h"

namespace adaptive_bvh {

nlohmann::json asJson(const RefitPolicy& policy);
nlohmann::json asJson(const TunedPolicy& tuned);

/// Throws std::invalid_argument or nlohmann::json::exception.
TunedPolicy tunedFrom(const nlohmann::json& json);

}  // namespace adaptive_bvh
