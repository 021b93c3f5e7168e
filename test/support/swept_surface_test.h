#pragma once

#include <vector>

#include <gtest/gtest.h>

#include "support/random_geometry.h"
#include "support/swept_features.h"
#include "support/test_mesh.h"

namespace adaptive_bvh_test {

/// Fixture of tests whose surfaces go straight ways, on which no features may come together.
class SweptSurfaceTest : public testing::Test {
 protected:
  using P = Eigen::Vector3d;
  using Points = std::vector<fcl::Vector3d>;

  explicit SweptSurfaceTest(unsigned seed) : random_(seed) {}

  Points moved(const Points& from, double size) {
    Points to = from;
    const fcl::Vector3d together = random_.point() * size;
    for (auto& x : to)
      if (!random_.oneIn(5)) x += together + random_.point() * size * 0.5;
    return to;
  }
  static void append(const Points& points, const fcl::Transform3d& tf, std::vector<P>& world) {
    for (const auto& x : points) world.push_back(tf * P(x));
  }
  /// The surface of one or several meshes in the world.
  struct World {
    std::vector<P> start, end;
    std::vector<fcl::Triangle> triangles;

    void add(const TriangleMesh& mesh, const Points& from, const Points& to,
             const fcl::Transform3d& tf) {
      const std::size_t first = start.size();
      append(from, tf, start);
      append(to, tf, end);
      for (const fcl::Triangle& t : mesh.triangles)
        triangles.emplace_back(first + t[0], first + t[1], first + t[2]);
    }
  };
  /// Requires that all pairs stay apart that are apart at the start. leavesOut(pair): whether a
  /// pair does not count.
  template <typename LeavesOut>
  void expectApart(const World& world, const LeavesOut& leavesOut) {
    const SweptFeatures features(world.start, world.end, world.triangles);
    features.forEachPair(0, [&](const SweptFeatures::Pair& pair) {
      if (leavesOut(pair) || !features.areApartAtStart(pair)) return;
      ++near_;
      ASSERT_TRUE(features.areApartAllTheWay(pair));
    });
  }

  RandomGeometry random_;
  long near_ = 0;  ///< pairs that were near, and apart at the start
};

}  // namespace adaptive_bvh_test
