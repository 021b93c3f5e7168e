#pragma once

#include <ostream>

#include "adaptive_bvh/refit_policy.h"

namespace adaptive_bvh {

/// Lets the names of tests say which criterion they run under.
inline void PrintTo(FitnessCriterion criterion, std::ostream* out) { *out << toString(criterion); }

}  // namespace adaptive_bvh
