// Axes in single precision: orthonormal as far as docs/bounds.md, 11 counts on, and turned as they
// say. Against numbers that are finer.
#include "geometry/axes4.h"

#include <gtest/gtest.h>

#include "geometry/packed_rotation.h"
#include "support/exact_geometry.h"
#include "support/random_geometry.h"

namespace adaptive_bvh_test {
namespace axes4_test {

using adaptive_bvh::Axes4;
using adaptive_bvh::axesAlong;
using adaptive_bvh::Float4;
using adaptive_bvh::PackedRotation;
using exact::Matrix;
using exact::Real;
namespace float4 = adaptive_bvh::float4;

constexpr Real kUnitRoundoff = 1.L / (1 << 24);

Float4 float4Of(const Vector3<float>& v) { return Float4{v[0], v[1], v[2], 99}; }
exact::Point pointOf(const Float4& v) { return {Real(v[0]), Real(v[1]), Real(v[2])}; }
Matrix matrixOf(const Axes4& axes) {
  Matrix m;
  m << pointOf(axes.x), pointOf(axes.y), pointOf(axes.z);
  return m;
}
Axes4 axesOf(const fcl::Matrix3f& m) {
  return {float4Of(m.col(0)), float4Of(m.col(1)), float4Of(m.col(2))};
}

/// The spectral norm of M^T M - I.
Real askew(const Axes4& axes) {
  const Matrix m = matrixOf(axes);
  const Eigen::SelfAdjointEigenSolver<Matrix> solver(m.transpose() * m - Matrix::Identity());
  return solver.eigenvalues().cwiseAbs().maxCoeff();
}
/// The angle between two frames, in degrees.
Real angleBetween(const Matrix& a, const Matrix& b) {
  const Real half_sine = (a - b).norm() / std::sqrt(Real(8));  // |A - B|_F = 2 sqrt(2) sin(angle/2)
  return 2 * std::asin(std::min(half_sine, Real(1))) * 180 / Real(M_PI);
}

class Axes : public testing::Test {
 protected:
  /// Two vectors: any, nearly parallel, equal, tiny, huge, 0.
  std::pair<Vector3<float>, Vector3<float>> pair() {
    Vector3<float> a = random_.vectorOfSize(random_.size(-3, 1));
    Vector3<float> b = random_.vectorOfSize(random_.size(-3, 1));
    if (random_.oneIn(2)) b = a * random_.uniform() + random_.vectorOfSize(random_.size(-12, 0));
    if (random_.oneIn(50)) b = a;
    if (random_.oneIn(50)) a.setZero();
    if (random_.oneIn(50)) b.setZero();
    const float scale = random_.oneIn(4) ? random_.size(-17, 8) : 1;
    return {a * scale, b * scale};
  }
  Axes4 anyAxes() {
    const auto [a, b] = pair();
    return axesAlong(float4Of(a), float4Of(b));
  }
  /// Any direction; half and quarter turns about the axes and about diagonals, exactly and nearly.
  fcl::Matrix3f anyRotation() {
    if (random_.oneIn(2)) return randomPose<float>(random_.engine(), 0).linear();
    Vector3<float> about = Vector3<float>::Unit(random_.below(3));
    if (random_.oneIn(2)) about = Vector3<float>(1, float(random_.below(3) - 1), 1).normalized();
    if (random_.oneIn(3)) about = random_.direction();
    float angle = float(M_PI / 2) * float(1 + random_.below(3));
    if (random_.oneIn(2)) angle += random_.size(-7, -1);
    return Eigen::AngleAxisf(angle, about).toRotationMatrix();
  }

  RandomGeometry<float> random_{67};
};

/// Right-handed, the first along a, the third orthogonal to b where that has a direction of its
/// own.
TEST_F(Axes, AlongTwoVectorsAreOrthonormal) {
  for (int round = 0; round < 100000; ++round) {
    const auto [a, b] = pair();
    const Axes4 axes = axesAlong(float4Of(a), float4Of(b));
    ASSERT_LE(askew(axes), 27 * kUnitRoundoff) << a.transpose() << ", " << b.transpose();
    const Matrix m = matrixOf(axes);
    ASSERT_LE((m.transpose() * m - Matrix::Identity()).cwiseAbs().maxCoeff(), 1e-6L);
    ASSERT_GT(m.determinant(), 0.99L);
    if (!(a.norm() > 1e-14f)) continue;
    ASSERT_LE((pointOf(axes.x) - exact::of(a).normalized()).norm(), 8 * kUnitRoundoff);
    if (!(exact::of(a).cross(exact::of(b)).norm() > 1e-14L)) continue;  // no direction of its own
    const Real height = std::abs(pointOf(axes.z).dot(exact::of(b)));
    ASSERT_LE(height, 64 * kUnitRoundoff * exact::of(b).norm());
  }
}

/// Products, unpacked rotations and turned axes are, too.
TEST_F(Axes, StayOrthonormal) {
  for (int round = 0; round < 50000; ++round) {
    const Axes4 frame = anyAxes(), kept = PackedRotation(axesOf(anyRotation())).axes();
    ASSERT_LE(askew(kept), 42 * kUnitRoundoff);
    ASSERT_LE(askew(frame * kept), 87 * kUnitRoundoff);
    const float angle = random_.uniform() * 4;
    ASSERT_LE(askew(frame.turned(std::cos(angle), std::sin(angle))), 42 * kUnitRoundoff);
  }
}

/// A frame's components and what they make are inverse to each other.
TEST_F(Axes, ComponentsAreThoseOfTheFrame) {
  for (int round = 0; round < 20000; ++round) {
    const Axes4 frame = anyAxes(), other = anyAxes();
    const Axes4 components = frame.components(other);
    ASSERT_LE((matrixOf(components) - matrixOf(frame).transpose() * matrixOf(other)).norm(),
              16 * kUnitRoundoff);
    ASSERT_LE((matrixOf(frame * components) - matrixOf(other)).norm(), 64 * kUnitRoundoff);
    const Vector3<float> v = random_.point();
    ASSERT_LE((pointOf(frame.combine(v[0], v[1], v[2])) - matrixOf(frame) * exact::of(v)).norm(),
              8 * kUnitRoundoff);
  }
}

/// A rotation in four bytes is off by less than 0.3 degrees, and takes no more.
TEST_F(Axes, PackedRotationsAreClose) {
  static_assert(sizeof(PackedRotation) == 4, "four bytes");
  Real worst = 0;
  for (int round = 0; round < 200000; ++round) {
    const fcl::Matrix3f rotation = anyRotation();
    const Real off =
        angleBetween(matrixOf(PackedRotation(axesOf(rotation)).axes()), exact::of(rotation));
    ASSERT_LT(off, 0.3L) << rotation;
    worst = std::max(worst, off);
  }
  EXPECT_GT(worst, 0.1L) << "ten bits are not more exact";
  EXPECT_LT(angleBetween(matrixOf(PackedRotation().axes()), Matrix::Identity()), 0.3L);
}

/// What is packed is packed alike again: kept axes do not drift.
TEST_F(Axes, PackedRotationsStayAsTheyArePacked) {
  for (int round = 0; round < 20000; ++round) {
    const PackedRotation packed(axesOf(anyRotation()));
    const Real off =
        angleBetween(matrixOf(PackedRotation(packed.axes()).axes()), matrixOf(packed.axes()));
    ASSERT_LT(off, 0.3L);
  }
}

TEST_F(Axes, CrossProductsAndColumns) {
  for (int round = 0; round < 20000; ++round) {
    Vector3<float> v[4];
    for (auto& x : v) x = random_.point() * random_.size(-6, 6);
    const Float4 product = float4::cross(float4Of(v[0]), float4Of(v[1]));
    const exact::Point expected = exact::of(v[0]).cross(exact::of(v[1]));
    ASSERT_LE((pointOf(product) - expected).norm(),
              3 * kUnitRoundoff * exact::of(v[0]).norm() * exact::of(v[1]).norm());
    const float4::Columns columns =
        float4::columns(float4Of(v[0]), float4Of(v[1]), float4Of(v[2]), float4Of(v[3]));
    const Float4 sums =
        float4::sums(float4Of(v[0]), float4Of(v[1]), float4Of(v[2]), float4Of(v[3]));
    for (int k = 0; k < 4; ++k) {
      ASSERT_EQ(v[k][0], columns.x[k]);
      ASSERT_EQ(v[k][1], columns.y[k]);
      ASSERT_EQ(v[k][2], columns.z[k]);
      ASSERT_EQ(v[k][0] + v[k][1] + v[k][2], sums[k]);
    }
  }
}

}  // namespace axes4_test
}  // namespace adaptive_bvh_test
