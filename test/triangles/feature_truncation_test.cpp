// Shares of the ways of features, judged without rounding on a lattice and in quadruple precision.
#include "triangles/feature_truncation.h"

#include <gtest/gtest.h>

#include "support/long_mode.h"
#include "support/random_geometry.h"
#include "support/swept_features.h"

namespace adaptive_bvh_test {
namespace feature_truncation_test {

using adaptive_bvh::FeatureTruncation;
using P = Eigen::Vector3d;
using FourCorners = std::array<P, 4>;

/// A pair of features with its way, and the shares of the corners.
struct Pair {
  int firsts = 1;  ///< 1 for a vertex and a face, 2 for two edges
  FourCorners start, end;
  std::array<double, 4> shares = {{1, 1, 1, 1}};

  void truncate(double separation, double unit = 0x1p-53) {
    std::array<FeatureTruncation::Corner, 4> corners;
    for (std::size_t i = 0; i < 4; ++i) corners[i] = {&start[i], &end[i], &shares[i], 0, unit};
    FeatureTruncation(firsts, corners, separation).lowerShares();
  }
  /// As a caller computes it.
  P at(std::size_t i) const {
    const fcl::Vector3d from = start[i].cast<double>(), to = end[i].cast<double>();
    const fcl::Vector3d x = from + double(shares[i]) * (to - from);
    return x;
  }
  bool isSafe() const {
    std::array<quad::Point, 4> from, to;
    for (std::size_t i = 0; i < 4; ++i) {
      from[i] = quad::of(start[i]);
      to[i] = quad::of(at(i));
    }
    return areApartAllTheWay(firsts, from, to);
  }
  bool areApartAtStart() const {
    std::array<quad::Point, 4> from;
    for (std::size_t i = 0; i < 4; ++i) from[i] = quad::of(start[i]);
    return areApartAllTheWay(firsts, from, from);
  }
  double kept() const { return (shares[0] + shares[1] + shares[2] + shares[3]) / 4; }
};

class FeatureTruncationTest : public testing::Test {
 protected:
  P latticePoint(int size) {
    return P(random_.below(size), random_.below(size), random_.below(size));
  }
  /// Whole numbers: parallel and perpendicular edges, ways along them, corners that coincide.
  Pair latticePair() {
    Pair pair;
    pair.firsts = 1 + random_.below(2);
    const int size = 2 + random_.below(6);
    for (P& x : pair.start) x = latticePoint(size);
    if (random_.oneIn(6)) pair.start[3] = pair.start[2] + pair.start[1] - pair.start[0];
    if (random_.oneIn(12)) pair.start[3] = pair.start[2];
    const P together = random_.oneIn(2) ? P(latticePoint(5) - P::Constant(2)) : P(P::Zero());
    for (std::size_t i = 0; i < 4; ++i)
      pair.end[i] = pair.start[i] + together +
                    (random_.oneIn(3) ? P(P::Zero()) : P(latticePoint(7) - P::Constant(3)));
    return pair;
  }
  /// Edges or a vertex and a face that are `apart` from each other, and parallel now and then.
  Pair nearPair(double apart) {
    Pair pair;
    pair.firsts = 1 + random_.below(2);
    for (P& x : pair.start) x = random_.vectorOfSize(1);
    if (pair.firsts == 1) {
      const P weights = P(random_.uniform(0, 1), random_.uniform(0, 1), random_.uniform(0, 1));
      const P u = pair.start[2] - pair.start[1], v = pair.start[3] - pair.start[1];
      pair.start[0] =
          (weights[0] * pair.start[1] + weights[1] * pair.start[2] + weights[2] * pair.start[3]) /
              weights.sum() +
          apart * u.cross(v).normalized();
    } else {
      const P u = pair.start[1] - pair.start[0];
      P v = random_.oneIn(3) ? u : random_.vectorOfSize(1);
      const P normal = (random_.oneIn(3) ? u.unitOrthogonal() : P(u.cross(v).normalized()));
      const P middle = pair.start[0] + random_.uniform(0, 1) * u + apart * normal;
      pair.start[2] = middle - random_.uniform(0, 1) * v;
      pair.start[3] = pair.start[2] + v;
    }
    const double moved = random_.size(-13, 1);
    for (std::size_t i = 0; i < 4; ++i)
      pair.end[i] =
          random_.oneIn(4) ? pair.start[i] : P(pair.start[i] + random_.vectorOfSize(moved));
    return pair;
  }

  RandomGeometry random_{58};
};

/// A million pairs of whole numbers, whose shares are rounded down to multiples of 1/4096: all
/// positions are whole numbers then, and the judge rounds nothing.
TEST_F(FeatureTruncationTest, LatticePairsStayApart) {
  constexpr int kParts = 4096, kPairs = 1000000;
  int apart = 0, whole = 0;
  double kept = 0;
  for (int round = 0; round < manySteps(kPairs); ++round) {
    Pair pair = latticePair();
    pair.truncate(0);
    std::array<integer::Point, 4> start, end, wanted;
    bool rests = true;
    for (std::size_t i = 0; i < 4; ++i) {
      const auto at = [&](double parts) -> integer::Point {
        const P x = kParts * pair.start[i] + parts * (pair.end[i] - pair.start[i]);
        return {std::int64_t(x[0]), std::int64_t(x[1]), std::int64_t(x[2])};
      };
      ASSERT_TRUE(pair.shares[i] >= 0 && pair.shares[i] <= 1);
      start[i] = at(0);
      end[i] = at(std::floor(kParts * pair.shares[i]));
      wanted[i] = at(kParts);
      const bool moves = pair.start[i] != pair.end[i];
      rests = rests && !(moves && pair.shares[i] > 0);
      ASSERT_TRUE(moves || pair.shares[i] == 1);
    }
    if (!areApartAllTheWay(pair.firsts, start, start)) {
      ASSERT_TRUE(rests) << round << ": touching features do not move";
      continue;
    }
    ASSERT_TRUE(areApartAllTheWay(pair.firsts, start, end)) << round;
    if (!areApartAllTheWay(pair.firsts, start, wanted)) {
      ++apart;
      kept += pair.kept();
      ASSERT_LT(pair.kept(), 1);
    } else {
      whole += pair.kept() == 1;
    }
  }
  EXPECT_GT(apart, kPairs / 10);
  EXPECT_GT(kept / apart, 0.7);
  EXPECT_GT(whole, kPairs / 3);
}

/// Pairs that are 1e-12 apart, or nearer or farther; computed in double precision, and in single.
TEST_F(FeatureTruncationTest, NearPairsStayApart) {
  int moving = 0, single = 0;
  for (int round = 0; round < manySteps(15000); ++round) {
    Pair pair = nearPair(random_.oneIn(2) ? 1e-12 : random_.size(-17, -1));
    if (!pair.areApartAtStart()) continue;
    Pair in_float = pair;
    pair.truncate(0);
    ASSERT_TRUE(pair.isSafe()) << round;
    moving += pair.kept() > 0;
    for (std::size_t i = 0; i < 4; ++i) {
      in_float.start[i] = in_float.start[i].cast<float>().cast<double>();
      in_float.end[i] = in_float.end[i].cast<float>().cast<double>();
    }
    if (!in_float.areApartAtStart()) continue;
    in_float.truncate(0, 0x1p-24);
    ASSERT_TRUE(in_float.isSafe()) << round;
    ++single;
  }
  EXPECT_GT(moving, 6000);
  EXPECT_GT(single, 2000);
}

/// Parallel plates a millionth of a millionth apart slide along each other as far as they like.
TEST_F(FeatureTruncationTest, SlidingKeepsTheWholeWay) {
  for (const double apart : {1e-3, 1e-9, 1e-12})
    for (int round = 0; round < 1000; ++round) {
      Pair pair;
      pair.firsts = 1 + random_.below(2);
      for (std::size_t i = 0; i < 4; ++i) {
        pair.start[i] = random_.point();
        pair.start[i][2] = int(i) < pair.firsts ? apart : 0;
        pair.end[i] = pair.start[i] + P(random_.uniform(), random_.uniform(), 0);
      }
      pair.truncate(0);
      ASSERT_EQ(1, pair.kept()) << round;
    }
}

/// Features nearer than the separation come no nearer, and may slide and part.
TEST_F(FeatureTruncationTest, KeepsTheSeparation) {
  const auto distanceAt = [](const Pair& pair, const std::array<double, 4>& shares) {
    std::array<quad::Point, 4> x;
    for (std::size_t i = 0; i < 4; ++i)
      x[i] = quad::of(pair.start[i]) +
             quad::Real(shares[i]) * (quad::of(pair.end[i]) - quad::of(pair.start[i]));
    return double(distance(pair.firsts, x));
  };
  for (int round = 0; round < manySteps(20000); ++round) {
    Pair pair = nearPair(random_.size(-6, -1));
    const double before = distanceAt(pair, {{0, 0, 0, 0}});
    if (!(before > 1e-9)) continue;
    const double separation = before * random_.size(-2, 1);
    pair.truncate(separation);
    for (int state = 0; state < 5; ++state) {
      std::array<double, 4> shares = pair.shares;
      for (double& share : shares)
        share *= random_.oneIn(3) ? random_.below(2) : random_.uniform(0, 1);
      const double now = distanceAt(pair, shares);
      ASSERT_GT(now, std::min(separation, before * (1 - 1e-8))) << round;
    }
  }
}

}  // namespace feature_truncation_test
}  // namespace adaptive_bvh_test
