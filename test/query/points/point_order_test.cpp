// The order of points along a Morton curve: a permutation for all points, near neighbours in it.
#include "query/points/point_order.h"

#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace adaptive_bvh {
namespace {

std::vector<std::size_t> orderOf(const std::vector<fcl::Vector3d>& points) {
  PointOrder order;
  order.sort(points.size(), [&](std::size_t i) -> fcl::Vector3d { return points[i]; });
  std::vector<std::size_t> indices(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) indices[i] = order[i];
  return indices;
}

std::vector<fcl::Vector3d> randomPoints(std::size_t count, double size) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> coordinate(-1, 1);
  std::vector<fcl::Vector3d> points(count);
  for (fcl::Vector3d& x : points)
    for (int k = 0; k < 3; ++k) x[k] = size * coordinate(random);
  return points;
}

double lengthOfPath(const std::vector<fcl::Vector3d>& points,
                    const std::vector<std::size_t>& order) {
  double length = 0;
  for (std::size_t i = 1; i < order.size(); ++i)
    length += (points[order[i]] - points[order[i - 1]]).norm();
  return length;
}

TEST(PointOrder, HasEachPointOnce) {
  const double largest = std::numeric_limits<double>::max();
  for (const std::size_t count : {0, 1, 63, 64, 65, 1000, 100000})
    for (const double size : {1., 0., 5e-324, 1e-300, largest}) {
      std::vector<std::size_t> order = orderOf(randomPoints(count, size));
      std::sort(order.begin(), order.end());
      for (std::size_t i = 0; i < count; ++i) ASSERT_EQ(order[i], i);
    }
}

TEST(PointOrder, NeighboursAreNear) {
  const std::vector<fcl::Vector3d> points = randomPoints(20000, 1);
  std::vector<std::size_t> unordered(points.size());
  std::iota(unordered.begin(), unordered.end(), std::size_t(0));
  EXPECT_LT(lengthOfPath(points, orderOf(points)), 0.1 * lengthOfPath(points, unordered));
}

TEST(PointOrder, PointsOfOneCellKeepTheirOrder) {
  const std::vector<std::size_t> order = orderOf(std::vector<fcl::Vector3d>(100, {1, 2, 3}));
  EXPECT_TRUE(std::is_sorted(order.begin(), order.end()));
}

}  // namespace
}  // namespace adaptive_bvh
