// Queries that a check ends: they throw what it throws, and can be made again.
#include "adaptive_bvh/interruption.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>

#include "adaptive_bvh/self_collision.h"
#include "support/meshes.h"

namespace adaptive_bvh_test {
namespace interruption_test {

struct Stopped {};

std::atomic<int> calls{0}, calls_until_stop{0};
void check() {
  if (++calls == calls_until_stop) throw Stopped();
}

/// A fan around one vertex, which all pairs of triangles share.
adaptive_bvh::DeformableMesh fan(unsigned triangles) {
  std::vector<fcl::Vector3d> points = {{0, 0, 0}};
  std::vector<fcl::Triangle> faces;
  for (unsigned i = 0; i < triangles; ++i) {
    const double angle = 2 * M_PI * i / triangles;
    points.emplace_back(std::cos(angle), std::sin(angle), 0.3 * std::sin(7 * angle));
    faces.emplace_back(0, i + 1, i + 1 == triangles ? 1 : i + 2);
  }
  return {points, faces};
}

TEST(Interruption, EndsASelfCollisionWithinLeaves) {
  auto mesh = fan(6000);
  fcl::CollisionRequestd request(1, false);
  for (const int threads : {1, 2}) {
    mesh.setThreads(threads);
    fcl::CollisionResultd result;
    adaptive_bvh::setInterruptionCheck(check);
    calls = 0, calls_until_stop = 3;
    EXPECT_THROW(adaptive_bvh::selfCollide(mesh, request, result), Stopped);
    EXPECT_LT(calls, 3 + threads);
    calls = 0, calls_until_stop = -1;
    EXPECT_EQ(0u, adaptive_bvh::selfCollide(mesh, request, result));
    EXPECT_GT(calls, 10) << "of 18 million pairs";
    adaptive_bvh::setInterruptionCheck(nullptr);
    calls = 0;
    EXPECT_EQ(0u, adaptive_bvh::selfCollide(mesh, request, result));
    EXPECT_EQ(0, calls);
  }
}

}  // namespace interruption_test
}  // namespace adaptive_bvh_test
