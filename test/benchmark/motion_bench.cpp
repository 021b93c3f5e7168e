// Clearance over a motion: a hose and the nearest of many parts beside the distance at the end of
// each step and at many times in between; and the longest ordinary inputs, with their work.
// Milliseconds, medians; rows of a table in turns in one process. Ends with status 1 if an answer
// is not below a sampled one.
#include <cmath>
#include <cstdio>
#include <memory>
#include <random>

#include <CLI/CLI.hpp>

#include "adaptive_bvh/motion_clearance.h"
#include "adaptive_bvh/query.h"
#include "adaptive_bvh/scene.h"
#include "median.h"
#include "round_grids.h"
#include "stopwatch.h"

namespace {

using adaptive_bvh::BodyId;
using adaptive_bvh::DeformableMesh;
using adaptive_bvh::FramePath;
using adaptive_bvh::Motion;
using adaptive_bvh::MotionClearance;
using adaptive_bvh::Scene;
using adaptive_bvh_bench::around;
using adaptive_bvh_bench::ball;
using adaptive_bvh_bench::median;
using adaptive_bvh_bench::milliseconds;
using Mesh = adaptive_bvh::TriangleMesh;
using Point = fcl::Vector3d;
using Pose = fcl::Transform3d;

bool failed = false;
void require(bool holds, const char* what) {
  if (holds) return;
  std::printf("WRONG: %s\n", what);
  failed = true;
}

Mesh hoseAt(double time) {
  return around(20, 500, [&](double u, double v) -> Point {
    const double angle = 2 * M_PI * u;
    const Point course(20 * v - 10, 2 * std::sin(5 * v + time), 1.5 * std::cos(4 * v + 0.7 * time));
    return course + 0.15 * Point(0, std::cos(angle), std::sin(angle));
  });
}
Mesh tube(double radius) {
  return around(20, 500, [&](double u, double v) -> Point {
    const double angle = 2 * M_PI * u;
    return {2 * v, radius * std::cos(angle), radius * std::sin(angle)};
  });
}
Mesh plate(int cells) {
  Mesh mesh;
  for (int j = 0; j <= cells; ++j)
    for (int i = 0; i <= cells; ++i) mesh.vertices.emplace_back(i / 100., j / 100., 0);
  const auto at = [&](int i, int j) { return std::size_t(j * (cells + 1) + i); };
  for (int j = 0; j < cells; ++j)
    for (int i = 0; i < cells; ++i) {
      mesh.triangles.emplace_back(at(i, j), at(i + 1, j), at(i + 1, j + 1));
      mesh.triangles.emplace_back(at(i, j), at(i + 1, j + 1), at(i, j + 1));
    }
  return mesh;
}

// ---- The hose -----------------------------------------------------------------------------------

constexpr double kEdge = 0.04, kTolerance = 1e-3 * kEdge;

/// A hose of 20,000 triangles that swings between parts of some 1,850 triangles.
void hose(int parts, int steps, int samples) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> any(-1, 1);
  std::vector<std::unique_ptr<DeformableMesh>> meshes;
  DeformableMesh mesh(hoseAt(0)), sampled(hoseAt(0));
  Scene scene, at_times;
  const BodyId id = scene.add(mesh), sampled_id = at_times.add(sampled);
  while (int(meshes.size()) < parts) {
    const Point at(11 * any(random), 6 * any(random), 6 * any(random));
    const double radius = 0.3 + 0.1 * any(random);
    if (!(std::hypot(at[1], at[2]) > 2.8 + radius)) continue;
    meshes.push_back(std::make_unique<DeformableMesh>(ball(43, 21, radius, at)));
    scene.add(*meshes.back());
    at_times.add(*meshes.back());
  }
  std::vector<double> of_nearest, of_update, of_motion, of_samples;
  std::size_t box_tests = 0, pair_times = 0;
  std::vector<Point> before = mesh.vertices();
  for (int step = 1; step <= steps; ++step) {
    const std::vector<Point> after = hoseAt(0.02 * step).vertices;
    double at_end = 0, least_sample = 1e300;
    adaptive_bvh::SceneClearance least;
    of_update.push_back(milliseconds([&] {
      mesh.updateTwoFrames(after);
      scene.update();
    }));
    of_nearest.push_back(milliseconds([&] { at_end = scene.nearest(id).distance; }));
    of_motion.push_back(milliseconds([&] { least = scene.leastDistance(id, kTolerance); }));
    of_samples.push_back(milliseconds([&] {
      for (int i = 1; i <= samples; ++i) {
        const double t = double(i) / samples;
        std::vector<Point> now(before.size());
        for (std::size_t v = 0; v < now.size(); ++v) now[v] = (1 - t) * before[v] + t * after[v];
        sampled.update(now);
        at_times.update();
        least_sample = std::min(least_sample, at_times.nearest(sampled_id).distance);
      }
    }));
    require(least.clearance.lower <= least_sample && least.clearance.lower <= at_end,
            "the least distance of the hose");
    box_tests += least.clearance.box_tests;
    pair_times += least.clearance.pair_times;
    before = after;
  }
  std::printf("\nHose of %zu triangles, nearest of %d parts, ms a step\n", mesh.triangles().size(),
              parts);
  std::printf("| | ms | of Scene::nearest |\n| --- | ---: | ---: |\n");
  const auto print = [&](const char* name, const std::vector<double>& times) {
    std::printf("| %s | %.3g | %.3g |\n", name, median(times), median(times) / median(of_nearest));
  };
  print("update of the hose and the scene", of_update);
  print("Scene::nearest at the end", of_nearest);
  print("Scene::leastDistance over the step", of_motion);
  std::printf("| updates and Scene::nearest at %d times | %.3g | %.3g |\n", samples,
              median(of_samples), median(of_samples) / median(of_nearest));
  std::printf("Of the last body in a step: %zu tests of boxes, %zu distances of pairs\n",
              box_tests / std::size_t(steps), pair_times / std::size_t(steps));
}

// ---- The longest ordinary inputs ----------------------------------------------------------------

Pose at(double x, double y, double z) {
  Pose pose = Pose::Identity();
  pose.translation() = Point(x, y, z);
  return pose;
}
Pose turned(double angle, const Point& axis, const Point& to) {
  Pose pose = at(to[0], to[1], to[2]);
  pose.linear() = Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
  return pose;
}

/// One row: the least distance, and beside it the distance at the start.
void row(const char* name, const DeformableMesh& a, const DeformableMesh& b, const Pose& a_from,
         const Pose& a_to, const Pose& b_from, const Pose& b_to, double tolerance,
         FramePath path = FramePath::Straight) {
  std::vector<double> of_motion, of_start;
  MotionClearance least;
  double start = 0;
  for (int i = 0; i < 5; ++i) {
    of_motion.push_back(milliseconds([&] {
      least = adaptive_bvh::leastDistance(Motion::rigid(a, a_from, a_to, path),
                                          Motion::rigid(b, b_from, b_to, path), tolerance);
    }));
    fcl::DistanceResultd result;
    of_start.push_back(milliseconds([&] {
      start = adaptive_bvh::distance(&a, a_from, &b, b_from, fcl::DistanceRequestd(), result);
    }));
  }
  require(least.lower <= start * (1 + 1e-12), name);
  std::printf("| %s | %.5g | %zu | %zu | %.3g | %.3g |\n", name, least.upper, least.box_tests,
              least.pair_times, median(of_motion), median(of_start));
}

void ordinary() {
  const DeformableMesh sheet(plate(100)), large(plate(200)), shaft(tube(0.15)), sleeve(tube(0.18));
  const Pose still = Pose::Identity(), end = turned(0.3, Point::UnitX(), Point(0.01, 0, 0));
  std::printf("\nLongest ordinary inputs of 20,000 triangles each (large: 80,000)\n");
  std::printf("| | least | tests of boxes | distances of pairs | ms | ms at the start alone |\n");
  std::printf("| --- | ---: | ---: | ---: | ---: | ---: |\n");
  row("plates that stand still", sheet, sheet, still, still, at(0, 0, 0.3), at(0, 0, 0.3), 1e-5);
  row("the same, large", large, large, still, still, at(0, 0, 0.3), at(0, 0, 0.3), 1e-5);
  row("plates that move together", sheet, sheet, still, at(1, 2, 3), at(0, 0, 0.3), at(1, 2, 3.3),
      1e-5);
  row("plates that slide along each other", sheet, sheet, still, still, at(-3, 0, 0.01),
      at(5, 0.3, 0.01), 1e-5);
  row("the same, large", large, large, still, still, at(-3, 0, 0.01), at(5, 0.3, 0.01), 1e-5);
  row("plates far apart", sheet, sheet, still, still, at(0.1, 0, 1e4), at(0.2, 0, 1e4), 1e-5);
  row("plates that coincide", sheet, sheet, still, still, still, at(0.2, 0, 0), 1e-5);
  row("a shaft in its sleeve, still", shaft, sleeve, still, still, still, still, 1e-4);
  row("a shaft that turns in its sleeve", shaft, sleeve, still, end, still, still, 1e-4,
      FramePath::Screw);
  row("a tube that turns above a plate", shaft, sheet, still,
      turned(3, Point(0, 1, 1), Point::Zero()), at(0, 0, 3), at(0, 0, 3), 1e-5, FramePath::Screw);
}

/// A cable with itself.
void itself(int steps) {
  const Mesh first = hoseAt(0);
  DeformableMesh mesh(first);
  double of_lists = 0;
  std::unique_ptr<adaptive_bvh::SurfaceNeighbourhood> near;
  of_lists = milliseconds([&] {
    near = std::make_unique<adaptive_bvh::SurfaceNeighbourhood>(
        adaptive_bvh::SurfaceNeighbourhood::byDistance(mesh, 0.6));
  });
  adaptive_bvh::Ignored ignored;
  ignored.surface = near.get();
  std::vector<double> times;
  MotionClearance least;
  for (int step = 1; step <= steps; ++step) {
    mesh.updateTwoFrames(hoseAt(0.02 * step).vertices);
    times.push_back(milliseconds([&] {
      least = adaptive_bvh::selfLeastDistance(adaptive_bvh::Motion(mesh), ignored, kTolerance);
    }));
  }
  std::printf(
      "\nHose with itself beyond 0.6 along the surface: %.3g ms a step (neighbourhood: %.3g ms "
      "once, %zu kB); least %.4g, %zu tests of boxes, %zu distances of pairs\n",
      median(times), of_lists, near->bytes() / 1000, least.upper, least.box_tests,
      least.pair_times);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Clearance over a motion");
  int parts = 600, steps = 40, samples = 20;
  app.add_option("--parts", parts, "parts around the hose");
  app.add_option("--steps", steps, "steps of the hose");
  app.add_option("--samples", samples, "times of a step that are sampled");
  bool only_hose = false;
  app.add_flag("--only-hose", only_hose, "leave out the longest ordinary inputs");
  CLI11_PARSE(app, argc, argv);
  hose(parts, steps, samples);
  if (only_hose) return failed ? 1 : 0;
  itself(std::min(steps, 10));
  ordinary();
  return failed ? 1 : 0;
}
