// A hose swings between the parts of an engine bay. In each step the scene says which part is
// nearest and how far away it is, and which parts the hose touches.
#include <cmath>
#include <cstdio>
#include <memory>
#include <random>

#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/sphere.h>

#include "adaptive_bvh/scene.h"
#include "page.h"

using Mesh = adaptive_bvh::DeformableMesh;
using Point = fcl::Vector3d;

constexpr int kAround = 16, kAlong = 200;

// A hose of radius 0.15 that sags and swings.
std::vector<Point> hoseAt(double time) {
  std::vector<Point> points;
  for (int j = 0; j <= kAlong; ++j)
    for (int i = 0; i < kAround; ++i) {
      const double along = double(j) / kAlong, angle = 2 * M_PI * i / kAround;
      const Point middle(12 * along - 6, std::sin(4 * along + time), std::cos(3 * along + time));
      points.push_back(middle + 0.15 * Point(0, std::cos(angle), std::sin(angle)));
    }
  return points;
}

Mesh hose() {
  std::vector<fcl::Triangle> triangles;
  for (std::size_t j = 0; j < kAlong; ++j)
    for (std::size_t i = 0; i < kAround; ++i) {
      const std::size_t a = kAround * j + i, b = kAround * j + (i + 1) % kAround;
      triangles.emplace_back(a, b, b + kAround);
      triangles.emplace_back(a, b + kAround, a + kAround);
    }
  return Mesh(hoseAt(0), triangles);
}

// Boxes, cylinders and balls, everywhere but near the hose's rest.
std::shared_ptr<fcl::CollisionGeometryd> part(int i) {
  switch (i % 3) {
    case 0: return std::make_shared<fcl::Boxd>(0.6, 0.4, 0.5);
    case 1: return std::make_shared<fcl::Cylinderd>(0.25, 0.8);
    default: return std::make_shared<fcl::Sphered>(0.3);
  }
}

int main(int argc, char** argv) {
  Mesh mesh = hose();
  adaptive_bvh::Scene scene;
  const adaptive_bvh::BodyId id = scene.add(mesh);
  adaptive_bvh::BodyOptions of_part;  // parts pair with the hose, not with each other
  of_part.group = 2;
  of_part.mask = 1;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any(-1, 1);
  for (int i = 0; i < 60; ++i) {
    fcl::Transform3d tf = fcl::Transform3d::Identity();
    tf.translation() = Point(6 * any(random), 0, 0);
    const double angle = M_PI * any(random), off = 2 + 0.8 * any(random);
    tf.translation() += off * Point(0, std::cos(angle), std::sin(angle));
    scene.add(part(i), tf, of_part);
  }
  Page page(argc, argv, "A hose in an engine bay");
  page.follow(scene);
  adaptive_bvh::SceneCollisionRequest pairs_only;
  pairs_only.contacts_per_pair = 0;
  adaptive_bvh::SceneCollisions touching;
  for (int step = 1; step <= 40; ++step) {
    mesh.update(hoseAt(0.05 * step));
    scene.update();
    const auto nearest = scene.nearest(id);
    scene.collide(pairs_only, touching);
    page.note("Nearest to the hose: body " + std::to_string(nearest.bodies.second));
    page.frame(nearest);
    if (step % 5 == 0)
      std::printf("step %2d: nearest is part %2u at %.4f, %zu parts touch\n", step,
                  nearest.bodies.second, nearest.distance, touching.pairs.size());
  }
  page.write();
}
