// Which criterion suits your motion? Run them all on it and compare the work. Here: a hose of 2,000
// triangles that swings beside a wall. Every policy gives the same, exact distances.
#include <chrono>
#include <cmath>
#include <cstdio>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/query.h"
#include "page.h"

using adaptive_bvh::FitnessCriterion;
using adaptive_bvh::RefitPolicy;
using Model = adaptive_bvh::AdaptiveBVHModeld;
using Point = fcl::Vector3d;

constexpr std::size_t kAround = 20, kAlong = 50;

// A tube of length 2 and radius 0.05 that hangs from its upper end.
std::vector<Point> hose(double t) {
  std::vector<Point> points;
  for (std::size_t j = 0; j <= kAlong; ++j)
    for (std::size_t i = 0; i < kAround; ++i) {
      const double down = 2. * double(j) / kAlong, angle = 2 * M_PI * double(i) / kAround;
      const double swing = 0.3 * std::sin(t) * down * down / 4 + 0.03 * std::sin(5 * down - 3 * t);
      points.emplace_back(swing + 0.05 * std::cos(angle), 0.05 * std::sin(angle), -down);
    }
  return points;
}

int main(int argc, char** argv) {
  std::vector<fcl::Triangle> triangles;
  for (std::size_t j = 0; j < kAlong; ++j)
    for (std::size_t i = 0; i < kAround; ++i) {
      const std::size_t a = kAround * j + i, b = kAround * j + (i + 1) % kAround;
      triangles.emplace_back(a, b, b + kAround);
      triangles.emplace_back(a, b + kAround, a + kAround);
    }
  Model wall;
  wall.beginModel();
  wall.addTriangle(Point(0.5, -2, -3), Point(0.5, 2, -3), Point(0.5, 2, 1));
  wall.addTriangle(Point(0.5, -2, -3), Point(0.5, 2, 1), Point(0.5, -2, 1));
  wall.endModel();
  const auto origin = fcl::Transform3d::Identity();

  std::printf("%-26s %11s %15s %9s\n", "criterion", "ms a step", "refits a step", "nearest");
  Page page(argc, argv, "A hose beside a wall, with the default policy");
  const auto run = [&](const char* name, const RefitPolicy& policy, Page* recorded = nullptr) {
    Model model(policy);
    model.beginModel();
    model.addSubModel(hose(0), triangles);
    model.endModel();
    if (recorded) recorded->add(model, origin, "hose");
    if (recorded) recorded->add(wall, origin, "wall");
    const int steps = 100;
    double seconds = 0, nearest = 1e9;
    long refits = 0;
    for (int step = 1; step <= steps; ++step) {
      const std::vector<Point> positions = hose(0.05 * step);
      const auto start = std::chrono::steady_clock::now();
      refits += model.update(positions).refitted();
      fcl::DistanceResultd result;
      adaptive_bvh::distance(&model, origin, &wall, origin, fcl::DistanceRequestd(true), result);
      seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
      nearest = std::min(nearest, result.min_distance);
      if (recorded) recorded->frame(result);
    }
    std::printf("%-26s %11.3f %15.1f %9.6f\n", name, 1e3 * seconds / steps, double(refits) / steps,
                nearest);
  };
  run("default", RefitPolicy(), &page);
  page.write();
  for (auto criterion :
       {FitnessCriterion::A, FitnessCriterion::B, FitnessCriterion::AB, FitnessCriterion::BC,
        FitnessCriterion::ABC, FitnessCriterion::AOrBC, FitnessCriterion::ABOrBC,
        FitnessCriterion::RefitAll, FitnessCriterion::RefitNone})
    run(toString(criterion), RefitPolicy::thesis(criterion));
}
