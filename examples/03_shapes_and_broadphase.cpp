// A deforming gripper pad among rigid shapes: a broad-phase manager finds the candidates, recorded
// collision decides. After an update FCL's cached boxes must be brought up to date: refresh.
#include <cmath>
#include <cstdio>

#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/sphere.h>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/broadphase.h"
#include "adaptive_bvh/query.h"
#include "page.h"

using Model = adaptive_bvh::AdaptiveBVHModeld;
using Object = fcl::CollisionObjectd;
using Point = fcl::Vector3d;

// A pad of 16 x 16 cells that closes around its middle as t goes from 0 to 1.
std::vector<Point> pad(double t) {
  std::vector<Point> points;
  for (int j = 0; j <= 16; ++j)
    for (int i = 0; i <= 16; ++i) {
      const double u = i / 8. - 1, v = j / 8. - 1;  // in [-1, 1]
      const double bend = 1.2 * t * u;
      points.emplace_back(std::sin(bend + 1e-9 * u) / (1.2 * t + 1e-9), v,
                          (1 - std::cos(bend)) / (1.2 * t + 1e-9));
    }
  return points;
}

// The manager calls this for every pair whose boxes overlap.
bool narrowPhase(Object* a, Object* b, void* contacts) {
  const fcl::CollisionRequestd all(1000, true);
  adaptive_bvh::collide(a, b, all, *static_cast<fcl::CollisionResultd*>(contacts));
  return false;  // go on with the next pair
}

int main(int argc, char** argv) {
  std::vector<fcl::Triangle> triangles;
  for (std::size_t j = 0; j < 16; ++j)
    for (std::size_t i = 0; i < 16; ++i) {
      const std::size_t v = 17 * j + i;
      triangles.emplace_back(v, v + 1, v + 18);
      triangles.emplace_back(v, v + 18, v + 17);
    }
  auto model = std::make_shared<Model>();
  model->beginModel();
  model->addSubModel(pad(0), triangles);
  model->endModel();
  Object gripper(model);

  const auto at = [](double x, double y, double z) -> fcl::Transform3d {
    return fcl::Transform3d(Eigen::Translation3d(x, y, z));
  };
  Object ball(std::make_shared<fcl::Sphered>(0.2), at(0, 0.4, 0.3));
  Object pin(std::make_shared<fcl::Cylinderd>(0.1, 0.8), at(0.9, -0.3, 0.6));
  Object bin(std::make_shared<fcl::Boxd>(4, 4, 0.1), at(0, 0, -0.3));

  fcl::DynamicAABBTreeCollisionManagerd manager;
  for (Object* object : {&gripper, &ball, &pin, &bin}) manager.registerObject(object);
  manager.setup();

  Page page(argc, argv, "A gripper pad among shapes");
  page.add(*model, gripper.getTransform(), "pad");
  page.add(fcl::Sphered(0.2), ball.getTransform(), "ball");
  page.add(fcl::Cylinderd(0.1, 0.8), pin.getTransform(), "pin");
  page.add(fcl::Boxd(4, 4, 0.1), bin.getTransform(), "bin");
  for (int step = 1; step <= 10; ++step) {
    model->update(pad(0.1 * step));
    adaptive_bvh::refresh(gripper, manager);
    fcl::CollisionResultd contacts;
    manager.collide(&contacts, narrowPhase);
    std::printf("step %2d: %3zu contacts, %3d volumes refitted\n", step, contacts.numContacts(),
                model->lastUpdate().refitted());
    page.frame(contacts);
  }
  page.write();
}
