// The smallest use: the type's name is all that differs from plain FCL.
#include <cmath>
#include <cstdio>

#include <fcl/narrowphase/distance.h>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "page.h"

using Model = adaptive_bvh::AdaptiveBVHModel<fcl::RSSd>;  // was: fcl::BVHModel<fcl::RSSd>
using Point = fcl::Vector3d;

// A sheet of 20 x 20 cells that waves; t is the time.
std::vector<Point> sheet(double t) {
  std::vector<Point> points;
  for (int j = 0; j <= 20; ++j)
    for (int i = 0; i <= 20; ++i) {
      const double x = 0.05 * i, y = 0.05 * j;
      points.emplace_back(x, y, 0.1 * std::sin(6 * x + t) * std::cos(4 * y));
    }
  return points;
}

int main(int argc, char** argv) {
  std::vector<fcl::Triangle> triangles;
  for (std::size_t j = 0; j < 20; ++j)
    for (std::size_t i = 0; i < 20; ++i) {
      const std::size_t v = 21 * j + i;
      triangles.emplace_back(v, v + 1, v + 22);
      triangles.emplace_back(v, v + 22, v + 21);
    }

  Model cloth, floor;
  for (Model* model : {&cloth, &floor}) {
    model->beginModel();
    model->addSubModel(sheet(0), triangles);
    model->endModel();
  }
  fcl::Transform3d below = fcl::Transform3d::Identity();
  below.translation().z() = -0.5;
  Page page(argc, argv, "A waving cloth above a floor");
  page.add(cloth, fcl::Transform3d::Identity(), "cloth");
  page.add(floor, below, "floor");

  for (int step = 1; step <= 10; ++step) {
    cloth.beginReplaceModel();
    cloth.replaceSubModel(sheet(0.02 * step));
    cloth.endReplaceModel();  // FCL would now refit 1,599 volumes, and wrongly: see README

    fcl::DistanceResultd result;
    fcl::distance(&cloth, fcl::Transform3d::Identity(), &floor, below, fcl::DistanceRequestd(true),
                  result);
    page.frame(result);
    std::printf("step %2d: distance %.6f, %4d of %d volumes refitted\n", step, result.min_distance,
                cloth.lastUpdate().refitted(), cloth.lastUpdate().nodes);
  }
  page.write();
}
