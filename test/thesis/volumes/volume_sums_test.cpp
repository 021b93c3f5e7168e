// What Volume says of the extents of a rectangle-swept sphere, and the sums of its coordinates.
#include <gtest/gtest.h>

#include "support/exact_geometry.h"
#include "support/random_geometry.h"
#include "thesis/volumes/volume.h"

namespace adaptive_bvh_test {
namespace volume_sums_test {

using adaptive_bvh::Volume;
using exact::Real;
namespace rounding = adaptive_bvh::rounding;

template <typename S>
class VolumeSums : public testing::Test {
 protected:
  RandomGeometryOf<S> random_{5};
};

using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(VolumeSums, Scalars);

/// What a volume's SweptParallelogram says of its extent along a direction is that of its points;
/// the sums of coordinates bound those of its corner and of all its points.
TYPED_TEST(VolumeSums, BoundAVolumesPoints) {
  using S = TypeParam;
  using V = Volume<fcl::RSS<S>>;
  for (int round = 0; round < 20000; ++round) {
    const S size = this->random_.size(-6, 6);
    fcl::RSS<S> bv = this->random_.volume(size, size * this->random_.size(-2, 2));
    const auto swept = V::parallelogram(bv);
    const fcl::Vector3<S> u = this->random_.direction();
    const exact::Point along = exact::of(u);
    Real farthest = -std::numeric_limits<Real>::max();
    for (const auto& half : exact::rectangle(bv))
      for (const auto& corner : half) {
        farthest = std::max(farthest, along.dot(corner));
        for (int k = 0; k < 3; ++k) {
          const exact::Point outermost = exact::Point::Unit(k) * Real(bv.r);
          ASSERT_LE((corner + outermost).template lpNorm<1>(),
                    Real(V::coordinateSum(bv)) * (1 + 8 * Real(rounding::epsilon<S>())));
        }
      }
    const S extent = u.dot(swept.middle) + std::abs(u.dot(swept.half[0])) +
                     std::abs(u.dot(swept.half[1])) + swept.radius;
    ASSERT_NEAR(double(farthest + Real(bv.r) - Real(extent)), 0,
                16 * double(rounding::epsilon<S>() * V::coordinateSum(bv)));
    ASSERT_EQ(bv.To.template lpNorm<1>() + bv.r + bv.l[0] + bv.l[1], V::cornerSum(bv));
  }
}

}  // namespace volume_sums_test
}  // namespace adaptive_bvh_test
