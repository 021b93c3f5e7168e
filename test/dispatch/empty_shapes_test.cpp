// Shapes with a size that is not positive are refused by every query, and half-spaces take no
// search.
#include <gtest/gtest.h>

#include <array>
#include <limits>

#include "adaptive_bvh/penetration.h"
#include "adaptive_bvh/query.h"
#include "support/closed_bodies.h"
#include "support/fcl_float.h"
#include "support/test_mesh.h"

namespace adaptive_bvh_test {
namespace empty_shapes_test {

using adaptive_bvh::DeformableMesh;

template <typename S>
class EmptyShapes : public testing::Test {};
TYPED_TEST_SUITE(EmptyShapes, MeshScalars);

/// Of each shape one with each of its sizes 0, negative, infinite and NaN: every query refuses it.
TYPED_TEST(EmptyShapes, AreRefusedByEveryQuery) {
  using S = TypeParam;
  const DeformableMesh<S> mesh(latticeBox<S>(1));
  const auto still = fcl::Transform3<S>::Identity();
  for (const S bad :
       {S(0), S(-1), std::numeric_limits<S>::infinity(), std::numeric_limits<S>::quiet_NaN()}) {
    std::vector<std::shared_ptr<fcl::CollisionGeometry<S>>> shapes = {
        std::make_shared<fcl::Sphere<S>>(bad)};
    for (int k = 0; k < 3; ++k) {
      fcl::Vector3<S> sizes(1, 1, 1);
      sizes[k] = bad;
      shapes.push_back(std::make_shared<fcl::Ellipsoid<S>>(sizes));
      shapes.push_back(std::make_shared<fcl::Box<S>>(sizes));
      shapes.push_back(std::make_shared<fcl::Capsule<S>>(sizes[0], sizes[1]));
      shapes.push_back(std::make_shared<fcl::Cylinder<S>>(sizes[0], sizes[1]));
      shapes.push_back(std::make_shared<fcl::Cone<S>>(sizes[0], sizes[1]));
      if (k == 2) shapes.resize(shapes.size() - 3);
    }
    for (const auto& shape : shapes) {
      const fcl::CollisionGeometry<S>& other = *shape;
      adaptive_bvh::VertexContacts<S> contacts;
      fcl::DistanceResult<S> distance;
      fcl::CollisionResult<S> collision;
      EXPECT_THROW(signedDistance(mesh, still, other, still, S(0.1)), std::invalid_argument);
      EXPECT_THROW(vertexContacts(mesh, still, other, still, S(1), contacts),
                   std::invalid_argument);
      const fcl::DistanceRequest<S> how_far;
      const fcl::CollisionRequest<S> whether;
      EXPECT_THROW(adaptive_bvh::distance<S>(&mesh, still, &other, still, how_far, distance),
                   std::invalid_argument);
      EXPECT_THROW(adaptive_bvh::collide<S>(&mesh, still, &other, still, whether, collision),
                   std::invalid_argument);
    }
  }
}

/// Nothing in a result is left as it was in memory.
TYPED_TEST(EmptyShapes, AHalfSpaceCountsNoSearches) {
  using S = TypeParam;
  const DeformableMesh<S> mesh(latticeBox<S>(1));
  const auto still = fcl::Transform3<S>::Identity();
  for (const S height : {S(-1), S(0), S(0.5)}) {
    const fcl::Halfspace<S> ground(fcl::Vector3<S>::UnitZ(), height);
    const fcl::CollisionGeometry<S>& other = ground;
    std::array<unsigned char, 4096> noise;
    noise.fill(0xa5);
    volatile unsigned char sink = noise[std::size_t(17)];
    (void)sink;
    EXPECT_EQ(0u, signedDistance(mesh, still, other, still, S(0.1)).searches);
  }
}

}  // namespace empty_shapes_test
}  // namespace adaptive_bvh_test
