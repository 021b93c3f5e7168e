// TiedTriangles against the distances of all pairs of triangles in long double.
#include "query/nearest/tied_triangles.h"

#include <gtest/gtest.h>

#include "support/exact_geometry.h"
#include "support/random_geometry.h"

namespace adaptive_bvh_test {
namespace tied_triangles_test {

using adaptive_bvh::RelativePlacement;
using adaptive_bvh::TiedCorners;
using adaptive_bvh::TiedTriangles;
using Along = TiedTriangles::Along;
using exact::Real;
using P = fcl::Vector3d;

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
constexpr unsigned kAll = 0xffff;

/// Four triangles of each of two meshes.
struct Leaves {
  std::vector<P> a, b;
  RelativePlacement to_first;
  TiedCorners corners_of_a, corners_of_b;

  /// Valid until the next call for these leaves.
  TiedTriangles tied() {
    const auto set = [](const std::vector<P>& corners, TiedCorners& to) {
      for (std::size_t i = 0; i < corners.size(); ++i) to.set(i % 3, int(i / 3), corners[i]);
    };
    set(a, corners_of_a);
    set(b, corners_of_b);
    corners_of_b.place(to_first);
    return {corners_of_a, corners_of_b};
  }
  /// TiedTriangles::apartNear, with any kind of direction first. The pair itself must be found
  /// apart or not whichever that is.
  static unsigned apartNear(const TiedTriangles& tied, int bit, double limit, unsigned pairs) {
    unsigned any = 0;
    for (const Along kind :
         {Along::Line, Along::FirstNormal, Along::SecondNormal, Along::Centroids}) {
      Along preferred = kind;
      const unsigned apart = tied.apartNear(bit, limit, pairs, P::Zero(), preferred);
      if (kind != Along::Line) {
        EXPECT_EQ(any >> bit & 1, apart >> bit & 1);
      }
      any |= apart;
      Along again = preferred;
      if (apart >> bit & 1) {
        tied.apartNear(bit, limit, pairs, P::Zero(), again);
        EXPECT_EQ(preferred, again);
      }
    }
    return any;
  }
  Real distance(int bit) const {
    const auto of = [](const std::vector<P>& v, int i) -> exact::Triangle {
      const auto k = std::size_t(3 * i);
      return {exact::of(v[k]), exact::of(v[k + 1]), exact::of(v[k + 2])};
    };
    const exact::Placement placed{exact::of(to_first.R), exact::of(to_first.T)};
    return exact::distance(of(a, bit & 3), placed(of(b, bit >> 2)));
  }
  /// DistanceRounding::ofSeparations, of these coordinates.
  double error() const {
    double sum = to_first.T.lpNorm<1>();
    for (const std::vector<P>* mesh : {&a, &b}) {
      double largest = 0;
      for (const P& x : *mesh) largest = std::max(largest, x.lpNorm<1>());
      sum += largest;
    }
    return 4 * kEpsilon * sum;
  }
};

class TiedTrianglesTest : public testing::Test {
 protected:
  Leaves leaves() {
    Leaves leaves;
    const double size = random_.size(-6, 6), size_b = random_.oneIn(2) ? size : random_.size(-6, 6);
    const P at = random_.point() * (random_.oneIn(2) ? 0 : size * random_.size(-1, 3));
    leaves.to_first.R = random_.oneIn(3) ? fcl::Matrix3d::Identity() : random_.rotation();
    for (int k = 0; k < 4; ++k) {
      for (const P& x : random_.triangleAt(at + random_.point() * size, size))
        leaves.a.push_back(x);
      for (const P& x : random_.triangleAt(at + random_.point() * size_b, size_b))
        leaves.b.push_back(x);
    }
    const P away = random_.vectorOfSize((size + size_b) * random_.size(-3, 1));
    leaves.to_first.T = leaves.a[0] + away - leaves.to_first.R * leaves.b[0];
    return leaves;
  }

  RandomGeometry random_{29};
};

/// What is reported is at least the limit apart, up to the error, along any direction of any
/// length; other pairs than those that are asked for are not reported.
TEST_F(TiedTrianglesTest, WhatIsApartIsNotNearerThanTheLimit) {
  long reported = 0;
  for (int round = 0; round < 4000; ++round) {
    Leaves pair = leaves();
    const auto pairs = unsigned(1 + random_.below(int(kAll)));
    const TiedTriangles tied = pair.tied();
    for (int bit = 0; bit < 16; ++bit) {
      if (!(pairs >> bit & 1)) continue;
      const Real distance = pair.distance(bit);
      for (const double limit : {double(distance) / 2, double(distance) * (1 - 1e-9)}) {
        if (!(limit > 0)) continue;
        const unsigned apart =
            Leaves::apartNear(tied, bit, limit, pairs) |
            tied.apartAlong(random_.vectorOfSize(random_.size(-9, 9)), limit, pairs);
        ASSERT_EQ(0u, apart & ~pairs) << round;
        for (int other = 0; other < 16; ++other) {
          if (!(apart >> other & 1)) continue;
          ASSERT_GE(pair.distance(other) + Real(pair.error()), Real(limit)) << round;
          ++reported;
        }
      }
    }
  }
  EXPECT_GT(reported, 40000);
}

/// Two parallel sheets of one tessellation, on lattice coordinates: one normal separates all pairs
/// exactly, whichever sheet comes first.
TEST_F(TiedTrianglesTest, ANormalSeparatesAllPairsOfParallelSheets) {
  for (const double height : {1., -1.}) {
    Leaves sheets;
    for (int k = 0; k < 4; ++k)
      for (const P& corner : {P(k, 0, 0), P(k + 1, 0, 0), P(k, 1, 0)}) {
        sheets.a.push_back(corner);
        sheets.b.push_back(corner + P(0, 0, height));
      }
    const TiedTriangles tied = sheets.tied();
    for (int bit = 0; bit < 16; ++bit) {
      EXPECT_EQ(kAll, Leaves::apartNear(tied, bit, 1, kAll)) << bit;
      if (bit % 5 == 0) {  // one above the other
        EXPECT_EQ(0u, Leaves::apartNear(tied, bit, 1 + kEpsilon, kAll) >> bit & 1) << bit;
      }
    }
    EXPECT_EQ(kAll, tied.apartAlong(P(0, 0, 1e9), 1, kAll));
    EXPECT_EQ(0u, tied.apartAlong(P(0, 0, 1e9), 1 + kEpsilon, kAll));
    EXPECT_EQ(0u, tied.apartAlong(P(0, 0, 1e-170), 1, kAll)) << "its square underflows";
    EXPECT_EQ(0u, tied.apartAlong(P::Zero(), 1, kAll));
  }
}

/// Above a face, that face's normal is the direction: of either triangle, seen from either side.
TEST_F(TiedTrianglesTest, TheNormalsOfThePairAreTried) {
  for (const double side : {1., -1.}) {
    const std::vector<P> face = {P(0, 0, 0), P(6, 0, 0), P(0, 6, 0)};
    const std::vector<P> above = {P(2, 1, side), P(2, 3, 2 * side), P(0, 4, 3 * side)};
    for (const bool first : {true, false}) {
      Leaves leaves;
      leaves.a = first ? face : above;
      leaves.b = first ? above : face;
      EXPECT_EQ(1u, Leaves::apartNear(leaves.tied(), 0, 1, 1));
      EXPECT_EQ(0u, Leaves::apartNear(leaves.tied(), 0, 1.001, 1));
    }
  }
}

/// A triangle so thin that the square of its normal underflows has no direction.
TEST_F(TiedTrianglesTest, HoldForTrianglesOfHardlyAnyArea) {
  const double root = std::sqrt(std::numeric_limits<double>::denorm_min());
  for (const double height : {0.7, 1.2, 1.5, 2.3, 10.}) {
    const std::vector<P> thin = {P(0, 0, 0), P(1, 0, 0), P(0, height * root, 0)};
    const std::vector<P> above = {P(0.3, 0, 1), P(0.5, 0, 1), P(0.4, 0.1, 1)};
    for (const bool first : {true, false}) {
      Leaves leaves;
      leaves.a = first ? thin : above;
      leaves.b = first ? above : thin;
      EXPECT_EQ(0u, Leaves::apartNear(leaves.tied(), 0, 1.00001, 1)) << height;
    }
  }
}

}  // namespace tied_triangles_test
}  // namespace adaptive_bvh_test
