// CuttingPlanes: the highest point of the least of several planes over a triangle.
#include "query/depth/cutting_planes.h"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "support/random_geometry.h"

namespace adaptive_bvh_test {
namespace cutting_planes_test {

/// The bound is that of a linear program, which a fine grid judges from below.
TEST(CuttingPlanesTest, BoundTheLeastOfThem) {
  RandomGeometry random(52);
  for (int round = 0; round < 200; ++round) {
    adaptive_bvh::CuttingPlanes planes;
    std::vector<fcl::Vector3d> all;
    double before = std::numeric_limits<double>::infinity();
    for (int n = 0; n < 6; ++n) {
      fcl::Vector3d plane = random.point();
      if (random.oneIn(3)) plane = (2 * plane).array().round();
      all.push_back(plane);
      planes.add(plane);
      ASSERT_LE(planes.bound(), before + 1e-14);
      before = planes.bound();
      double highest = -std::numeric_limits<double>::infinity();
      constexpr int kGrid = 40;
      for (int i = 0; i <= kGrid; ++i)
        for (int j = 0; i + j <= kGrid; ++j) {
          const fcl::Vector3d at = fcl::Vector3d(i, j, kGrid - i - j) / kGrid;
          double least = std::numeric_limits<double>::infinity();
          for (const fcl::Vector3d& p : all) least = std::min(least, p.dot(at));
          highest = std::max(highest, least);
        }
      ASSERT_GE(planes.bound(), highest - 1e-14);
      ASSERT_LE(planes.bound(), highest + 0.2);
    }
  }
}

}  // namespace cutting_planes_test
}  // namespace adaptive_bvh_test
