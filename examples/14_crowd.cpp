// Many soft bodies that move, deform and touch: which pairs touch, with how many contacts, and how
// long a step takes.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>
#include <random>

#include "adaptive_bvh/scene.h"
#include "page.h"

using Mesh = adaptive_bvh::DeformableMesh;
using Point = fcl::Vector3d;

constexpr int kAround = 16, kRings = 10, kBlobs = 100;

// A ball that is squeezed along a direction by up to a fifth.
std::vector<Point> blobAt(double squeeze, const Point& along) {
  std::vector<Point> points = {{0, 0, 1}, {0, 0, -1}};
  for (int r = 1; r <= kRings; ++r)
    for (int i = 0; i < kAround; ++i) {
      const double polar = M_PI * r / (kRings + 1), angle = 2 * M_PI * i / kAround;
      points.emplace_back(std::sin(polar) * std::cos(angle), std::sin(polar) * std::sin(angle),
                          std::cos(polar));
    }
  for (Point& x : points) x -= 0.2 * squeeze * along.dot(x) * along;
  return points;
}
std::vector<fcl::Triangle> blobTriangles() {
  std::vector<fcl::Triangle> triangles;
  const auto at = [](int ring, int i) { return std::size_t(2 + ring * kAround + i % kAround); };
  for (int i = 0; i < kAround; ++i) {
    triangles.emplace_back(0, at(0, i), at(0, i + 1));
    triangles.emplace_back(1, at(kRings - 1, i + 1), at(kRings - 1, i));
    for (int r = 0; r + 1 < kRings; ++r) {
      triangles.emplace_back(at(r, i), at(r + 1, i), at(r + 1, i + 1));
      triangles.emplace_back(at(r, i), at(r + 1, i + 1), at(r, i + 1));
    }
  }
  return triangles;
}

struct Blob {
  std::shared_ptr<Mesh> mesh;
  Point home, along;
  adaptive_bvh::BodyId id;

  fcl::Transform3d poseAt(double time) const {
    fcl::Transform3d tf = fcl::Transform3d::Identity();
    tf.translation() = home + 0.8 * std::sin(time + home[0]) * along;
    return tf;
  }
};

int main(int argc, char** argv) {
  adaptive_bvh::Scene scene;
  std::mt19937 random(5);
  std::uniform_real_distribution<double> any(-1, 1);
  std::vector<Blob> blobs;
  Page page(argc, argv, "A crowd of soft bodies");
  for (int i = 0; i < kBlobs; ++i) {
    Blob blob{nullptr, 7 * Point(any(random), any(random), any(random)),
              Point(any(random), any(random), any(random)).normalized(), 0};
    blob.mesh = std::make_shared<Mesh>(blobAt(0, blob.along), blobTriangles());
    blob.id = scene.add(blob.mesh, blob.poseAt(0));
    blobs.push_back(blob);
  }
  page.follow(scene);
  std::printf("step  touching pairs  contacts  ms\n");
  adaptive_bvh::SceneCollisions found;
  for (int step = 0; step <= 20; ++step) {
    const auto start = std::chrono::steady_clock::now();
    for (const Blob& blob : blobs) {
      blob.mesh->update(blobAt(std::sin(0.3 * step + blob.home[1]), blob.along));
      scene.setTransform(blob.id, blob.poseAt(0.1 * step));
    }
    scene.update();
    scene.collide({}, found);
    const std::chrono::duration<double, std::milli> passed =
        std::chrono::steady_clock::now() - start;
    if (step % 5 == 0)
      std::printf("%4d  %14zu  %8zu  %.2f\n", step, found.pairs.size(), found.contacts.size(),
                  passed.count());
    page.frame(found);
  }
  page.write();
}
