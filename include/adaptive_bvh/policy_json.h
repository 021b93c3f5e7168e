#pragma once

#include <string>

#include "adaptive_bvh/refit_policy.h"

namespace adaptive_bvh {

/// Component `policy_json`: refit policies as JSON text. Needs nlohmann-json to build, but not to
/// use.

/// Returns a JSON object with every member of the policy.
std::string toJson(const RefitPolicy& policy);

/// Returns the policy of a JSON text. Missing members keep their defaults. The text of a
/// TuningResult (tuning.h) gives its best policy. Throws std::invalid_argument, describing the
/// error, on anything but a valid policy.
RefitPolicy policyFromJson(const std::string& text);

}  // namespace adaptive_bvh
