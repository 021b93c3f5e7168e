// A cloth falls on a ball and drapes over it. A simple solver (springs, ten iterations of
// Jacobi's method a step) proposes positions; a trust region keeps every iterate free of crossings.
#include <cmath>
#include <cstdio>

#include "adaptive_bvh/query.h"
#include "adaptive_bvh/self_collision.h"
#include "adaptive_bvh/trust_region.h"
#include "page.h"

using Mesh = adaptive_bvh::DeformableMesh;
using Point = fcl::Vector3d;
using Points = std::vector<Point>;

constexpr std::size_t kCells = 20;
constexpr double kTime = 0.01, kStiffness = 2;  // of a step; of springs, relative to the inertia

// A grid of cells over the unit square, mapped by `place`.
template <typename Place>
Mesh grid(Place&& place) {
  Points points;
  std::vector<fcl::Triangle> triangles;
  for (std::size_t j = 0; j <= kCells; ++j)
    for (std::size_t i = 0; i <= kCells; ++i)
      points.push_back(place(double(i) / kCells, double(j) / kCells));
  for (std::size_t j = 0; j < kCells; ++j)
    for (std::size_t i = 0; i < kCells; ++i) {
      const std::size_t v = (kCells + 1) * j + i;
      triangles.emplace_back(v, v + 1, v + kCells + 2);
      triangles.emplace_back(v, v + kCells + 2, v + kCells + 1);
    }
  return Mesh(points, triangles);
}

// Where each vertex would come to rest if the others stayed: between its inertia and its springs,
// whose lengths are those of the cloth at `rest`.
Points proposal(const Mesh& cloth, const Points& rest, const Points& inertial, const Points& now) {
  Points sum = inertial;
  std::vector<double> weights(now.size(), 1);
  for (const fcl::Triangle& t : cloth.triangles())
    for (int k = 0; k < 3; ++k) {
      const std::size_t a = t[k], b = t[(k + 1) % 3];
      const Point along = (now[a] - now[b]).normalized() * (rest[a] - rest[b]).norm();
      sum[a] += kStiffness * (now[b] + along);
      sum[b] += kStiffness * (now[a] - along);
      weights[a] += kStiffness;
      weights[b] += kStiffness;
    }
  for (std::size_t v = 0; v < sum.size(); ++v) sum[v] /= weights[v];
  return sum;
}

int main(int argc, char** argv) {
  const fcl::Transform3d still = fcl::Transform3d::Identity();
  Mesh cloth = grid(
      [](double x, double y) { return Point(x - 0.45, y - 0.45, 0.4 + 0.01 * std::sin(7 * x)); });
  const Mesh ball = grid([](double u, double v) {
    const double a = 2 * M_PI * u, b = M_PI * (0.02 + 0.96 * v);
    return Point(0.25 * std::sin(b) * std::cos(a), 0.25 * std::sin(b) * std::sin(a),
                 0.25 * std::cos(b));
  });
  adaptive_bvh::TrustRegionRequest request;
  request.radius = 0.02;     // less than half of an edge
  request.distance = 0.001;  // the thickness of the cloth
  adaptive_bvh::TrustRegion region(cloth, request);
  region.addObstacle(ball);

  const Points rest = cloth.vertices();
  Points now = rest, velocity(rest.size(), Point::Zero());
  std::size_t held_back = 0, searches = 0, crossings = 0;
  Page page(argc, argv, "A cloth that falls on a ball, in a trust region");
  page.add(cloth, still, "cloth");
  page.add(ball, still, "ball");
  for (int step = 1; step <= 300; ++step) {
    const Points before = now;
    Points inertial = now;
    for (std::size_t v = 0; v < now.size(); ++v)
      inertial[v] += kTime * (velocity[v] + kTime * Point(0, 0, -9.81));
    region.begin(now);
    for (int iteration = 0; iteration < 10; ++iteration) {
      const auto report =
          region.truncate(iteration == 0 ? inertial : proposal(cloth, rest, inertial, now), now);
      held_back += report.held_back;
      searches += report.has_searched;
    }
    for (std::size_t v = 0; v < now.size(); ++v) velocity[v] = 0.98 * (now[v] - before[v]) / kTime;
    cloth.update(now);
    fcl::CollisionResultd result;
    crossings += selfCollide(cloth, fcl::CollisionRequestd(), result);
    crossings +=
        adaptive_bvh::collide(&cloth, still, &ball, still, fcl::CollisionRequestd(), result);
    if (step % 50 == 0)
      std::printf("step %3d: lowest vertex at %6.3f, held back %zu times in %zu more searches\n",
                  step, cloth.aabb_local.min_[2], held_back, searches);
    if (step % 5 == 0) page.frame();
  }
  std::printf("300 steps, %zu crossings\n", crossings);
  page.write();
}
