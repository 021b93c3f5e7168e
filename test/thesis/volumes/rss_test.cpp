// The volume: fits contain their triangles in exact arithmetic, tightly, on any input.
#include "thesis/volumes/volume.h"

#include <gtest/gtest.h>

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/math/bv/utility.h>

#include "support/long_mode.h"
#include "support/meshes.h"

namespace adaptive_bvh_test {
namespace rss_test {

using adaptive_bvh::MeshView;
using adaptive_bvh::Volume;
namespace rounding = adaptive_bvh::rounding;

template <typename S>
struct Points {
  std::vector<fcl::Vector3<S>> vertices;
  std::vector<fcl::Triangle> triangles;
  std::vector<unsigned> order;

  fcl::RSS<S> fit() const {
    MeshView<S> view;
    view.vertices = vertices.data();
    view.triangles = triangles.data();
    return Volume<fcl::RSS<S>>::fit(view, order.data(), int(order.size()));
  }
};

/// Excess of p over the volume in long double, whose rounding is 2,000 times finer than a double's.
template <typename S>
long double excess(const fcl::RSS<S>& bv, const fcl::Vector3<S>& p) {
  using Vector3l = Eigen::Matrix<long double, 3, 1>;
  const Eigen::Matrix<long double, 3, 3> axis = bv.axis.template cast<long double>();
  const Vector3l v = p.template cast<long double>() - bv.To.template cast<long double>();
  const auto clamp = [](long double x, long double high) {
    return std::min(std::max(x, 0.0L), high);
  };
  const long double x = clamp(axis.col(0).dot(v), bv.l[0]);
  const long double y = clamp(axis.col(1).dot(v), bv.l[1]);
  return (v - axis.col(0) * x - axis.col(1) * y).norm() - static_cast<long double>(bv.r);
}

template <typename S>
class RssFit : public testing::Test {
 protected:
  using P = fcl::Vector3<S>;

  S uniform() { return std::uniform_real_distribution<S>(-1, 1)(random_); }
  P point() { return {uniform(), uniform(), uniform()}; }

  /// Triangles of one kind: general, needle, collinear, two or three corners equal, flat, axis
  /// aligned; then scaled, and set off from the origin.
  Points<S> triangles(int kind, int count, S scale, S offset) {
    Points<S> points;
    const P shift = point() * offset;
    const P a = point(), b = point();
    for (int t = 0; t < count; ++t) {
      P p = point(), q = point(), r = point();
      if (kind == 1) r = p + (q - p) * S(0.3) + point() * S(1e-6);
      if (kind == 2) r = p + (q - p) * S(0.3);
      if (kind == 3) r = q;
      if (kind == 4) q = r = p;
      if (kind == 5) p[2] = q[2] = r[2] = S(0.5);
      if (kind == 6) p = a * uniform(), q = a * uniform() + b * uniform(), r = b * uniform();
      for (const P& corner : {p, q, r}) points.vertices.push_back(corner * scale + shift);
      points.triangles.emplace_back(3 * t, 3 * t + 1, 3 * t + 2);
      points.order.push_back(unsigned(t));
    }
    return points;
  }

  std::mt19937 random_{testSeed(11)};
};

using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(RssFit, Scalars);

TYPED_TEST(RssFit, ContainsEveryCornerExactly) {
  using S = TypeParam;
  int corners = 0;
  for (int round = 0; round < 100; ++round)
    for (int kind = 0; kind < 7; ++kind)
      for (int count : {1, 2, 3, 17})
        for (S scale : {S(1e-12), S(1e-3), S(1), S(1e6)})
          for (S offset : {S(0), S(1), S(1e6)}) {
            const Points<S> points = this->triangles(kind, count, scale, offset);
            const fcl::RSS<S> bv = points.fit();
            ASSERT_TRUE(bv.axis.allFinite() && bv.To.allFinite());
            ASSERT_TRUE(bv.l[0] >= 0 && bv.l[1] >= 0 && bv.r > 0);
            for (const fcl::Vector3<S>& p : points.vertices) {
              ASSERT_LE(excess(bv, p), 0) << "kind " << kind << ", " << count << " triangles";
              ++corners;
            }
          }
  EXPECT_GT(corners, 500000);
}

TYPED_TEST(RssFit, AxesAreOrthonormal) {
  using S = TypeParam;
  for (int round = 0; round < 200; ++round)
    for (int kind = 0; kind < 7; ++kind)
      for (int count : {1, 5}) {
        const fcl::Matrix3<S> axis = this->triangles(kind, count, 1, 1).fit().axis;
        EXPECT_TRUE((axis.transpose() * axis).isIdentity(8 * rounding::epsilon<S>()));
        EXPECT_GT(axis.determinant(), 0);
      }
}

TYPED_TEST(RssFit, RectangleOfATriangleIsTwiceItsArea) {
  using S = TypeParam;
  for (int round = 0; round < 200; ++round) {
    const Points<S> points = this->triangles(0, 1, 1, 0);
    const auto& v = points.vertices;
    const S twice_area = (v[1] - v[0]).cross(v[2] - v[0]).norm();
    const fcl::RSS<S> bv = points.fit();
    EXPECT_NEAR(twice_area, bv.l[0] * bv.l[1], 16 * rounding::epsilon<S>());
    EXPECT_LE(bv.r, 100 * rounding::epsilon<S>());
  }
}

/// FCL's own fit is the yardstick: ours may not be looser on average, nor much in any case.
template <typename S>
double sweptArea(const fcl::RSS<S>& bv) {
  const double a = bv.l[0], b = bv.l[1], r = bv.r;
  return 2 * a * b + 2 * M_PI * r * (a + b) + 4 * M_PI * r * r;
}

// Boxes, planes, needles, squares: the surface is never much above that of FCL's fit, and in the
// mean a good deal below.
TYPED_TEST(RssFit, IsTighterThanFcls) {
  using S = TypeParam;
  double ours = 0, fcls = 0;
  for (int round = 0; round < 600; ++round) {
    const int kinds[] = {0, 5, 6, 1};
    Points<S> points = this->triangles(kinds[round % 4], 2 + round % 17, 1, 1);
    fcl::detail::BVFitter<fcl::RSS<S>> fitter;
    fitter.set(points.vertices.data(), points.triangles.data(), fcl::BVH_MODEL_TRIANGLES);
    const fcl::RSS<S> reference = fitter.fit(points.order.data(), int(points.order.size()));
    const double area = sweptArea(points.fit()), reference_area = sweptArea(reference);
    EXPECT_LE(area, 1.25 * reference_area);
    ours += area;
    fcls += reference_area;
  }
  EXPECT_LE(ours, 0.95 * fcls);
}

// Principal axes do not determine the orientation of a square.
TYPED_TEST(RssFit, LiesAlongTheSidesOfASquare) {
  using S = TypeParam;
  for (int round = 0; round < 50; ++round) {
    const auto pose = randomPose(this->random_, 2);
    Points<S> points;
    for (const auto& p : plate(1, 1).vertices)
      points.vertices.push_back((pose * p).template cast<S>());
    points.triangles = plate(1, 1).triangles;
    points.order = {0, 1};
    EXPECT_NEAR(2, sweptArea(points.fit()), 2000 * rounding::epsilon<S>());
  }
}

// Over a dome a larger sphere lets the rectangle end within the rim: PQP's has twice the surface.
TYPED_TEST(RssFit, ChoosesTheSphereForADome) {
  using S = TypeParam;
  const TriangleMesh mesh = dome(24, 12);
  Points<S> points{pointsIn<S>(mesh.vertices), mesh.triangles, {}};
  for (unsigned t = 0; t < mesh.triangles.size(); ++t) points.order.push_back(t);
  fcl::detail::BVFitter<fcl::RSS<S>> fitter;
  fitter.set(points.vertices.data(), points.triangles.data(), fcl::BVH_MODEL_TRIANGLES);
  const fcl::RSS<S> reference = fitter.fit(points.order.data(), int(points.order.size()));
  EXPECT_LT(sweptArea(points.fit()), 0.6 * sweptArea(reference));
}

TYPED_TEST(RssFit, HoldsBothFramesOfATwoFrameUpdate) {
  using S = TypeParam;
  for (int round = 0; round < 200; ++round) {
    const Points<S> now = this->triangles(0, 1 + round % 3, 1, 1);
    const Points<S> before = this->triangles(0, 1 + round % 3, 1, 1);
    MeshView<S> view;
    view.vertices = now.vertices.data();
    view.previous = before.vertices.data();
    view.triangles = now.triangles.data();
    const auto bv = Volume<fcl::RSS<S>>::fit(view, now.order.data(), int(now.order.size()));
    for (const auto* frame : {&now, &before})
      for (const fcl::Vector3<S>& p : frame->vertices) EXPECT_LE(excess(bv, p), 0);
  }
}

TYPED_TEST(RssFit, RoundingIsOutward) {
  using S = TypeParam;
  std::uniform_real_distribution<S> exponent(-30, 12);
  for (int round = 0; round < 100000; ++round) {
    const S scale = std::pow(S(10), exponent(this->random_));
    const fcl::Vector3<S> v = this->point() * scale;
    const long double exact = v.template cast<long double>().norm();
    ASSERT_GE(static_cast<long double>(rounding::norm(v)), exact);
    const S a = std::abs(this->uniform()), b = std::abs(this->uniform()) * scale;
    ASSERT_GE(static_cast<long double>(rounding::sum(a, b)),
              static_cast<long double>(a) + static_cast<long double>(b));
  }
  EXPECT_EQ(0, rounding::norm<S>(fcl::Vector3<S>::Zero()));
  EXPECT_EQ(S(0.7), rounding::sum<S>(S(0.7), 0));
  const fcl::Vector3<S> denormal(std::numeric_limits<S>::denorm_min(), 0, 0);
  EXPECT_GE(rounding::norm(denormal), denormal[0]) << "a square that underflows still counts";
}

/// A length that never vanishes while the volume has any extent, and scales with it.
TYPED_TEST(RssFit, SizeIsALengthOfTheVolume) {
  using S = TypeParam;
  fcl::RSS<S> bv;
  bv.l[0] = 4;
  bv.l[1] = 2;
  EXPECT_EQ(S(1.5), Volume<fcl::RSS<S>>::size(bv, S(0.5)));
  bv.l[1] = 0;
  EXPECT_EQ(S(4), Volume<fcl::RSS<S>>::size(bv, 0));
  bv.l[0] = 0;
  EXPECT_EQ(S(0), Volume<fcl::RSS<S>>::size(bv, 0));
}

}  // namespace rss_test
}  // namespace adaptive_bvh_test
