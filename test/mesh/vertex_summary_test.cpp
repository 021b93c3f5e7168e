// What a step knows of its positions, against a walk over them in long double.
#include "mesh/vertex_summary.h"

#include <gtest/gtest.h>

#include "support/exact_geometry.h"
#include "support/random_geometry.h"

namespace adaptive_bvh_test {
namespace vertex_summary_test {

using adaptive_bvh::usablePositions;
using adaptive_bvh::VertexSummary;
using exact::Real;
namespace rounding = adaptive_bvh::rounding;

template <typename S>
class Summary : public testing::Test {
 protected:
  using P = fcl::Vector3<S>;
  static constexpr S kInfinity = std::numeric_limits<S>::infinity();
  RandomGeometryOf<S> random_{23};
};

using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(Summary, Scalars);

/// Box, largest displacement (rounded up, by little) and whether anything moved; gathered at once
/// or in parts, as threads do.
TYPED_TEST(Summary, IsThatOfAllPositions) {
  using S = TypeParam;
  for (int round = 0; round < 2000; ++round) {
    const S size = this->random_.size(-15, 6);
    VertexSummary<S> whole, parts[3], sum;
    exact::Point low = exact::Point::Constant(std::numeric_limits<S>::max()), high = -low;
    Real largest = 0;
    for (int v = 0; v < 12; ++v) {
      const fcl::Vector3<S> p = this->random_.point();
      const fcl::Vector3<S> d =
          round % 7 ? this->random_.vectorOfSize(size) : fcl::Vector3<S>(0, 0, 0);
      whole.add(p, d);
      parts[v % 3].add(p, d);
      low = low.cwiseMin(exact::of(p));
      high = high.cwiseMax(exact::of(p));
      largest = std::max(largest, exact::of(d).norm());
    }
    for (const auto& part : parts) sum.add(part);
    for (const auto& summary : {whole, sum}) {
      EXPECT_EQ(low, exact::of(summary.low));
      EXPECT_EQ(high, exact::of(summary.high));
      EXPECT_EQ(largest > 0, summary.moved());
      ASSERT_GE(Real(summary.largestDisplacement()), largest);
      ASSERT_LE(Real(summary.largestDisplacement()),
                largest * (1 + 16 * Real(rounding::epsilon<S>())) + 2 * Real(rounding::tiny<S>()));
      EXPECT_TRUE(summary.isSurelyUsable());
    }
  }
}

/// Positions that lie together, any number of them: as one after the other. The least motion counts
/// and a number that is none is found wherever it stands.
TYPED_TEST(Summary, OfPositionsThatLieTogether) {
  using S = TypeParam;
  for (std::size_t count = 0; count < 20; ++count) {
    std::vector<fcl::Vector3<S>> before, now;
    VertexSummary<S> one, together, still;
    for (std::size_t v = 0; v < count; ++v) {
      before.push_back(this->random_.point());
      now.push_back(this->random_.oneIn(3)
                        ? before[v]
                        : fcl::Vector3<S>(before[v] + this->random_.vectorOfSize(S(0.1))));
      one.add(now[v], now[v] - before[v]);
    }
    together.add(now.data(), before.data(), count);
    still.add(before.data(), before.data(), count);
    EXPECT_EQ(one.low, together.low);
    EXPECT_EQ(one.high, together.high);
    EXPECT_EQ(one.squared, together.squared);
    EXPECT_EQ(one.moved(), together.moved());
    EXPECT_FALSE(still.moved());
    for (std::size_t i = 0; i < 3 * count; ++i) {
      const auto with = [&](S number) -> VertexSummary<S> {
        std::vector<fcl::Vector3<S>> other = before;
        other[i / 3][Eigen::Index(i % 3)] = number;
        VertexSummary<S> summary;
        summary.add(other.data(), before.data(), count);
        return summary;
      };
      const S x = before[i / 3][Eigen::Index(i % 3)];
      EXPECT_TRUE(with(std::nextafter(x, S(9))).moved());
      for (const S wrong : {this->kInfinity, -this->kInfinity, S(std::nan(""))})
        EXPECT_FALSE(with(wrong).isSurelyUsable()) << i << ' ' << wrong;
    }
  }
}

TYPED_TEST(Summary, CopiesPoints) {
  using S = TypeParam;
  for (std::size_t count = 1; count < 20; ++count) {
    std::vector<fcl::Vector3<S>> from, to(count + 1, fcl::Vector3<S>(7, 8, 9));
    const fcl::Vector3<S> middle = this->random_.point();
    Real most = 0;
    for (std::size_t v = 0; v < count; ++v) {
      from.push_back(this->random_.point());
      most = std::max(most, (exact::of(from[v]) - exact::of(middle)).squaredNorm());
    }
    const S found = adaptive_bvh::copyPoints(from.data(), count, middle, to.data());
    EXPECT_NEAR(double(found), double(most), 8 * double(rounding::epsilon<S>()) * double(most));
    EXPECT_EQ(to.back(), fcl::Vector3<S>(7, 8, 9));
    to.pop_back();
    EXPECT_EQ(from, to);
  }
}

/// A displacement whose square underflows is still one; without any, the largest is exactly 0.
TYPED_TEST(Summary, TheLeastMotionCounts) {
  using S = TypeParam;
  VertexSummary<S> summary;
  summary.add(fcl::Vector3<S>(1, 2, 3), fcl::Vector3<S>::Zero());
  EXPECT_FALSE(summary.moved());
  EXPECT_EQ(0, summary.largestDisplacement());
  const S least = std::numeric_limits<S>::denorm_min();
  for (int k = 0; k < 3; ++k) {
    VertexSummary<S> one = summary;
    one.add(fcl::Vector3<S>(1, 2, 3), fcl::Vector3<S>::Unit(k) * -least);
    EXPECT_TRUE(one.moved());
    EXPECT_GE(one.largestDisplacement(), least);
  }
}

/// Up to the largest coordinate and no farther; one such number among thousands is found, wherever
/// it stands.
TYPED_TEST(Summary, FindsPositionsThatAreNotUsable) {
  using S = TypeParam;
  const S limit = rounding::largestCoordinate<S>();
  const S beyond = std::nextafter(limit, this->kInfinity);
  std::vector<fcl::Vector3<S>> positions(1000, fcl::Vector3<S>(limit, -limit, 0));
  EXPECT_TRUE(usablePositions<S>(positions.data(), positions.size()));
  EXPECT_TRUE(usablePositions<S>(nullptr, 0));
  for (const S wrong : {beyond, -beyond, this->kInfinity, -this->kInfinity, S(std::nan(""))})
    for (const std::size_t v : {std::size_t(0), std::size_t(500), std::size_t(999)})
      for (int k = 0; k < 3; ++k) {
        const S was = positions[v][k];
        positions[v][k] = wrong;
        EXPECT_FALSE(usablePositions<S>(positions.data(), positions.size())) << v << ' ' << wrong;
        VertexSummary<S> summary;
        for (const auto& p : positions) summary.add(p, p - fcl::Vector3<S>(0, 0, 0));
        EXPECT_FALSE(summary.isSurelyUsable()) << v << ' ' << wrong;
        positions[v][k] = was;
      }
}

/// From an old position that was no number to a good one: the displacement is none.
TYPED_TEST(Summary, KnowsADisplacementThatIsNoNumber) {
  using S = TypeParam;
  for (const S was : {this->kInfinity, S(std::nan(""))}) {
    VertexSummary<S> first, second;
    first.add(fcl::Vector3<S>(1, 2, 3), fcl::Vector3<S>(1 - was, 0, 0));
    second.add(fcl::Vector3<S>(1, 2, 3), fcl::Vector3<S>(1, 0, 0));
    second.add(first);
    EXPECT_FALSE(std::isfinite(second.largestDisplacement()));
    EXPECT_FALSE(second.isSurelyUsable());
    EXPECT_TRUE(second.moved());
  }
}

}  // namespace vertex_summary_test
}  // namespace adaptive_bvh_test
