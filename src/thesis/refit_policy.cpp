// RefitPolicy: the parameters that the thesis tuned, checks, and names of criteria.
#include "adaptive_bvh/refit_policy.h"

#include <cmath>
#include <stdexcept>
#include <string>

#include "base/number_text.h"

namespace adaptive_bvh {

RefitPolicy RefitPolicy::thesis(FitnessCriterion criterion) {
  RefitPolicy policy;
  policy.criterion = criterion;
  policy.reference = InflationReference::OriginalRadius;
  policy.leaf_radius_may_shrink = false;
  policy.propagation = Propagation::Displacements;
  const auto set = [&policy](double p_max, double k, double gamma) {
    policy.max_inflation = p_max;
    policy.child_distance_ratio = k;
    policy.min_inflation = gamma;
  };
  const RefitPolicy defaults;
  const double unused_p = defaults.max_inflation;
  const double unused_k = defaults.child_distance_ratio;
  const double unused_gamma = defaults.min_inflation;
  switch (criterion) {  // Table 2
    case FitnessCriterion::A: set(1.884184, unused_k, unused_gamma); break;
    case FitnessCriterion::AB: set(1.498741, unused_k, unused_gamma); break;
    case FitnessCriterion::BC: set(unused_p, 0.333928, 0.053803); break;
    case FitnessCriterion::AOrBC: set(3.383383, 0.416571, 0.111757); break;
    case FitnessCriterion::ABC: set(1.967193, 0.221836, 0.002197); break;
    case FitnessCriterion::ABOrBC: set(1.359579, 0.891981, 0.590829); break;
    case FitnessCriterion::B:
    case FitnessCriterion::AD:
    case FitnessCriterion::RefitAll:
    case FitnessCriterion::RefitNone: break;
  }
  return policy;
}

void RefitPolicy::check() const {
  const auto require = [](double value, const char* name) {
    if (!std::isfinite(value) || value < 0)
      throw std::invalid_argument(std::string("RefitPolicy::") + name +
                                  " must be finite and not negative, but is " + textOf(value));
  };
  require(max_inflation, "max_inflation");
  require(child_distance_ratio, "child_distance_ratio");
  require(min_inflation, "min_inflation");
  require(axes_tolerance, "axes_tolerance");
}

const char* toString(FitnessCriterion criterion) {
  switch (criterion) {
    case FitnessCriterion::A: return "A";
    case FitnessCriterion::B: return "B";
    case FitnessCriterion::AB: return "A and B";
    case FitnessCriterion::BC: return "B and C";
    case FitnessCriterion::ABC: return "A and B and C";
    case FitnessCriterion::AOrBC: return "A or (B and C)";
    case FitnessCriterion::ABOrBC: return "(A and B) or (B and C)";
    case FitnessCriterion::RefitAll: return "refit all";
    case FitnessCriterion::RefitNone: return "refit none";
    case FitnessCriterion::AD: return "A and D";
  }
  return "unknown";
}

}  // namespace adaptive_bvh
