// A simulation writes a scene at 30 Hz while a planner reads it. After each step the writer
// publishes a snapshot, and the planner queries the newest one, so neither blocks the other. Each
// answer must be that of the step of its snapshot.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>
#include <mutex>
#include <thread>

#include <fcl/geometry/shape/sphere.h>

#include "adaptive_bvh/scene.h"

using Mesh = adaptive_bvh::DeformableMesh;
using Point = fcl::Vector3d;
using Scene = adaptive_bvh::Scene;

constexpr std::size_t kCells = 40;
constexpr int kSteps = 15;

// A sheet whose lowest point is 0.02 lower in each step.
double lowestOf(int step) { return 1 - 0.02 * step; }
std::vector<Point> sheetAt(int step) {
  std::vector<Point> points;
  for (std::size_t j = 0; j <= kCells; ++j)
    for (std::size_t i = 0; i <= kCells; ++i) {
      const double x = 2. * double(i) / kCells - 1, y = 2. * double(j) / kCells - 1;
      points.emplace_back(x, y, lowestOf(step) + 0.1 * (x * x + y * y));
    }
  return points;
}
Mesh sheet() {
  std::vector<fcl::Triangle> triangles;
  for (std::size_t j = 0; j < kCells; ++j)
    for (std::size_t i = 0; i < kCells; ++i) {
      const std::size_t v = (kCells + 1) * j + i;
      triangles.emplace_back(v, v + 1, v + kCells + 2);
      triangles.emplace_back(v, v + kCells + 2, v + kCells + 1);
    }
  return Mesh(sheetAt(0), triangles);
}

// What the writer hands over.
struct Published {
  std::shared_ptr<const Scene> scene;
  int step = 0;
};

int main() {
  Mesh cloth = sheet();
  Scene scene;
  const adaptive_bvh::BodyId ball = scene.add(std::make_shared<fcl::Sphered>(0.25));
  scene.add(cloth);
  scene.update();
  std::mutex mutex;
  Published newest{std::make_shared<const Scene>(scene.snapshot()), 0};

  std::thread writer([&] {
    for (int step = 1; step <= kSteps; ++step) {
      std::this_thread::sleep_for(std::chrono::milliseconds(33));  // the rest of the simulation
      cloth.update(sheetAt(step));
      scene.update();
      Published next{std::make_shared<const Scene>(scene.snapshot()), step};
      const std::lock_guard<std::mutex> lock(mutex);
      std::swap(newest, next);
    }
  });
  long answers = 0, wrong = 0;
  std::vector<adaptive_bvh::SceneDistance> nearest;
  for (int step = 0; step < kSteps;) {
    Published seen;
    {
      const std::lock_guard<std::mutex> lock(mutex);
      seen = newest;
    }
    step = seen.step;
    seen.scene->nearest(ball, 1, nearest);
    const double expected = lowestOf(step) - 0.25;
    ++answers;
    wrong += std::abs(nearest.at(0).distance - expected) > 1e-12;
  }
  writer.join();
  std::printf("%d steps written, more answers than steps: %s, wrong answers: %ld\n", kSteps,
              answers > kSteps ? "yes" : "no", wrong);
}
