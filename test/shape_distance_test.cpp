// The distance of a mesh to a sphere, a capsule and a box is that of their geometry: against every
// triangle in quadruple precision, on lattices and in any pose.
#include <gtest/gtest.h>

#include <functional>

#include "adaptive_bvh/query.h"
#include "support/degenerate_triangles.h"
#include "support/long_mode.h"
#include "support/quad_geometry.h"
#include "support/test_volume.h"

namespace adaptive_bvh_test {
namespace shape_distance_test {

using Triangle = DegenerateTriangles::Triangle;

/// Of a triangle in the frame of a shape; 0 where they touch.
using Judge = std::function<quad::Real(const quad::Triangle&)>;

Judge sphereJudge(double radius) {
  return [=](const quad::Triangle& t) {
    return std::max(quad::Real(0), quad::distance(quad::Point{0, 0, 0}, t) - radius);
  };
}
Judge capsuleJudge(double radius, double length) {
  return [=](const quad::Triangle& t) {
    const quad::Real end = quad::Real(length) / 2;
    const quad::Triangle segment = {quad::Point{0, 0, end}, {0, 0, -end}, {0, 0, -end}};
    return std::max(quad::Real(0), quad::distance(t, segment) - radius);
  };
}
Judge boxJudge(const Eigen::Vector3d& side) {
  return [=](const quad::Triangle& t) {
    const quad::Real h[3] = {quad::Real(side[0]) / 2, quad::Real(side[1]) / 2,
                             quad::Real(side[2]) / 2};
    for (const quad::Point& x : t)
      if (quad::absolute(x.x) <= h[0] && quad::absolute(x.y) <= h[1] && quad::absolute(x.z) <= h[2])
        return quad::Real(0);
    const auto corner = [&](int i) {
      return quad::Point{i & 1 ? h[0] : -h[0], i & 2 ? h[1] : -h[1], i & 4 ? h[2] : -h[2]};
    };
    const int faces[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                              {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    quad::Real least = 1e30;
    for (const auto& f : faces)
      least = std::min(least, quad::distance(t, {corner(f[0]), corner(f[1]), corner(f[2])}));
    return least;
  };
}

template <typename S>
class ShapeDistance : public testing::Test {
 protected:
  using Model = adaptive_bvh::AdaptiveBVHModel<TestVolume<S>>;

  /// On the lattice half of the time.
  fcl::Transform3<S> pose() {
    fcl::Transform3<S> tf = fcl::Transform3<S>::Identity();
    if (random().oneIn(2)) return random().pose(4).template cast<S>();
    tf.linear() =
        Eigen::AngleAxis<S>(S(M_PI / 2) * S(random().below(4)), Vector3<S>::Unit(random().below(3)))
            .toRotationMatrix()
            .array()
            .round();
    tf.translation() =
        Vector3<S>(S(random().below(11) - 5), S(random().below(11) - 5), S(random().below(11) - 5));
    return tf;
  }
  RandomGeometry<double>& random() { return triangles_.random(); }
  double size() { return random().oneIn(2) ? 1 + random().below(3) : random().uniform(0.1, 3); }

  /// Of a mesh of a few triangles at the identity.
  void check(const fcl::CollisionGeometry<S>& shape, const Judge& judge, double extent) {
    TriangleMesh<S> mesh;
    const int count = 1 + random().below(4);
    for (int i = 0; i < count; ++i) {
      const Triangle t = random().oneIn(2) ? triangles_.alongAxes() : triangles_.onLattice();
      for (const auto& p : t) mesh.vertices.push_back(p.template cast<S>());
      mesh.triangles.emplace_back(std::size_t(3 * i), std::size_t(3 * i + 1),
                                  std::size_t(3 * i + 2));
    }
    Model model;
    fillModel(mesh, model);
    const fcl::Transform3<S> tf = pose();
    const Eigen::Matrix3d R = tf.linear().template cast<double>();
    const Eigen::Vector3d T = tf.translation().template cast<double>();
    quad::Real least = 1e30;
    for (const fcl::Triangle& t : mesh.triangles) {
      quad::Triangle in_shape;
      for (std::size_t k = 0; k < 3; ++k) {
        const Eigen::Vector3d x = mesh.vertices[t[int(k)]].template cast<double>() - T;
        // In quadruple precision, by the rotation as it is given.
        const quad::Point p = quad::of(x);
        const auto row = [&](int i) {
          return quad::Real(R(0, i)) * p.x + quad::Real(R(1, i)) * p.y + quad::Real(R(2, i)) * p.z;
        };
        in_shape[k] = {row(0), row(1), row(2)};
      }
      least = std::min(least, judge(in_shape));
    }
    const auto expected = static_cast<double>(least);
    const double tolerance = 256 * double(std::numeric_limits<S>::epsilon()) * (extent + T.norm());
    const fcl::Transform3<S> still = fcl::Transform3<S>::Identity();
    fcl::DistanceResult<S> result;
    const S found =
        adaptive_bvh::distance<S>(&model, still, &shape, tf, fcl::DistanceRequest<S>(true), result);
    ASSERT_EQ(found, result.min_distance);
    if (found > 0) {
      ASSERT_NEAR(expected, double(found), tolerance);
      ASSERT_NEAR(double(found),
                  double((result.nearest_points[0] - result.nearest_points[1]).norm()), tolerance);
    } else {
      ASSERT_EQ(-1, found);
      ASSERT_LE(expected, tolerance);
    }
    touching_ += found < 0;
    ++all_;
  }

  DegenerateTriangles triangles_{88};
  int touching_ = 0, all_ = 0;
};

TYPED_TEST_SUITE(ShapeDistance, TestScalars);

TYPED_TEST(ShapeDistance, OfASphereACapsuleAndABox) {
  using S = TypeParam;
  for (int round = 0; round < manySteps(500) && !testing::Test::HasFailure(); ++round) {
    const auto radius = double(S(this->size())), length = double(S(this->size()));
    this->check(fcl::Sphere<S>(S(radius)), sphereJudge(radius), 10);
    this->check(fcl::Capsule<S>(S(radius), S(length)), capsuleJudge(radius, length), 10);
    const Vector3<S> side(S(this->size()), S(this->size()), S(this->size()));
    this->check(fcl::Box<S>(side), boxJudge(side.template cast<double>()), 10);
  }
  EXPECT_GT(this->touching_, this->all_ / 20);
  EXPECT_LT(this->touching_, this->all_ * 4 / 5);
}

/// FCL's solver ends 12.5 % too far away here.
TYPED_TEST(ShapeDistance, OfABoxWhereGjkFails) {
  using S = TypeParam;
  TriangleMesh<S> mesh;
  mesh.vertices = {{1, -1, -1}, {1, -1, 0}, {0, 0, 1}};
  mesh.triangles = {{0, 1, 2}};
  typename TestFixture::Model model;
  fillModel(mesh, model);
  const fcl::Box<S> box(3, 2, 2);
  fcl::Transform3<S> tf = fcl::Transform3<S>::Identity();
  tf.translation() = Vector3<S>(0, 4, -1);
  fcl::DistanceResult<S> result;
  adaptive_bvh::distance<S>(&model, fcl::Transform3<S>::Identity(), &box, tf,
                            fcl::DistanceRequest<S>(), result);
  EXPECT_FLOAT_EQ(std::sqrt(10.f), float(result.min_distance));
}

}  // namespace shape_distance_test
}  // namespace adaptive_bvh_test
