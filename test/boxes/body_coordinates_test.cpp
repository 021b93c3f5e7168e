// BodyCoordinates: their scale and axes.
#include "boxes/wide_tree.h"

#include <gtest/gtest.h>

#include "support/random_geometry.h"

namespace adaptive_bvh_test {
namespace body_coordinates_test {

using adaptive_bvh::BodyCoordinates;
using fcl::Matrix3d;
using fcl::Vector3d;

/// The scale is a power of two that brings the length to between 1 and 2: products with it are
/// exact. So it is for lengths of any size; a body without one keeps its unit.
TEST(BodyCoordinates, ScaleIsAPowerOfTwo) {
  RandomGeometry random(5);
  for (int round = 0; round < 2000; ++round) {
    const double length = random.size(-200, 70);
    const auto of = BodyCoordinates::about(random.point(), Matrix3d::Identity(), length);
    int exponent;
    EXPECT_EQ(0.5, std::frexp(of.scale, &exponent));
    EXPECT_GE(length * of.scale, 1);
    EXPECT_LT(length * of.scale, 2);
  }
  const auto scaleFor = [](double length) {
    return BodyCoordinates::about(Vector3d::Zero(), Matrix3d::Identity(), length).scale;
  };
  EXPECT_EQ(1, scaleFor(0));
  for (const double length :
       {std::numeric_limits<double>::denorm_min(), std::numeric_limits<double>::max()})
    EXPECT_TRUE(std::isnormal(scaleFor(length)) && std::isnormal(1 / scaleFor(length))) << length;
}

/// Axes that are off by the rounding of float are orthonormal in double afterwards, and near what
/// they were.
TEST(BodyCoordinates, AxesAreMadeOrthonormal) {
  RandomGeometry random(5);
  for (int round = 0; round < 1000; ++round) {
    const Matrix3d given = random.rotation().cast<double>();
    const Matrix3d axes = BodyCoordinates::about(Vector3d(1, 2, 3), given, 5).axes();
    ASSERT_TRUE((axes.transpose() * axes).isIdentity(1e-15)) << axes;
    ASSERT_LE((axes - given).norm(), 1e-6);
  }
}

}  // namespace body_coordinates_test
}  // namespace adaptive_bvh_test
