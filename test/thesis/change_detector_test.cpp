// The change detector: which roots it knows, and that a thread which knows one sees the repair.
#include "thesis/adaptive_tree.h"

#include <gtest/gtest.h>

#include <thread>

#include "support/random_geometry.h"

namespace adaptive_bvh_test {
namespace change_detector_test {

using adaptive_bvh::ChangeDetector;
using adaptive_bvh::Volume;

template <typename S>
class Detector : public testing::Test {
 protected:
  using BV = fcl::RSS<S>;
  using V = Volume<BV>;

  Detector() {
    volume_ = random_.volume(1, 1);
    radius_ = detector_.record(root_, volume_);
  }

  RandomGeometryOf<S> random_{47};
  ChangeDetector<BV> detector_;
  BV volume_, root_;
  S radius_ = 0;
};

using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(Detector, Scalars);

/// The root is the volume recorded, with a radius that is one step larger: never smaller.
TYPED_TEST(Detector, RecordsTheVolumeWithALargerRadius) {
  using S = TypeParam;
  using V = Volume<fcl::RSS<S>>;
  EXPECT_TRUE(this->detector_.matches(this->root_));
  EXPECT_EQ(std::nextafter(this->volume_.r, S(1e9)), this->root_.r);
  EXPECT_EQ(this->radius_, this->root_.r);
  for (int i = 0; i < V::kNumbers - 1; ++i)
    EXPECT_EQ(V::number(this->volume_, i), V::number(this->root_, i)) << i;
  fcl::RSS<S> point = this->volume_;
  point.r = 0;
  EXPECT_EQ(std::numeric_limits<S>::denorm_min(), this->detector_.record(this->root_, point));
}

/// A fit of the same positions, which is what was recorded, is a change: FCL's refit writes that.
TYPED_TEST(Detector, TakesAFitOfTheSamePositionsForAChange) {
  EXPECT_FALSE(this->detector_.matches(this->volume_));
}

/// Any of the numbers changed by one step, up or down, or only in its sign of zero or as a NaN.
TYPED_TEST(Detector, SeesAChangeOfAnyNumber) {
  using S = TypeParam;
  using V = Volume<fcl::RSS<S>>;
  constexpr S kInfinity = std::numeric_limits<S>::infinity();
  V::number(this->volume_, 3) = 0;
  this->detector_.record(this->root_, this->volume_);
  for (int i = 0; i < V::kNumbers; ++i) {
    const S was = V::number(this->root_, i);
    for (const S now :
         {std::nextafter(was, kInfinity), std::nextafter(was, -kInfinity), -was, S(std::nan(""))}) {
      V::number(this->root_, i) = now;
      const bool is_same = std::memcmp(&now, &was, sizeof(S)) == 0;
      EXPECT_EQ(is_same, this->detector_.matches(this->root_)) << i << ' ' << now;
    }
    V::number(this->root_, i) = was;
    EXPECT_TRUE(this->detector_.matches(this->root_)) << "as it was";
  }
}

/// Before the first record, and once invalidated, no root matches.
TYPED_TEST(Detector, MatchesNothingUntilItRecords) {
  ChangeDetector<fcl::RSS<TypeParam>> fresh;
  EXPECT_FALSE(fresh.matches(this->root_));
  EXPECT_FALSE(fresh.matches(fcl::RSS<TypeParam>()));
  this->detector_.invalidate();
  EXPECT_FALSE(this->detector_.matches(this->root_));
  this->detector_.record(this->root_, this->volume_);
  EXPECT_TRUE(this->detector_.matches(this->root_));
}

/// A copy knows the root and forgets by itself.
TYPED_TEST(Detector, CopiesAreTheirOwn) {
  auto copy = this->detector_;
  EXPECT_TRUE(copy.matches(this->root_));
  copy.invalidate();
  EXPECT_TRUE(this->detector_.matches(this->root_));
}

/// A thread that finds the new root to match sees what was repaired before it was recorded.
TYPED_TEST(Detector, AMatchShowsTheRepair) {
  for (int round = 0; round < 100; ++round) {
    ChangeDetector<fcl::RSS<TypeParam>> detector;
    fcl::RSS<TypeParam> root = this->volume_;
    int repaired = 0;
    std::thread reader([&] {
      while (!detector.matches(root)) std::this_thread::yield();
      EXPECT_EQ(1, repaired);
    });
    repaired = 1;
    detector.record(root, this->volume_);
    reader.join();
  }
}

}  // namespace change_detector_test
}  // namespace adaptive_bvh_test
