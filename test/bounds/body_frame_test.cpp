// BodyFrame: what is lost on the way to body coordinates and back; and the extents and sums of
// volumes.
#include "geometry/body_frame.h"

#include <gtest/gtest.h>

#include "support/exact_geometry.h"
#include "support/random_geometry.h"
#include "volume/volume.h"

namespace adaptive_bvh_test {
namespace body_frame_test {

using adaptive_bvh::BodyFrame;
using adaptive_bvh::Float4;
using adaptive_bvh::Volume;
using exact::Real;
namespace float4 = adaptive_bvh::float4;
namespace rounding = adaptive_bvh::rounding;

constexpr Real kUnitRoundoff = 1.L / (1 << 24);

template <typename S>
class BodyFrameTest : public testing::Test {
 protected:
  using P = Vector3<S>;

  /// The frame of a body of a size, anywhere; its axes are off by rounding, as a volume's are.
  BodyFrame<S> frame(S size) {
    const fcl::Matrix3d axes = random_.rotation().template cast<double>();
    return BodyFrame<S>(axes, random_.point() * (random_.oneIn(2) ? size : 1000 * size), size);
  }

  static exact::Point exactly(const BodyFrame<S>& frame, const P& x) {
    const exact::Point v = exact::of(x) - exact::of(frame.origin());
    return exact::of(frame.axes()).transpose() * v * Real(frame.scale());
  }
  static exact::Point back(const BodyFrame<S>& frame, const exact::Point& y) {
    return exact::of(frame.origin()) + exact::of(frame.axes()) * y * Real(frame.unit());
  }

  RandomGeometry<S> random_{5};
};

exact::Point pointOf(const Float4& v) { return {Real(v[0]), Real(v[1]), Real(v[2])}; }

using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(BodyFrameTest, Scalars);

/// The scale is a power of two that makes the body's size 1 to 2: products with it are exact.
TYPED_TEST(BodyFrameTest, ScaleIsAPowerOfTwo) {
  using S = TypeParam;
  for (int round = 0; round < 2000; ++round) {
    const S size = this->random_.size(-6, 6);
    const BodyFrame<S> frame = this->frame(size);
    int exponent;
    EXPECT_EQ(S(0.5), std::frexp(frame.scale(), &exponent));
    EXPECT_EQ(S(1), frame.scale() * frame.unit());
    EXPECT_GE(size * frame.scale(), 1);
    EXPECT_LT(size * frame.scale(), 2);
  }
  EXPECT_EQ(S(1), BodyFrame<S>(fcl::Matrix3d::Identity(), Vector3<S>::Zero(), 0).scale());
  for (const S size : {std::numeric_limits<S>::denorm_min(), std::numeric_limits<S>::max()}) {
    const BodyFrame<S> frame(fcl::Matrix3d::Identity(), Vector3<S>::Zero(), size);
    EXPECT_TRUE(std::isnormal(frame.scale()) && std::isnormal(frame.unit())) << size;
  }
}

/// Axes that are off by the rounding of float are orthonormal in double afterwards.
TYPED_TEST(BodyFrameTest, AxesAreMadeOrthonormal) {
  for (int round = 0; round < 1000; ++round) {
    const fcl::Matrix3d axes = this->frame(1).axes();
    ASSERT_TRUE((axes.transpose() * axes).isIdentity(1e-15)) << axes;
  }
}

/// A point in body coordinates is off by less than 20 u of its largest component, and kError is
/// more than that.
TYPED_TEST(BodyFrameTest, PointsAreOffByLessThanTheErrorStated) {
  using S = TypeParam;
  EXPECT_GT(Real(BodyFrame<S>::kError), 20 * kUnitRoundoff);
  Real worst = 0;
  for (int round = 0; round < 200000; ++round) {
    const S size = this->random_.size(-6, 6);
    const BodyFrame<S> frame = this->frame(size);
    const Vector3<S> x =
        frame.origin() + this->random_.vectorOfSize(size * this->random_.size(-3, 3));
    const exact::Point y = this->exactly(frame, x);
    const Real error = (pointOf(frame.toBodyFrame(x)) - y).cwiseAbs().maxCoeff();
    const Real largest = y.cwiseAbs().maxCoeff();
    ASSERT_LE(error, 20 * kUnitRoundoff * largest) << round;
    if (largest > 0) worst = std::max(worst, error / largest);
  }
  EXPECT_GT(worst, 2 * kUnitRoundoff) << "rotated points must be among them";
}

/// Turned and moved frames place points as new ones do.
TYPED_TEST(BodyFrameTest, FollowsTurnsAndMoves) {
  using S = TypeParam;
  for (int round = 0; round < 1000; ++round) {
    BodyFrame<S> frame = this->frame(1);
    frame.turn(this->random_.rotation().template cast<double>());
    frame.moveOrigin(this->random_.point());
    const Vector3<S> x = this->random_.point();
    const exact::Point y = this->exactly(frame, x);
    ASSERT_LE((pointOf(frame.toBodyFrame(x)) - y).norm(), Real(BodyFrame<S>::kError) * 4);
  }
}

/// The way back is rounded by a few epsilon of what it is a sum of.
TYPED_TEST(BodyFrameTest, ComesBack) {
  using S = TypeParam;
  for (int round = 0; round < 50000; ++round) {
    const S size = this->random_.size(-6, 6);
    const BodyFrame<S> frame = this->frame(size);
    const Vector3<S> y = this->random_.point() * 2;
    const Float4 stored{float(y[0]), float(y[1]), float(y[2]), 0};
    const exact::Point x = this->back(frame, pointOf(stored));
    const Real largest = exact::of(frame.origin()).template lpNorm<1>() + 4 * Real(frame.unit());
    ASSERT_LE((exact::of(frame.fromBodyFrame(stored)) - x).norm(),
              4 * Real(rounding::epsilon<S>()) * largest);
  }
}

/// What a volume's SweptParallelogram says of its extent along a direction is that of its points;
/// the sums of coordinates bound those of its corner and of all its points.
TYPED_TEST(BodyFrameTest, ExtentsAndSumsBoundAVolumesPoints) {
  using S = TypeParam;
  using V = Volume<fcl::RSS<S>>;
  for (int round = 0; round < 20000; ++round) {
    const S size = this->random_.size(-6, 6);
    fcl::RSS<S> bv = this->random_.volume(size, size * this->random_.size(-2, 2));
    const auto swept = V::parallelogram(bv);
    const Vector3<S> u = this->random_.direction();
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

}  // namespace body_frame_test
}  // namespace adaptive_bvh_test
