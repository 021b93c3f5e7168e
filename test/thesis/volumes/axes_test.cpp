// Axes in single precision: orthonormal as far as docs/bounds.md, 11 counts on, and turned as they
// say. Against numbers that are finer.
#include "thesis/volumes/kept_axes.h"

#include <gtest/gtest.h>

#include "support/exact_geometry.h"
#include "support/random_geometry.h"

namespace adaptive_bvh_test {
namespace axes_test {

using adaptive_bvh::axesAlong;
using adaptive_bvh::Float4;
using adaptive_bvh::PackedRotation;
using adaptive_bvh::rotations;
using Axes4 = adaptive_bvh::Axes<Float4>;
using Vectors4 = adaptive_bvh::Vectors<Float4>;
using exact::Matrix;
using exact::Real;
namespace float4 = adaptive_bvh::float4;
namespace vectors = adaptive_bvh::vectors;

constexpr Real kUnitRoundoff = 1.L / (1 << 24);

Float4 float4Of(const fcl::Vector3<float>& v) { return Float4{v[0], v[1], v[2], 99}; }
exact::Point pointOf(const Float4& v) { return {Real(v[0]), Real(v[1]), Real(v[2])}; }
exact::Point pointOf(const Vectors4& v, int lane) {
  return {Real(v.x[lane]), Real(v.y[lane]), Real(v.z[lane])};
}
Matrix matrixOf(const Axes4& axes, int lane = 0) {
  Matrix m;
  m << pointOf(axes.x, lane), pointOf(axes.y, lane), pointOf(axes.z, lane);
  return m;
}
/// As it is packed and unpacked, beside three others.
Axes4 packedAndUnpacked(const fcl::Matrix3f& m) {
  const auto column = [&](int k, float(&to)[3]) {
    for (int i = 0; i < 3; ++i) to[i] = m(i, k);
  };
  float x[3], y[3], z[3];
  column(0, x);
  column(1, y);
  column(2, z);
  const Float4 q = PackedRotation(x, y, z).quaternion(), other = PackedRotation().quaternion();
  const float4::Rows rows = float4::transposed(q, other, other, other);
  return rotations<Float4>(rows.x, rows.y, rows.z, rows.w);
}
fcl::Matrix3f floatOf(const Matrix& m) { return m.cast<float>(); }

/// The spectral norm of M^T M - I.
Real askew(const Axes4& axes, int lane = 0) {
  const Matrix m = matrixOf(axes, lane);
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
  std::pair<fcl::Vector3<float>, fcl::Vector3<float>> pair() {
    fcl::Vector3<float> a = random_.vectorOfSize(random_.size(-3, 1));
    fcl::Vector3<float> b = random_.vectorOfSize(random_.size(-3, 1));
    if (random_.oneIn(2)) b = a * random_.uniform() + random_.vectorOfSize(random_.size(-12, 0));
    if (random_.oneIn(50)) b = a;
    if (random_.oneIn(50)) a.setZero();
    if (random_.oneIn(50)) b.setZero();
    const float scale = random_.oneIn(4) ? random_.size(-17, 8) : 1;
    return {a * scale, b * scale};
  }
  Axes4 anyAxes() {
    const auto [a, b] = pair();
    return axesAlong(vectors::all(a), vectors::all(b));
  }
  /// Any direction; half and quarter turns about the axes and about diagonals, exactly and nearly.
  fcl::Matrix3f anyRotation() {
    if (random_.oneIn(2)) return randomPose(random_.engine(), 0).linear().cast<float>();
    fcl::Vector3<float> about = fcl::Vector3<float>::Unit(random_.below(3));
    if (random_.oneIn(2))
      about = fcl::Vector3<float>(1, float(random_.below(3) - 1), 1).normalized();
    if (random_.oneIn(3)) about = random_.direction();
    float angle = float(M_PI / 2) * float(1 + random_.below(3));
    if (random_.oneIn(2)) angle += random_.size(-7, -1);
    return Eigen::AngleAxisf(angle, about).toRotationMatrix();
  }

  RandomGeometryOf<float> random_{67};
};

/// Right-handed, the first along a, the third orthogonal to b where that has a direction of its
/// own. Each lane for itself.
TEST_F(Axes, AlongTwoVectorsAreOrthonormal) {
  for (int round = 0; round < 30000; ++round) {
    fcl::Vector3<float> a[4], b[4];
    for (int i = 0; i < 4; ++i) std::tie(a[i], b[i]) = pair();
    const auto lanes = [](const fcl::Vector3<float>(&v)[4]) -> Vectors4 {
      return float4::columns(float4Of(v[0]), float4Of(v[1]), float4Of(v[2]), float4Of(v[3]));
    };
    const Axes4 axes = axesAlong(lanes(a), lanes(b));
    for (int i = 0; i < 4; ++i) {
      ASSERT_LE(askew(axes, i), 27 * kUnitRoundoff) << a[i].transpose() << ", " << b[i].transpose();
      const Matrix m = matrixOf(axes, i);
      ASSERT_LE((m.transpose() * m - Matrix::Identity()).cwiseAbs().maxCoeff(), 1e-6L);
      ASSERT_GT(m.determinant(), 0.99L);
      if (!(a[i].norm() > 1e-14f)) continue;
      ASSERT_LE((m.col(0) - exact::of(a[i]).normalized()).norm(), 8 * kUnitRoundoff);
      // Whether it has a direction of its own.
      if (!(exact::of(a[i]).cross(exact::of(b[i])).norm() > 1e-14L)) continue;
      ASSERT_LE(std::abs(m.col(2).dot(exact::of(b[i]))),
                64 * kUnitRoundoff * exact::of(b[i]).norm());
    }
  }
}

/// Products, unpacked rotations and turned axes are, too.
TEST_F(Axes, StayOrthonormal) {
  for (int round = 0; round < 50000; ++round) {
    const Axes4 frame = anyAxes(), kept = packedAndUnpacked(anyRotation());
    ASSERT_LE(askew(kept), 50 * kUnitRoundoff);
    ASSERT_LE(askew(frame * kept), 95 * kUnitRoundoff);
    const float angle = random_.uniform() * 4;
    ASSERT_LE(askew(frame.turned(float4::all(std::cos(angle)), float4::all(std::sin(angle)))),
              42 * kUnitRoundoff);
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
    const fcl::Vector3<float> v = random_.point();
    const Vectors4 combined =
        frame.combine(float4::all(v[0]), float4::all(v[1]), float4::all(v[2]));
    ASSERT_LE((pointOf(combined, 0) - matrixOf(frame) * exact::of(v)).norm(), 8 * kUnitRoundoff);
  }
}

/// A rotation in eight bytes is off by less than 0.01 degrees, and takes no more.
TEST_F(Axes, PackedRotationsAreClose) {
  static_assert(sizeof(PackedRotation) == 8, "eight bytes");
  Real worst = 0;
  for (int round = 0; round < 200000; ++round) {
    const fcl::Matrix3f rotation = anyRotation();
    const Real off = angleBetween(matrixOf(packedAndUnpacked(rotation)), exact::of(rotation));
    ASSERT_LT(off, 0.01L) << rotation;
    worst = std::max(worst, off);
  }
  EXPECT_GT(worst, 0.001L) << "sixteen bits are not more exact";
  EXPECT_EQ(fcl::Matrix3f::Identity(),
            floatOf(matrixOf(packedAndUnpacked(fcl::Matrix3f::Identity()))));
}

/// What is packed is packed alike again: kept axes do not drift.
TEST_F(Axes, PackedRotationsStayAsTheyArePacked) {
  for (int round = 0; round < 20000; ++round) {
    const Matrix once = matrixOf(packedAndUnpacked(anyRotation()));
    ASSERT_LT(angleBetween(matrixOf(packedAndUnpacked(floatOf(once))), once), 0.01L);
  }
}

TEST_F(Axes, CrossProductsAndColumns) {
  for (int round = 0; round < 20000; ++round) {
    fcl::Vector3<float> v[4];
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

}  // namespace axes_test
}  // namespace adaptive_bvh_test
