// One call of the library, for architecture.py, which reads from the counters of --coverage which
// files it ran: flows FLOW
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/deformable_mesh.h"
#include "adaptive_bvh/mesh.h"
#include "adaptive_bvh/penetration.h"
#include "adaptive_bvh/proximity.h"
#include "adaptive_bvh/query.h"
#include "adaptive_bvh/scene.h"
#include "adaptive_bvh/self_collision.h"

extern "C" void __gcov_reset(void);
extern "C" void __gcov_dump(void);

namespace {

using Mesh = adaptive_bvh::TriangleMesh;
using Positions = std::vector<fcl::Vector3d>;

/// A torus that is dented, so that nothing of it is flat. `phase` moves the dents.
Mesh torus(double phase) {
  constexpr std::size_t kAround = 40, kAcross = 20;
  Mesh mesh;
  for (std::size_t i = 0; i < kAround; ++i)
    for (std::size_t j = 0; j < kAcross; ++j) {
      const double u = 2 * M_PI * double(i) / kAround, v = 2 * M_PI * double(j) / kAcross,
                   r = 0.4 + 0.05 * std::sin(3 * u + phase) * std::cos(2 * v);
      mesh.vertices.emplace_back((1 + r * std::cos(v)) * std::cos(u),
                                 (1 + r * std::cos(v)) * std::sin(u), r * std::sin(v));
      const std::size_t i2 = (i + 1) % kAround, j2 = (j + 1) % kAcross;
      const auto at = [](std::size_t a, std::size_t b) { return a * kAcross + b; };
      mesh.triangles.emplace_back(at(i, j), at(i2, j), at(i2, j2));
      mesh.triangles.emplace_back(at(i, j), at(i2, j2), at(i, j2));
    }
  return mesh;
}

fcl::Transform3d aside(double x) {
  fcl::Transform3d tf = fcl::Transform3d::Identity();
  tf.linear() = Eigen::AngleAxisd(0.7, fcl::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  tf.translation() = fcl::Vector3d(x, 0.1, 0.2);
  return tf;
}

/// Runs one call; what is made before it does not count.
void count(const std::function<void()>& call) {
  __gcov_reset();
  call();
  __gcov_dump();
  std::_Exit(0);
}

/// One that meets itself: the dents are deeper than the tube.
Mesh crossing() {
  Mesh mesh = torus(0);
  for (fcl::Vector3d& x : mesh.vertices) x[2] *= std::sin(4 * x[0]);
  return mesh;
}

const fcl::Transform3d kOrigin = fcl::Transform3d::Identity();

const std::map<std::string, std::function<void()>> kFlows = {
    {"update of a DeformableMesh",
     [] {
       adaptive_bvh::DeformableMesh mesh(torus(0));
       const Positions next = torus(0.5).vertices;
       count([&] { mesh.update(next); });
     }},
    {"update of an AdaptiveBVHModel",
     [] {
       adaptive_bvh::AdaptiveBVHModeld model;
       adaptive_bvh::fillModel(torus(0), model);
       model.update(torus(0.1).vertices);
       const Positions next = torus(0.9).vertices;
       count([&] { model.update(next); });
     }},
    {"distance of two DeformableMeshes",
     [] {
       const adaptive_bvh::DeformableMesh first(torus(0)), second(torus(1));
       fcl::DistanceRequestd request;
       fcl::DistanceResultd result;
       const fcl::Transform3d tf = aside(3);
       count([&] { adaptive_bvh::distance(&first, kOrigin, &second, tf, request, result); });
     }},
    {"self-collision",
     [] {
       const adaptive_bvh::DeformableMesh mesh(crossing());
       fcl::CollisionRequestd request(100000, true);
       fcl::CollisionResultd result;
       count([&] { adaptive_bvh::selfCollide(mesh, request, result); });
     }},
    {"nearness query, isNearer",
     [] {
       const adaptive_bvh::DeformableMesh first(torus(0)), second(torus(1));
       const fcl::Transform3d tf = aside(2.75);
       count([&] { adaptive_bvh::isNearer(first, kOrigin, second, tf, 0.06); });
     }},
    {"collision query of a Scene",
     [] {
       const adaptive_bvh::DeformableMesh first(torus(0)), second(torus(1));
       adaptive_bvh::Scene scene;
       scene.add(first);
       scene.add(second, aside(1.5));
       scene.update();
       adaptive_bvh::SceneCollisions found;
       count([&] { scene.collide({}, found); });
     }},
    {"signed distance of two DeformableMeshes",
     [] {
       const adaptive_bvh::DeformableMesh first(torus(0)), second(torus(1));
       const fcl::Transform3d tf = aside(2.3);
       count([&] { adaptive_bvh::signedDistance(first, kOrigin, second, tf, 1e-3); });
     }},
};

}  // namespace

int main(int argc, char** argv) {
  const auto flow = argc == 2 ? kFlows.find(argv[1]) : kFlows.end();
  if (flow != kFlows.end()) flow->second();
  for (const auto& [name, run] : kFlows) std::printf("%s\n", name.c_str());
  return argc == 1 ? 0 : 2;
}
