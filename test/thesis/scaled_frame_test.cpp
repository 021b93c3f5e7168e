// ScaledFrame: what is lost on the way to the coordinates of a step and back.
#include "thesis/vertex_states.h"

#include <gtest/gtest.h>

#include "base/rounding.h"
#include "support/exact_geometry.h"
#include "support/random_geometry.h"

namespace adaptive_bvh_test {
namespace scaled_frame_test {

using adaptive_bvh::Float4;
using adaptive_bvh::ScaledFrame;
using exact::Real;
namespace float4 = adaptive_bvh::float4;
namespace rounding = adaptive_bvh::rounding;

constexpr Real kUnitRoundoff = 1.L / (1 << 24);

template <typename S>
class ScaledFrameTest : public testing::Test {
 protected:
  /// That of a body of a size, anywhere.
  ScaledFrame<S> frame(S size) {
    return {random_.point() * (random_.oneIn(2) ? size : 1000 * size), size};
  }

  RandomGeometryOf<S> random_{5};
};

exact::Point pointOf(const Float4& v) { return {Real(v[0]), Real(v[1]), Real(v[2])}; }

using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(ScaledFrameTest, Scalars);

/// The scale is a power of two that makes the body's size 1 to 2: products with it are exact.
TYPED_TEST(ScaledFrameTest, ScaleIsAPowerOfTwo) {
  using S = TypeParam;
  for (int round = 0; round < 2000; ++round) {
    const S size = this->random_.size(-6, 6);
    const ScaledFrame<S> frame = this->frame(size);
    int exponent;
    EXPECT_EQ(S(0.5), std::frexp(frame.scale(), &exponent));
    EXPECT_EQ(S(1), frame.scale() * frame.unit());
    EXPECT_GE(size * frame.scale(), 1);
    EXPECT_LT(size * frame.scale(), 2);
  }
  EXPECT_EQ(S(1), ScaledFrame<S>(fcl::Vector3<S>::Zero(), 0).scale());
  for (const S size : {std::numeric_limits<S>::denorm_min(), std::numeric_limits<S>::max()}) {
    const ScaledFrame<S> frame(fcl::Vector3<S>::Zero(), size);
    EXPECT_TRUE(std::isnormal(frame.scale()) && std::isnormal(frame.unit())) << size;
  }
}

/// A component is off by 2 u of itself.
TYPED_TEST(ScaledFrameTest, PointsAreOffByTwiceTheUnitRoundoff) {
  using S = TypeParam;
  Real worst = 0;
  for (int round = 0; round < 200000; ++round) {
    const S size = this->random_.size(-6, 6);
    const ScaledFrame<S> frame = this->frame(size);
    const fcl::Vector3<S> x =
        frame.origin() + this->random_.vectorOfSize(size * this->random_.size(-3, 3));
    const exact::Point y = (exact::of(x) - exact::of(frame.origin())) * Real(frame.scale());
    const exact::Point found = pointOf(frame(x));
    for (int k = 0; k < 3; ++k) {
      const Real error = std::abs(found[k] - y[k]);
      ASSERT_LE(error, 2 * kUnitRoundoff * std::abs(y[k])) << round;
      if (y[k] != 0) worst = std::max(worst, error / std::abs(y[k]));
    }
  }
  EXPECT_GT(worst, kUnitRoundoff / 2);
}

/// The way back is rounded by a few epsilon of what it is a sum of.
TYPED_TEST(ScaledFrameTest, ComesBack) {
  using S = TypeParam;
  for (int round = 0; round < 50000; ++round) {
    const ScaledFrame<S> frame = this->frame(this->random_.size(-6, 6));
    const fcl::Vector3<S> y = this->random_.point() * 2;
    const Float4 stored{float(y[0]), float(y[1]), float(y[2]), 0};
    const exact::Point x = exact::of(frame.origin()) + pointOf(stored) * Real(frame.unit());
    const Real largest = exact::of(frame.origin()).template lpNorm<1>() + 4 * Real(frame.unit());
    ASSERT_LE((exact::of(frame.back(stored)) - x).norm(),
              4 * Real(rounding::epsilon<S>()) * largest);
  }
}

/// A displacement is off by 2 u of each component or by 2^-59, and no motion vanishes.
TYPED_TEST(ScaledFrameTest, DisplacementsAreCloseAndNeverVanish) {
  using S = TypeParam;
  const Real kSmall = std::ldexp(1.L, -59);
  int tiny = 0;
  for (int round = 0; round < 200000; ++round) {
    const ScaledFrame<S> frame = this->frame(this->random_.size(-6, 6));
    const fcl::Vector3<S> d = this->random_.vectorOfSize(this->random_.size(-30, 6));
    const Float4 v = frame.displacement(d);
    for (int k = 0; k < 3; ++k) {
      const Real exactly = Real(d[k]) * Real(frame.scale());
      ASSERT_LE(std::abs(Real(v[k]) - exactly),
                std::max(2 * kUnitRoundoff * std::abs(exactly), kSmall));
    }
    ASSERT_GE(float4::largest(float4::absolute(v)), ScaledFrame<S>::kLeast) << d.transpose();
    tiny += v[0] == ScaledFrame<S>::kLeast;
  }
  EXPECT_GT(tiny, 1000) << "displacements too small to be told must be among them";
  const Float4 none = this->frame(1).displacement(fcl::Vector3<S>::Zero());
  EXPECT_EQ(0, float4::largest(float4::absolute(none))) << "a vertex at rest does not move";
  const fcl::Vector3<S> least(0, std::numeric_limits<S>::denorm_min(), 0);
  EXPECT_EQ(ScaledFrame<S>::kLeast, this->frame(S(1e6)).displacement(least)[0]);
}

}  // namespace scaled_frame_test
}  // namespace adaptive_bvh_test
