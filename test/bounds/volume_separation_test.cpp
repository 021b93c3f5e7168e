// VolumeSeparation against the distance of two rectangle-swept spheres in long double.
#include "volume/volume_separation.h"

#include <gtest/gtest.h>

#include "support/exact_geometry.h"
#include "support/random_geometry.h"

namespace adaptive_bvh_test {
namespace volume_separation_test {

using adaptive_bvh::Volume;
using adaptive_bvh::VolumeSeparation;
using exact::Real;
namespace rounding = adaptive_bvh::rounding;

template <typename S>
class Separation : public testing::Test {
 protected:
  using BV = fcl::RSS<S>;
  using V = Volume<BV>;
  using P = Vector3<S>;

  /// Two volumes, and the way from the second's coordinates to the first's.
  struct Pair {
    BV a, b;
    fcl::Matrix3<S> R;
    P T;

    exact::Placement placed() const { return {exact::of(R), exact::of(T)}; }
    Real distance() const { return exact::distance(a, b, placed()); }
    /// What VolumeSeparation may lose by its contract.
    S error() const {
      return 64 * rounding::epsilon<S>() *
                 (T.template lpNorm<1>() + 2 * V::coordinateSum(a) + 2 * V::coordinateSum(b)) +
             rounding::tiny<S>();
    }
    S separation(const P& direction, S enough) const {
      return VolumeSeparation<BV>(R, T, V::cornerSum(a), V::cornerSum(b))(a, b, direction, enough);
    }
  };

  /// The second is set beside the first so that they are about as far apart as `gap` times their
  /// size: overlapping, touching, or apart; either may lie far from its own origin.
  Pair pair(int round) {
    Pair p;
    const S size_a = random_.size(-6, 6), size_b = random_.oneIn(3) ? size_a : random_.size(-6, 6);
    const S far = round % 3 == 0 ? S(0) : round % 3 == 1 ? size_a : S(1e3) * size_a;
    p.a = random_.volume(size_a, far);
    p.b = random_.volume(size_b, random_.oneIn(2) ? S(0) : size_b);
    p.R = random_.rotation();
    if (random_.oneIn(4)) p.b.axis = p.R.transpose() * p.a.axis;  // faces that are parallel
    const P middle_a = p.a.To + p.a.axis.col(0) * p.a.l[0] / 2 + p.a.axis.col(1) * p.a.l[1] / 2;
    const S gap = random_.oneIn(3) ? S(0) : random_.size(-5, 1);
    const P beside = random_.oneIn(2) ? P(p.a.axis.col(2)) : random_.direction();
    p.T = middle_a + beside * (size_a * gap + p.a.r + p.b.r) - p.R * p.b.To;
    return p;
  }

  static constexpr S kLargest = std::numeric_limits<S>::max();
  RandomGeometry<S> random_{3};
};

using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(Separation, Scalars);

/// Whatever direction is given, the separation is no more than the distance of the volumes, up to
/// nothing: the error term covers all rounding.
TYPED_TEST(Separation, NeverExceedsTheDistance) {
  using S = TypeParam;
  int apart = 0, overlapping = 0;
  for (int round = 0; round < 15000; ++round) {
    const auto p = this->pair(round);
    const Real distance = p.distance();
    (distance > 0 ? apart : overlapping) += 1;
    for (const S enough : {this->kLargest, S(distance / 2), S(0)})
      ASSERT_LE(Real(p.separation(this->random_.direction(), enough)), distance) << round;
  }
  EXPECT_GT(apart, 1500);
  EXPECT_GT(overlapping, 1500);
}

/// The worst direction for a bound is the best one: along the shortest line between the two bodies
/// nothing is left but rounding. Balls and parallel sheets have that line along their middles or
/// normals.
TYPED_TEST(Separation, HoldsWhereItIsTight) {
  using S = TypeParam;
  int tight = 0;
  for (int round = 0; round < 15000; ++round) {
    auto p = this->pair(round);
    const bool balls = round % 2 == 0;
    if (balls)
      p.a.l[0] = p.a.l[1] = p.b.l[0] = p.b.l[1] = 0;
    else
      p.b.axis = p.R.transpose() * p.a.axis;
    const Real distance = p.distance();
    const S separation = p.separation(Vector3<S>::Zero(), this->kLargest);
    ASSERT_LE(Real(separation), distance) << round;
    if (!balls || distance <= 0) continue;
    ASSERT_GE(Real(separation), distance - 2 * Real(p.error())) << "loses more than its error term";
    ++tight;
  }
  EXPECT_GT(tight, 1500);
}

/// A volume may have its corner in the origin and reach far from there: its sides count in what is
/// rounded, too.
TYPED_TEST(Separation, HoldsForLargeVolumesWithTheirCornersInTheOrigin) {
  using S = TypeParam;
  for (int round = 0; round < 15000; ++round) {
    auto p = this->pair(round);
    p.a.To.setZero();
    p.b.To.setZero();
    p.T = this->random_.direction() * (p.a.r + p.b.r) * this->random_.uniform(1, 2);
    ASSERT_LE(Real(p.separation(Vector3<S>::Zero(), this->kLargest)), p.distance()) << round;
  }
}

/// The search for a direction ends at the first that is enough, and returns its separation.
TYPED_TEST(Separation, EndsWhereItIsEnough) {
  using S = TypeParam;
  fcl::RSS<S> a;  // two sheets, one above the other
  a.axis.setIdentity();
  a.To.setZero();
  a.l[0] = a.l[1] = 1;
  a.r = 0;
  const VolumeSeparation<fcl::RSS<S>> separation(fcl::Matrix3<S>::Identity(),
                                                 Vector3<S>(0, 0, S(3)), 4, 4);
  const Vector3<S> askew = Vector3<S>(0, 3, 4) / 5;
  EXPECT_NEAR(3, separation(a, a, askew, 5), 1e-3) << "by the normal";
  EXPECT_NEAR(12. / 5 - 3. / 5, separation(a, a, askew, 1), 1e-3) << "by the direction given";
}

}  // namespace volume_separation_test
}  // namespace adaptive_bvh_test
