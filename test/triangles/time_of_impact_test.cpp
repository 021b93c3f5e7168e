// Times of impact of moving features against the signs of polynomials and distances in long double.
#include "triangles/time_of_impact.h"

#include <gtest/gtest.h>

#include "support/exact_geometry.h"
#include "support/long_mode.h"
#include "support/random_geometry.h"
#include "triangles/moving_pairs4.h"

namespace adaptive_bvh_test {
namespace time_of_impact_test {

using adaptive_bvh::FeatureKind;
using adaptive_bvh::MovingFeatures;
using exact::Real;
using P = Eigen::Vector3d;
using FourCorners = std::array<P, 4>;

/// A moving pair in long double.
struct Moving {
  FeatureKind kind;
  FourCorners start, end;

  exact::Point corner(std::size_t i, Real t) const {
    return exact::of(start[i]) + t * (exact::of(end[i]) - exact::of(start[i]));
  }
  Real distance(Real t) const {
    const exact::Point c[4] = {corner(0, t), corner(1, t), corner(2, t), corner(3, t)};
    if (kind == FeatureKind::EdgeEdge) return exact::distance(c[0], c[1], c[2], c[3]);
    return exact::distance(exact::Triangle{c[1], c[2], c[3]}, c[0]);
  }
  /// Six times the volume that the corners span: 0 when they touch.
  Real volume(Real t) const {
    const exact::Point o = corner(0, t);
    return (corner(1, t) - o).cross(corner(2, t) - o).dot(corner(3, t) - o);
  }
  Real extent() const {
    Real largest = 0;
    for (std::size_t i = 0; i < 4; ++i)
      largest = std::max(
          {largest, (corner(i, 0) - corner(0, 0)).norm(), (corner(i, 1) - corner(i, 0)).norm()});
    return largest;
  }
  /// The first time at which they touch, where the volume changes its sign: by bisection. 2 where
  /// they do not.
  Real firstContact() const {
    constexpr int kParts = 256;
    for (int i = 0; i < kParts; ++i) {
      Real low = Real(i) / kParts, high = Real(i + 1) / kParts;
      const bool side = volume(low) > 0;
      if (side == (volume(high) > 0)) continue;
      for (int k = 0; k < 80; ++k) {
        const Real middle = (low + high) / 2;
        (side == (volume(middle) > 0) ? low : high) = middle;
      }
      if (distance(low) <= 1e-16L * extent()) return low;
    }
    return 2;
  }
  MovingFeatures features() const { return {kind, start, end}; }
};

class TimeOfImpact : public testing::Test {
 protected:
  /// FourCorners in any position, on each other, on a line, in a plane; that move by anything from
  /// almost nothing to many times their size, together or apart.
  Moving pair(double offset) {
    Moving pair;
    pair.kind = random_.oneIn(2) ? FeatureKind::EdgeEdge : FeatureKind::VertexFace;
    const double size = random_.size(-3, 3), moved = size * random_.size(-3, 1.5);
    const P at = random_.point() * offset * size;
    const P together = random_.oneIn(2) ? P(random_.point() * 10 * moved) : P::Zero().eval();
    for (P& x : pair.start) x = at + random_.vectorOfSize(size);
    switch (random_.below(8)) {
      case 0: pair.start[3] = pair.start[2] + (pair.start[1] - pair.start[0]); break;
      case 1: pair.start[3] = pair.start[2]; break;
      case 2: pair.start[1] = pair.start[2] = pair.start[3]; break;
      case 3: pair.start[3] = (pair.start[1] + pair.start[2]) / 2; break;
      default: break;
    }
    for (std::size_t i = 0; i < 4; ++i)
      pair.end[i] = pair.start[i] + together + random_.vectorOfSize(moved);
    if (random_.oneIn(3))  // the edges stay parallel, or the face as it is
      for (std::size_t i = 1; i < 4; ++i) pair.end[i] = pair.start[i] + together;
    return pair;
  }

  RandomGeometry random_{29};
};

/// Until the time of impact the features are farther apart than the separation; at it they are
/// about as near; and without one they never are.
TEST_F(TimeOfImpact, IsNeverLateAndSeldomEarly) {
  int impacts = 0, none = 0, early = 0;
  const int rounds = manySteps(5000);
  for (int round = 0; round < rounds; ++round) {
    const Moving pair = this->pair(random_.oneIn(2) ? 0 : 100);
    const Real extent = pair.extent();
    const double separation =
        random_.oneIn(2) ? 0 : double(pair.distance(0)) * random_.size(-4, 0.1);
    const double time = pair.features().timeOfImpact(separation);
    ASSERT_TRUE(time >= 0 && (time <= 1 || time == MovingFeatures::kNever));
    const Real end = time <= 1 ? time : 1;
    constexpr int kSamples = 40;
    for (int i = 0; i < kSamples && end > 0; ++i)
      ASSERT_GT(pair.distance(end * i / kSamples), separation)
          << round << " at " << end * i / kSamples;
    if (separation == 0) {
      const Real contact = pair.firstContact();
      ASSERT_LE(Real(time <= 1 ? time : 2), contact) << round;
    }
    impacts += time <= 1;
    none += time > 1;
    if (time <= 1 && pair.distance(time) > separation + 1e-10L * extent) ++early;
  }
  EXPECT_GT(impacts, rounds / 7);
  EXPECT_GT(none, rounds / 4);
  EXPECT_LT(early, impacts / 200) << "the cap on steps is seldom reached";
}

/// Long edges that turn, nearly parallel and near each other all the time: the nearest points have
/// to be right where the angle of the edges is nearly lost. They never come nearer than 2.56e-4.
TEST_F(TimeOfImpact, OfEdgesThatStayNearlyParallel) {
  const FourCorners start = {P(-.1397, 2.5416, -4.6644), P(1.9274, .4187, 5.0737),
                             P(-.1125, 2.5135, -4.6155), P(1.9195, .4261, 5.0835)},
                    end = {P(-4.7843, .6551, .4245), P(2.2093, .944, -6.9659),
                           P(-4.7611, .6577, .3663), P(2.2232, .9431, -6.9614)};
  const Moving pair{FeatureKind::EdgeEdge, start, end};
  for (int i = 0; i <= 1000; ++i) ASSERT_GT(pair.distance(Real(i) / 1000), 2.5e-4L);
  EXPECT_EQ(MovingFeatures::kNever, pair.features().timeOfImpact(0));
}

/// Many pairs: there is no impact before they are as near as the tolerance.
TEST_F(TimeOfImpact, OfManyPairsThatStayNearlyParallel) {
  int impacts = 0;
  for (int round = 0; round < manySteps(2000); ++round) {
    Moving pair;
    pair.kind = FeatureKind::EdgeEdge;
    const double length = random_.size(-1, 2), apart = length * random_.size(-6, -2);
    for (FourCorners* corners : {&pair.start, &pair.end}) {
      const P from = random_.point() * length, to = from + random_.direction() * length;
      *corners = {from, to, from + random_.point() * apart, to + random_.point() * apart};
    }
    const double time = pair.features().timeOfImpact(0);
    if (time > 1) continue;
    ++impacts;
    ASSERT_LE(double(pair.distance(time)), 1e-9 * double(pair.extent())) << round;
  }
  EXPECT_GT(impacts, manySteps(200));
}

/// A limit leaves the answer as it is, or says that there is none before: also one that the answer
/// is just below.
TEST_F(TimeOfImpact, UpToALimit) {
  int before = 0;
  for (int round = 0; round < manySteps(5000); ++round) {
    const Moving pair = this->pair(0);
    const double time = pair.features().timeOfImpact(0);
    const double just_after = time * (1 + random_.below(20) * 1e-16);
    for (const double until : {random_.uniform(0, 1), std::min(just_after, 1.)}) {
      const double limited = pair.features().timeOfImpact(0, until);
      if (time <= until)
        ASSERT_EQ(time, limited) << round << " until " << until;
      else
        ASSERT_TRUE(limited == MovingFeatures::kNever || limited == time) << round;
      before += time <= until;
    }
  }
  EXPECT_GT(before, 100);
}

/// The bound at the start is a lower bound, and that of the nearest points where these are clear.
TEST_F(TimeOfImpact, DistanceAtStart) {
  int good = 0;
  for (int round = 0; round < 20000; ++round) {
    const Moving pair = this->pair(10);
    const Real bound = pair.features().distanceAtStart(), distance = pair.distance(0);
    ASSERT_LE(bound, distance) << round;
    good += bound >= distance - 1e-12L * pair.extent() - 64e-15L * pair.extent();
  }
  EXPECT_GT(good, 19500);
}

/// By hand: a vertex falls on a face, edges cross, parallel edges, a collapsed face, one that
/// turns.
TEST_F(TimeOfImpact, ByHand) {
  const auto time = [](FeatureKind kind, const FourCorners& start, const FourCorners& end,
                       double separation) {
    return MovingFeatures(kind, start, end).timeOfImpact(separation);
  };
  const P face[3] = {P(0, 0, 0), P(4, 0, 0), P(0, 4, 0)};
  const FourCorners above = {P(1, 1, 2), face[0], face[1], face[2]};
  const FourCorners below = {P(1, 1, -2), face[0], face[1], face[2]};
  EXPECT_NEAR(0.5, time(FeatureKind::VertexFace, above, below, 0), 1e-12);
  EXPECT_NEAR(0.25, time(FeatureKind::VertexFace, above, below, 1), 1e-12);
  EXPECT_EQ(0, time(FeatureKind::VertexFace, above, below, 2));
  EXPECT_EQ(MovingFeatures::kNever, time(FeatureKind::VertexFace, above, above, 1.99));
  const FourCorners point = {P(1, 1, 2), P(1, 1, 0), P(1, 1, 0), P(1, 1, 0)};
  const FourCorners passed = {P(1, 1, -2), P(1, 1, 0), P(1, 1, 0), P(1, 1, 0)};
  EXPECT_NEAR(0.5, time(FeatureKind::VertexFace, point, passed, 0), 1e-12);
  const FourCorners edges = {P(-1, 0, 0), P(1, 0, 0), P(-1, 0, 3), P(1, 0, 3)};
  const FourCorners fallen = {P(-1, 0, 0), P(1, 0, 0), P(-1, 0, -1), P(1, 0, -1)};
  EXPECT_NEAR(0.75, time(FeatureKind::EdgeEdge, edges, fallen, 0), 1e-12);
  const FourCorners line = {P(-2, 0, 0), P(-1, 0, 0), P(1, 0, 0), P(2, 0, 0)};
  const FourCorners shifted = {P(0, 0, 0), P(1, 0, 0), P(1, 0, 0), P(2, 0, 0)};
  EXPECT_NEAR(1, time(FeatureKind::EdgeEdge, line, shifted, 0), 1e-12);
  const FourCorners crossed = {P(-1, 0, 0), P(1, 0, 0), P(0, -1, 1), P(0, 1, 1)};
  const FourCorners turned = {P(-1, 0, 0), P(1, 0, 0), P(0, 1, -1), P(0, -1, -1)};
  EXPECT_NEAR(0.5, time(FeatureKind::EdgeEdge, crossed, turned, 0), 1e-12);
}

/// Pairs that four lanes of single precision call apart are so up to the share of the interval.
TEST_F(TimeOfImpact, FourPairsInSinglePrecision) {
  using adaptive_bvh::Float4;
  using adaptive_bvh::MovingPairs4;
  long apart = 0, all = 0;
  for (int round = 0; round < manySteps(1000); ++round) {
    Moving pairs[4];
    const FeatureKind kind = this->pair(0).kind;
    for (Moving& pair : pairs) {
      do pair = this->pair(0);
      while (pair.kind != kind);
      const double scale = 1 / (30 * double(pair.extent()));  // coordinates below 2
      for (std::size_t i = 0; i < 4; ++i) {
        pair.start[i] *= scale;
        pair.end[i] *= scale;
      }
    }
    MovingPairs4 four;
    for (std::size_t c = 0; c < 4; ++c) {
      const auto columns = [&](bool at_end) {
        Float4 x[4];
        for (int k = 0; k < 4; ++k) {
          const P& p = at_end ? pairs[k].end[c] : pairs[k].start[c];
          x[k] = Float4{float(p[0]), float(p[1]), float(p[2]), 0};
        }
        return adaptive_bvh::float4::columns(x[0], x[1], x[2], x[3]);
      };
      four.begin[c] = columns(false);
      four.end[c] = columns(true);
    }
    const float share = random_.oneIn(2) ? 1 : float(random_.uniform(0, 1));
    const float separation = random_.oneIn(2) ? 0 : float(random_.size(-5, -2));
    const adaptive_bvh::MovingPairs4Limits limits = {separation, 1.f / (1 << 22), share};
    const unsigned bits = kind == FeatureKind::EdgeEdge ? adaptive_bvh::stayApart<2>(four, limits)
                                                        : adaptive_bvh::stayApart<1>(four, limits);
    all += 4;
    for (int k = 0; k < 4; ++k) {
      if (!(bits >> k & 1)) continue;
      ++apart;
      for (int i = 0; i <= 16; ++i)
        ASSERT_GT(pairs[k].distance(Real(share) * i / 16), separation) << round;
      if (separation == 0) {
        ASSERT_GE(pairs[k].firstContact(), share) << round;
      }
    }
  }
  EXPECT_GT(apart, all / 4);
}

}  // namespace time_of_impact_test
}  // namespace adaptive_bvh_test
