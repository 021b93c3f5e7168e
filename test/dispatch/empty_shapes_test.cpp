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

class EmptyShapes : public testing::Test {};
/// Of each shape one with each of its sizes 0, negative, infinite and NaN: every query refuses it.
TEST_F(EmptyShapes, AreRefusedByEveryQuery) {
  const DeformableMesh mesh(latticeBox(1));
  const auto still = fcl::Transform3d::Identity();
  for (const double bad : {0., -1., std::numeric_limits<double>::infinity(),
                           std::numeric_limits<double>::quiet_NaN()}) {
    std::vector<std::shared_ptr<fcl::CollisionGeometryd>> shapes = {
        std::make_shared<fcl::Sphered>(bad)};
    for (int k = 0; k < 3; ++k) {
      fcl::Vector3d sizes(1, 1, 1);
      sizes[k] = bad;
      shapes.push_back(std::make_shared<fcl::Ellipsoidd>(sizes));
      shapes.push_back(std::make_shared<fcl::Boxd>(sizes));
      shapes.push_back(std::make_shared<fcl::Capsuled>(sizes[0], sizes[1]));
      shapes.push_back(std::make_shared<fcl::Cylinderd>(sizes[0], sizes[1]));
      shapes.push_back(std::make_shared<fcl::Coned>(sizes[0], sizes[1]));
      if (k == 2) shapes.resize(shapes.size() - 3);
    }
    for (const auto& shape : shapes) {
      const fcl::CollisionGeometryd& other = *shape;
      adaptive_bvh::VertexContacts contacts;
      fcl::DistanceResultd distance;
      fcl::CollisionResultd collision;
      EXPECT_THROW(signedDistance(mesh, still, other, still, 0.1), std::invalid_argument);
      EXPECT_THROW(vertexContacts(mesh, still, other, still, 1., contacts), std::invalid_argument);
      const fcl::DistanceRequestd how_far;
      const fcl::CollisionRequestd whether;
      EXPECT_THROW(adaptive_bvh::distance(&mesh, still, &other, still, how_far, distance),
                   std::invalid_argument);
      EXPECT_THROW(adaptive_bvh::collide(&mesh, still, &other, still, whether, collision),
                   std::invalid_argument);
    }
  }
}

/// Nothing in a result is left as it was in memory.
TEST_F(EmptyShapes, AHalfSpaceCountsNoSearches) {
  const DeformableMesh mesh(latticeBox(1));
  const auto still = fcl::Transform3d::Identity();
  for (const double height : {-1., 0., 0.5}) {
    const fcl::Halfspaced ground(fcl::Vector3d::UnitZ(), height);
    const fcl::CollisionGeometryd& other = ground;
    std::array<unsigned char, 4096> noise;
    noise.fill(0xa5);
    volatile unsigned char sink = noise[std::size_t(17)];
    (void)sink;
    EXPECT_EQ(0u, signedDistance(mesh, still, other, still, 0.1).searches);
  }
}

}  // namespace empty_shapes_test
}  // namespace adaptive_bvh_test
