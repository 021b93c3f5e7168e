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
  const auto useA = [&policy](double p_max) { policy.max_inflation = p_max; };
  const auto useC = [&policy](double k, double gamma) {
    policy.child_distance_ratio = k;
    policy.min_inflation = gamma;
  };
  switch (criterion) {  // Table 2
    case FitnessCriterion::A: useA(1.884184); break;
    case FitnessCriterion::AB: useA(1.498741); break;
    case FitnessCriterion::BC: useC(0.333928, 0.053803); break;
    case FitnessCriterion::AOrBC: useA(3.383383), useC(0.416571, 0.111757); break;
    case FitnessCriterion::ABC: useA(1.967193), useC(0.221836, 0.002197); break;
    case FitnessCriterion::ABOrBC: useA(1.359579), useC(0.891981, 0.590829); break;
    default: break;
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
  }
  return "unknown";
}

}  // namespace adaptive_bvh
