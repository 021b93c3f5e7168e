// Every query refuses a transform that is not a rigid motion, and changes nothing then.
#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "adaptive_bvh/coherent_distance.h"
#include "adaptive_bvh/continuous_collision.h"
#include "adaptive_bvh/proximity.h"
#include "adaptive_bvh/query.h"
#include "adaptive_bvh/self_collision.h"
#include "support/fcl_float.h"
#include "support/test_mesh.h"

namespace adaptive_bvh_test {
namespace rigid_transform_test {

template <typename S>
class RigidTransform : public testing::Test {
 protected:
  using Model = adaptive_bvh::DeformableMesh<S>;
  using Transform = fcl::Transform3<S>;
  using Query = std::function<void(const Transform&, const Transform&)>;

  static std::vector<Transform> badTransforms() {
    const S nan = std::numeric_limits<S>::quiet_NaN();
    std::vector<Transform> bad(6, Transform::Identity());
    bad[0].linear() *= 2;
    bad[1].linear().col(0) *= -1;
    bad[2].linear()(0, 1) = S(0.01);
    bad[3].linear()(1, 2) = nan;
    bad[4].translation()[1] = nan;
    bad[5].translation()[2] = std::numeric_limits<S>::infinity();
    return bad;
  }

  void expectRefusal(const Query& query) {
    const Transform still = Transform::Identity();
    for (const Transform& bad : badTransforms()) {
      EXPECT_THROW(query(bad, still), std::invalid_argument);
      EXPECT_THROW(query(still, bad), std::invalid_argument);
    }
    Transform turned = still;  // by many steps, each of which is rounded
    const fcl::Matrix3<S> step =
        fcl::AngleAxis<S>(S(0.01), Vector3<S>(1, 2, 3).normalized()).toRotationMatrix();
    for (int i = 0; i < 1000; ++i) turned.linear() = (step * turned.linear()).eval();
    EXPECT_NO_THROW(query(turned, still));
    EXPECT_NO_THROW(query(still, turned));
  }

  Model first_{plate<S>(3, 3)}, second_{dome<S>(5, 4)};
};

TYPED_TEST_SUITE(RigidTransform, MeshScalars);

TYPED_TEST(RigidTransform, OrNoDistance) {
  using S = TypeParam;
  using Transform = typename TestFixture::Transform;
  const fcl::DistanceRequest<S> request;
  this->expectRefusal([&](const Transform& tf1, const Transform& tf2) {
    fcl::DistanceResult<S> result;
    adaptive_bvh::distance<S>(&this->first_, tf1, &this->second_, tf2, request, result);
  });
  adaptive_bvh::CoherentDistance<S> pair(this->first_, this->second_);
  this->expectRefusal([&](const Transform& tf1, const Transform& tf2) {
    fcl::DistanceResult<S> result;
    pair.distance(tf1, tf2, request, result);
  });
  const fcl::Sphere<S> ball(S(0.5));
  this->expectRefusal([&](const Transform& tf1, const Transform& tf2) {
    fcl::DistanceResult<S> result;
    adaptive_bvh::distance<S>(&this->first_, tf1, &ball, tf2, request, result);
  });
}

TYPED_TEST(RigidTransform, OrNoContacts) {
  using S = TypeParam;
  using Transform = typename TestFixture::Transform;
  this->expectRefusal([&](const Transform& tf1, const Transform& tf2) {
    fcl::CollisionResult<S> result;
    adaptive_bvh::collide<S>(&this->first_, tf1, &this->second_, tf2, fcl::CollisionRequest<S>(100),
                             result);
  });
  this->expectRefusal([&](const Transform& tf1, const Transform& tf2) {
    fcl::CollisionResult<S> result;
    selfCollide(this->first_, tf1, fcl::CollisionRequest<S>(100), result);
    selfCollide(this->first_, tf2, fcl::CollisionRequest<S>(100), result);
  });
}

TYPED_TEST(RigidTransform, OrNothingNear) {
  using S = TypeParam;
  using Transform = typename TestFixture::Transform;
  this->expectRefusal([&](const Transform& tf1, const Transform& tf2) {
    isNearer(this->first_, tf1, this->second_, tf2, S(0.1));
  });
  adaptive_bvh::CoherentProximity<S> pair(this->first_, this->second_);
  this->expectRefusal(
      [&](const Transform& tf1, const Transform& tf2) { pair.isNearer(tf1, tf2, S(0.1)); });
  adaptive_bvh::ProximityRequest<S> request;
  request.distance = S(0.1);
  adaptive_bvh::TrianglePairs<S> pairs;
  this->expectRefusal([&](const Transform& tf1, const Transform& tf2) {
    pairsWithin(this->first_, tf1, this->second_, tf2, request, pairs);
  });
  adaptive_bvh::FeaturePairs features;
  this->expectRefusal([&](const Transform& tf1, const Transform& tf2) {
    featurePairsWithin(this->first_, tf1, this->second_, tf2, S(0.1), features);
  });
  std::vector<S> clearances;
  this->expectRefusal([&](const Transform& tf1, const Transform& tf2) {
    clearance(this->first_, tf1, this->second_, tf2, S(1), clearances);
  });
  clearances = {S(42)};
  EXPECT_THROW(clearance(this->first_, this->badTransforms()[0], this->second_,
                         Transform(Transform::Identity()), S(1), clearances),
               std::invalid_argument);
  EXPECT_EQ(std::vector<S>{S(42)}, clearances);
}

TYPED_TEST(RigidTransform, OrNoImpact) {
  using S = TypeParam;
  using Transform = typename TestFixture::Transform;
  using Motion = adaptive_bvh::Motion<S>;
  const std::vector<Vector3<S>>& positions = this->first_.vertices();
  this->expectRefusal([&](const Transform& tf1, const Transform& tf2) {
    const Motion motion(this->first_, positions, positions, tf1, tf2);
    adaptive_bvh::FeaturePairs pairs;
    candidates(motion, 0, pairs);
  });
}

}  // namespace rigid_transform_test
}  // namespace adaptive_bvh_test
