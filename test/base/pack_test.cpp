// Four (or two) numbers at once, lane by lane against one number at a time; and boxes of them.
#include "base/pack.h"

#include <gtest/gtest.h>

#include <vector>

#include "base/box.h"
#include "support/random_geometry.h"

namespace adaptive_bvh_test {
namespace pack_test {

using adaptive_bvh::Box;
using adaptive_bvh::Float4;
using adaptive_bvh::Pack;
namespace float4 = adaptive_bvh::float4;
namespace packs = adaptive_bvh::packs;

template <typename S>
class Packs : public testing::Test {
 protected:
  static constexpr std::size_t kSize = packs::kSize<S>;

  std::vector<S> numbers() {
    std::vector<S> v;
    for (std::size_t i = 0; i < kSize; ++i)
      v.push_back(random_.oneIn(6) ? S(0) : random_.uniform() * random_.size(-6, 6));
    return v;
  }

  RandomGeometryOf<S> random_{53};
};

using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(Packs, Scalars);

/// Every operation does with each lane what it would do with one number, to the last digit; also
/// where the optimiser's instructions differ.
TYPED_TEST(Packs, WorkLaneByLane) {
  using S = TypeParam;
  for (int round = 0; round < 5000; ++round) {
    const std::vector<S> x = this->numbers(), y = this->numbers();
    const Pack<S> a = packs::load(x.data()), b = packs::load(y.data());
    const Pack<S> lower = packs::lower(a, b), upper = packs::upper(a, b), sum = a + b,
                  product = a * b;
    const Pack<S> root = packs::squareRoot(packs::upper(a, Pack<S>{}));
    for (std::size_t i = 0; i < this->kSize; ++i) {
      ASSERT_EQ(x[i], a[i]);
      ASSERT_EQ(std::min(x[i], y[i]), lower[i]);
      ASSERT_EQ(std::max(x[i], y[i]), upper[i]);
      ASSERT_EQ(S(x[i] + y[i]), sum[i]);
      ASSERT_EQ(S(x[i] * y[i]), product[i]);
      ASSERT_EQ(std::sqrt(std::max(x[i], S(0))), root[i]);
      ASSERT_EQ(x[0], packs::all(x[0])[i]);
    }
    ASSERT_EQ(*std::min_element(x.begin(), x.end()), packs::smallest(a));
    ASSERT_EQ(*std::max_element(x.begin(), x.end()), packs::largest(a));
  }
}

/// The sum takes lanes in pairs: of whole numbers it is exact.
TYPED_TEST(Packs, SumOfAllLanes) {
  using S = TypeParam;
  std::vector<S> x;
  S expected = 0;
  for (std::size_t i = 0; i < this->kSize; ++i) {
    x.push_back(S(1 << (3 * i)));
    expected += x.back();
  }
  EXPECT_EQ(expected, packs::sum(packs::load(x.data())));
}

/// A comparison holds for any when it holds for one, whichever lane that is.
TYPED_TEST(Packs, AnyFindsOneLane) {
  using S = TypeParam;
  const Pack<S> zero{};
  EXPECT_FALSE(packs::any(zero > packs::all(S(0))));
  EXPECT_TRUE(packs::any(zero == packs::all(S(0))));
  for (std::size_t i = 0; i < this->kSize; ++i) {
    Pack<S> one{};
    one[i] = 1;
    EXPECT_TRUE(packs::any(one > zero)) << i;
    EXPECT_FALSE(packs::any(one < zero)) << i;
  }
}

/// From and to any address; nothing beside the sixteen bytes is written.
TYPED_TEST(Packs, LoadAndStoreAnywhere) {
  using S = TypeParam;
  constexpr std::size_t kSize = packs::kSize<S>;
  S numbers[2 * kSize + 2];
  for (std::size_t i = 0; i < 2 * kSize + 2; ++i) numbers[i] = S(i);
  for (std::size_t at = 0; at < kSize; ++at) {
    const Pack<S> v = packs::load(numbers + at);
    S stored[2 * kSize + 2] = {};
    packs::store<S>(v, stored + at + 1);
    for (std::size_t i = 0; i < 2 * kSize + 2; ++i)
      EXPECT_EQ(i > at && i <= at + kSize ? S(i - 1) : S(0), stored[i]) << at << ' ' << i;
  }
}

/// Three lanes mean x, y, z; whatever stands in the fourth changes no result.
TEST(Float4s, TheFourthLaneMeansNothing) {
  for (const float fourth : {0.f, 1e30f, -1e30f, 1.f}) {
    const Float4 v{1, -5, 3, fourth}, w{2, 0, -7, -fourth};
    EXPECT_EQ(-1, float4::sum(v));
    EXPECT_EQ(3, float4::largest(v));
    EXPECT_EQ(5, float4::largest(float4::absolute(v)));
    EXPECT_EQ(-5, float4::broadcast<1>(v)[3]);
    const Float4 sums = float4::sums(v, w, -v, w + w);
    const float expected[] = {-1, -5, 1, -10};
    for (int k = 0; k < 4; ++k) EXPECT_EQ(expected[k], sums[k]) << k;
    Box box{v, v};
    box.add(w);
    EXPECT_EQ(7, box.largestCoordinate());
  }
}

/// The box around points holds them and no more; its middle and half sides are those of its
/// corners.
TEST(Boxes, AreTheLeastAroundTheirPoints) {
  RandomGeometryOf<float> random(59);
  for (int round = 0; round < 500; ++round) {
    const fcl::Vector3<float> first = random.point();
    Box box{{first[0], first[1], first[2], 0}, {first[0], first[1], first[2], 0}};
    fcl::Vector3<float> low = first, high = first;
    for (int i = 0; i < 6; ++i) {
      const fcl::Vector3<float> p = random.point() * random.size(-3, 3);
      const fcl::Vector3<float> q = i % 2 ? p : fcl::Vector3<float>(p + random.point().cwiseAbs());
      const Float4 from{p[0], p[1], p[2], random.uniform()}, to{q[0], q[1], q[2], 0};
      if (i % 2)
        box.add(from);
      else
        box.add(Box{from, to});
      low = low.cwiseMin(p);
      high = high.cwiseMax(q);
    }
    for (int k = 0; k < 3; ++k) {
      ASSERT_EQ(low[k], box.low[k]);
      ASSERT_EQ(high[k], box.high[k]);
      ASSERT_EQ((low[k] + high[k]) / 2, box.center()[k]);
      ASSERT_EQ((high[k] - low[k]) / 2, box.halfSides()[k]);
    }
    ASSERT_EQ(std::max(low.cwiseAbs().maxCoeff(), high.cwiseAbs().maxCoeff()),
              box.largestCoordinate());
  }
}

}  // namespace pack_test
}  // namespace adaptive_bvh_test
