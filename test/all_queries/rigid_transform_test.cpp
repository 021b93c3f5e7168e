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

class RigidTransform : public testing::Test {
 protected:
  using Model = adaptive_bvh::DeformableMesh;
  using Transform = fcl::Transform3d;
  using Query = std::function<void(const Transform&, const Transform&)>;

  static std::vector<Transform> badTransforms() {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    std::vector<Transform> bad(6, Transform::Identity());
    bad[0].linear() *= 2;
    bad[1].linear().col(0) *= -1;
    bad[2].linear()(0, 1) = 0.01;
    bad[3].linear()(1, 2) = nan;
    bad[4].translation()[1] = nan;
    bad[5].translation()[2] = std::numeric_limits<double>::infinity();
    return bad;
  }

  void expectRefusal(const Query& query) {
    const Transform still = Transform::Identity();
    for (const Transform& bad : badTransforms()) {
      EXPECT_THROW(query(bad, still), std::invalid_argument);
      EXPECT_THROW(query(still, bad), std::invalid_argument);
    }
    Transform turned = still;  // by many steps, each of which is rounded
    const fcl::Matrix3d step =
        fcl::AngleAxis<double>(0.01, fcl::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
    for (int i = 0; i < 1000; ++i) turned.linear() = (step * turned.linear()).eval();
    EXPECT_NO_THROW(query(turned, still));
    EXPECT_NO_THROW(query(still, turned));
  }

  Model first_{plate(3, 3)}, second_{dome(5, 4)};
};

TEST_F(RigidTransform, OrNoDistance) {
  using Transform = Transform;
  const fcl::DistanceRequestd request;
  this->expectRefusal([&](const Transform& tf1, const Transform& tf2) {
    fcl::DistanceResultd result;
    adaptive_bvh::distance(&this->first_, tf1, &this->second_, tf2, request, result);
  });
  adaptive_bvh::CoherentDistance pair(this->first_, this->second_);
  this->expectRefusal([&](const Transform& tf1, const Transform& tf2) {
    fcl::DistanceResultd result;
    pair.distance(tf1, tf2, request, result);
  });
  const fcl::Sphered ball(0.5);
  this->expectRefusal([&](const Transform& tf1, const Transform& tf2) {
    fcl::DistanceResultd result;
    adaptive_bvh::distance(&this->first_, tf1, &ball, tf2, request, result);
  });
}

TEST_F(RigidTransform, OrNoContacts) {
  using Transform = Transform;
  this->expectRefusal([&](const Transform& tf1, const Transform& tf2) {
    fcl::CollisionResultd result;
    adaptive_bvh::collide(&this->first_, tf1, &this->second_, tf2, fcl::CollisionRequestd(100),
                          result);
  });
  this->expectRefusal([&](const Transform& tf1, const Transform& tf2) {
    fcl::CollisionResultd result;
    selfCollide(this->first_, tf1, {}, fcl::CollisionRequestd(100), result);
    selfCollide(this->first_, tf2, {}, fcl::CollisionRequestd(100), result);
  });
}

TEST_F(RigidTransform, OrNothingNear) {
  using Transform = Transform;
  this->expectRefusal([&](const Transform& tf1, const Transform& tf2) {
    isNearer(this->first_, tf1, this->second_, tf2, 0.1);
  });
  adaptive_bvh::CoherentProximity pair(this->first_, this->second_);
  this->expectRefusal(
      [&](const Transform& tf1, const Transform& tf2) { pair.isNearer(tf1, tf2, 0.1); });
  adaptive_bvh::ProximityRequest request;
  request.distance = 0.1;
  adaptive_bvh::TrianglePairs pairs;
  this->expectRefusal([&](const Transform& tf1, const Transform& tf2) {
    pairsWithin(this->first_, tf1, this->second_, tf2, request, pairs);
  });
  adaptive_bvh::FeaturePairs features;
  this->expectRefusal([&](const Transform& tf1, const Transform& tf2) {
    featurePairsWithin(this->first_, tf1, this->second_, tf2, 0.1, features);
  });
  std::vector<double> clearances;
  this->expectRefusal([&](const Transform& tf1, const Transform& tf2) {
    vertexDistances(this->first_, tf1, this->second_, tf2, 1., clearances);
  });
  clearances = {42.};
  EXPECT_THROW(vertexDistances(this->first_, this->badTransforms()[0], this->second_,
                               Transform(Transform::Identity()), 1., clearances),
               std::invalid_argument);
  EXPECT_EQ(std::vector<double>{42.}, clearances);
}

TEST_F(RigidTransform, OrNoImpact) {
  using Transform = Transform;
  using Motion = adaptive_bvh::Motion;
  const std::vector<fcl::Vector3d>& positions = this->first_.vertices();
  this->expectRefusal([&](const Transform& tf1, const Transform& tf2) {
    const Motion motion(this->first_, positions, positions, tf1, tf2);
    adaptive_bvh::FeaturePairs pairs;
    selfCandidates(motion, 0, pairs);
  });
}

}  // namespace rigid_transform_test
}  // namespace adaptive_bvh_test
