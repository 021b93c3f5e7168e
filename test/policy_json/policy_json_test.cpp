// Policies as JSON, by the component policy_json alone: this program links neither tuning nor
// pagmo.
#include "adaptive_bvh/policy_json.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace adaptive_bvh_test {
namespace policy_json_test {

using adaptive_bvh::FitnessCriterion;
using adaptive_bvh::policyFromJson;
using adaptive_bvh::RefitPolicy;
using adaptive_bvh::toJson;

TEST(PolicyJson, PoliciesGoThereAndBack) {
  for (FitnessCriterion criterion :
       {FitnessCriterion::A, FitnessCriterion::ABOrBC, FitnessCriterion::RefitNone}) {
    RefitPolicy policy = RefitPolicy::thesis(criterion);
    policy.max_inflation = 1. / 3;
    policy.axes_tolerance = 1. / 7;
    if (criterion == FitnessCriterion::A)
      policy.propagation = adaptive_bvh::Propagation::TranslationCompensated;
    const RefitPolicy back = policyFromJson(toJson(policy));
    EXPECT_EQ(policy.criterion, back.criterion);
    EXPECT_EQ(policy.max_inflation, back.max_inflation);
    EXPECT_EQ(policy.child_distance_ratio, back.child_distance_ratio);
    EXPECT_EQ(policy.min_inflation, back.min_inflation);
    EXPECT_EQ(policy.propagation, back.propagation);
    EXPECT_EQ(policy.reference, back.reference);
    EXPECT_EQ(policy.leaf_radius_may_shrink, back.leaf_radius_may_shrink);
    EXPECT_EQ(policy.axes_tolerance, back.axes_tolerance);
  }
}

TEST(PolicyJson, OfATuningResultIsItsBest) {
  RefitPolicy policy;
  policy.max_inflation = 0.625;
  EXPECT_EQ(0.625, policyFromJson("{\"best\": {\"policy\": " + toJson(policy) +
                                  ", \"cost\": 1.5, \"evaluations\": 7}, \"finished\": true}")
                       .max_inflation);
}

TEST(PolicyJson, RefusesWhatIsNoPolicy) {
  EXPECT_EQ(0.7, policyFromJson("{\"max_inflation\": 0.7}").max_inflation);
  for (const char* text :
       {"", "{", "[]", "7", "{\"criterion\": \"D\"}", "{\"criterion\": 1}",
        "{\"max_inflation\": -1}", "{\"max_inflation\": \"much\"}", "{\"axes_tolerance\": -0.5}",
        "{\"leaf_radius_may_shrink\": 2}", "{\"leaf_radius_may_shrink\": \"yes\"}",
        "{\"volumes_rest\": true}", "{\"p_max\": 1}", "{\"reference\": \"moon\"}",
        "{\"propagation\": \"by air\"}", "{\"best\": {}}", "{\"best\": 1}"})
    EXPECT_THROW(policyFromJson(text), std::invalid_argument) << text;
}

}  // namespace policy_json_test
}  // namespace adaptive_bvh_test
