// A helmet deforms above a plate: its exact distance in every step, by adaptive_bvh and by FCL.
// FCL refits every volume (top-down: its bottom-up refit is wrong for RSS), ours a tree of boxes.
// examples/tools/compare_with_fcl does the same for your meshes.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>

#include <fcl/narrowphase/distance.h>

#include "adaptive_bvh/coherent_distance.h"
#include "adaptive_bvh/deformable_mesh.h"
#include "adaptive_bvh/mesh_io.h"
#include "page.h"

using Positions = std::vector<fcl::Vector3d>;

// Squeezed from one side and bulging to the other, at time t in [0, 1].
Positions squeezed(const Positions& rest, double t) {
  const double depth = std::sin(2 * M_PI * t);
  Positions now;
  for (const auto& p : rest)
    now.emplace_back((1 - 0.2 * depth) * p[0], (1 + 0.12 * depth) * p[1], (1 - 0.1 * depth) * p[2]);
  return now;
}

template <typename Work>
double milliseconds(Work&& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
      .count();
}

int main(int argc, char** argv) {
  const std::string data = ADAPTIVE_BVH_EXAMPLE_DATA;
  const auto helmet = adaptive_bvh::loadMesh(data + "/helmet.obj");
  const auto plate = adaptive_bvh::loadMesh(data + "/plate.ply");

  adaptive_bvh::DeformableMesh our_helmet(helmet), our_plate(plate);
  fcl::BVHModel<fcl::RSSd> fcl_helmet, fcl_plate;
  fillModel(helmet, fcl_helmet);
  fillModel(plate, fcl_plate);
  adaptive_bvh::CoherentDistance pair(our_helmet, our_plate);  // follows the two over steps

  const fcl::Transform3d origin = fcl::Transform3d::Identity();
  Page page(argc, argv, "A helmet above a plate");
  page.add(our_helmet, origin, "helmet");
  page.add(our_plate, origin, "plate");
  const fcl::DistanceRequestd request(page.wanted());  // nearest points are for the page
  const int steps = 200;
  double our_time = 0, fcl_time = 0, disagreement = 0;
  for (int step = 1; step <= steps; ++step) {
    const Positions positions = squeezed(helmet.vertices, double(step) / steps);

    fcl::DistanceResultd ours, fcls;
    our_time += milliseconds([&] {
      our_helmet.update(positions);
      pair.distance(origin, origin, request, ours);
    });
    fcl_time += milliseconds([&] {
      fcl_helmet.beginReplaceModel();
      fcl_helmet.replaceSubModel(positions);
      fcl_helmet.endReplaceModel(true, false);  // refit, top-down
      fcl::distance(&fcl_helmet, origin, &fcl_plate, origin, request, fcls);
    });
    disagreement = std::max(disagreement, std::abs(ours.min_distance - fcls.min_distance));
    page.frame(ours);
    if (step % 25 == 0) std::printf("step %3d: distance %.6f\n", step, ours.min_distance);
  }
  std::printf("per step: FCL %.3f ms, adaptive_bvh %.3f ms, speed-up %.1fx\n", fcl_time / steps,
              our_time / steps, fcl_time / our_time);
  std::printf("largest disagreement with FCL %.3g\n", disagreement);
  page.write();
}
