// Outward rounding: lengths and sums are never below their values in long double, and hardly above.
#include "base/rounding.h"

#include <gtest/gtest.h>

#include "support/exact_geometry.h"
#include "support/long_mode.h"
#include "support/random_geometry.h"

namespace adaptive_bvh_test {
namespace rounding_test {

using exact::Real;
namespace rounding = adaptive_bvh::rounding;

template <typename S>
class Rounding : public testing::Test {
 protected:
  static constexpr int kLeast = std::numeric_limits<S>::min_exponent10;

  RandomGeometryOf<S> random_{4};
};

using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(Rounding, Scalars);

/// Of vectors of every size, down to numbers whose squares vanish.
TYPED_TEST(Rounding, NormIsNeverBelowTheLength) {
  using S = TypeParam;
  // Four epsilon, and half of one for each of five operations.
  const Real margin = 6.6 * Real(rounding::epsilon<S>());
  for (int round = 0; round < manySteps(100000); ++round) {
    const S size = this->random_.size(this->kLeast, -this->kLeast / 2 - 2);
    fcl::Vector3<S> v = this->random_.vectorOfSize(size);
    if (this->random_.oneIn(3)) v[round % 3] = 0;
    const Real length = exact::of(v).norm(), bound = rounding::norm(v);
    ASSERT_GE(bound, length) << round;
    ASSERT_LE(bound, length * (1 + margin) + 2 * Real(rounding::tiny<S>())) << round;
  }
  EXPECT_EQ(0, rounding::norm(fcl::Vector3<S>(0, -S(0), 0)));
  constexpr S kSmallest = std::numeric_limits<S>::denorm_min();
  EXPECT_GE(rounding::norm(fcl::Vector3<S>(kSmallest, 0, 0)), kSmallest);
}

TYPED_TEST(Rounding, SumIsNeverBelowTheSum) {
  using S = TypeParam;
  for (int round = 0; round < manySteps(100000); ++round) {
    const S a = this->random_.size(-20, 5), b = this->random_.size(-20, 5);
    ASSERT_GE(Real(rounding::sum(a, b)), Real(a) + Real(b));
    ASSERT_LE(Real(rounding::sum(a, b)),
              (Real(a) + Real(b)) * (1 + 3 * Real(rounding::epsilon<S>())));
    ASSERT_EQ(a, rounding::sum(a, S(0)));
  }
}

/// A power of two, so that enlarging rounds nothing, to a size about 1.
TYPED_TEST(Rounding, EnlargementIsAPowerOfTwo) {
  using S = TypeParam;
  EXPECT_EQ(1, rounding::enlargement(S(0)));
  EXPECT_EQ(1, rounding::enlargement(S(1)));
  EXPECT_EQ(1, rounding::enlargement(rounding::shortLength<S>()));
  for (S extent = rounding::shortLength<S>() / 3; extent > 0; extent /= 3) {
    const S factor = rounding::enlargement(extent);
    int exponent;
    ASSERT_EQ(S(0.5), std::frexp(factor, &exponent));
    ASSERT_TRUE(std::isfinite(factor));
    ASSERT_LT(extent * factor, 2);
    if (extent > std::numeric_limits<S>::min()) {
      ASSERT_GE(extent * factor, 1);
    }
  }
}

}  // namespace rounding_test
}  // namespace adaptive_bvh_test
