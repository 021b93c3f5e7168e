// A simulation goes on while another thread looks at its last step: it queries a copy of the mesh.
// A copy is a snapshot. It shares the topology, so it is cheap, and it stays as it is while the
// original is updated. Each answer must be that of the step it was taken from.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <future>

#include "adaptive_bvh/point_query.h"
#include "adaptive_bvh/query.h"
#include "page.h"

using Mesh = adaptive_bvh::DeformableMesh;
using Point = fcl::Vector3d;

constexpr std::size_t kCells = 60;

// A sheet that sinks by a tenth in each step, and waves.
std::vector<Point> sheet(int step) {
  std::vector<Point> points;
  for (std::size_t j = 0; j <= kCells; ++j)
    for (std::size_t i = 0; i <= kCells; ++i) {
      const double x = double(i) / kCells, y = double(j) / kCells;
      points.emplace_back(x, y, 1.5 - 0.1 * step + 0.05 * std::sin(9 * x + 0.5 * step));
    }
  return points;
}

// The distance of a snapshot to the floor, and to a point below its middle.
struct Answer {
  double to_floor, to_point;
};
Answer look(const Mesh& snapshot, const Mesh& floor) {
  const fcl::Transform3d origin = fcl::Transform3d::Identity();
  fcl::DistanceResultd result;
  adaptive_bvh::distance(&snapshot, origin, &floor, origin, fcl::DistanceRequestd(), result);
  return {result.min_distance, closestPoint(snapshot, Point(0.5, 0.5, 0)).distance};
}

int main(int argc, char** argv) {
  std::vector<fcl::Triangle> triangles;
  for (std::size_t j = 0; j < kCells; ++j)
    for (std::size_t i = 0; i < kCells; ++i) {
      const std::size_t v = (kCells + 1) * j + i;
      triangles.emplace_back(v, v + 1, v + kCells + 2);
      triangles.emplace_back(v, v + kCells + 2, v + kCells + 1);
    }
  Mesh cloth(sheet(0), triangles);
  const Mesh floor({Point(0, 0, 0), Point(1, 0, 0), Point(1, 1, 0), Point(0, 1, 0)},
                   {fcl::Triangle(0, 1, 2), fcl::Triangle(0, 2, 3)});
  Page page(argc, argv, "A sheet that sinks");
  page.add(cloth, fcl::Transform3d::Identity(), "sheet");

  for (int step = 0; step < 10; ++step) {
    const Mesh snapshot = cloth;
    page.frame();
    std::future<Answer> other =
        std::async(std::launch::async, [&] { return look(snapshot, floor); });
    cloth.update(sheet(step + 1));  // meanwhile
    const Answer answer = other.get();

    double lowest = 10;
    for (const Point& p : sheet(step)) lowest = std::min(lowest, p[2]);
    std::printf("step %d: snapshot %.6f above the floor, %.6f from the point: %s\n", step,
                answer.to_floor, answer.to_point,
                std::abs(answer.to_floor - lowest) < 1e-12 ? "of its step" : "WRONG");
  }
  page.write();
}
