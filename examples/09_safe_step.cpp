// A sheet of cloth falls onto a ball. Each step moves it only so far that nothing touches; what
// would have touched first is printed.
#include <cmath>
#include <cstdio>

#include "adaptive_bvh/continuous_collision.h"
#include "page.h"

using Mesh = adaptive_bvh::DeformableMesh;
using Motion = adaptive_bvh::Motion;
using Point = fcl::Vector3d;

constexpr std::size_t kCells = 30;
constexpr double kThickness = 0.01;  // the distance to keep

// A grid of cells over the unit square, mapped by `place`.
template <typename Place>
Mesh grid(Place&& place) {
  std::vector<Point> points;
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

int main(int argc, char** argv) {
  Mesh cloth = grid([](double x, double y) { return Point(x, y, 0.5 + 0.01 * std::sin(7 * x)); });
  const Mesh ball = grid([](double u, double v) {
    const double a = 2 * M_PI * u, b = M_PI * (0.02 + 0.96 * v);
    return Point(0.5 + 0.3 * std::sin(b) * std::cos(a), 0.5 + 0.3 * std::sin(b) * std::sin(a),
                 0.3 * std::cos(b));
  });
  std::vector<Point> now = cloth.vertices(), wanted;
  std::vector<double> of_cloth, of_ball;
  Page page(argc, argv, "A cloth that falls onto a ball");
  page.add(cloth, fcl::Transform3d::Identity(), "cloth");
  page.add(ball, fcl::Transform3d::Identity(), "ball");
  for (int step = 1; step <= 6; ++step) {
    wanted = now;
    for (Point& p : wanted) p[2] -= 0.06;
    const Motion fall(cloth, now, wanted), rest(ball, ball.vertices(), ball.vertices());
    const adaptive_bvh::Impact impact = earliestImpact(fall, rest, kThickness);
    const double safe = largestSafeStep(fall, rest, kThickness);
    // Once it lies on the ball, every vertex goes on as far as it alone may.
    safeDisplacements(fall, rest, kThickness, of_cloth, of_ball);
    double fallen = 0;
    for (std::size_t v = 0; v < now.size(); ++v) {
      const double share = safe > 0.01 ? safe : of_cloth[v] / 0.06;
      now[v] += share * (wanted[v] - now[v]);
      fallen += share * 0.06 / double(now.size());
    }
    cloth.update(now);
    page.frame();
    std::printf("step %d: safe up to %.3f of the step, fallen by %.4f\n", step, safe, fallen);
    const char* const kinds[] = {"vertex and triangle", "triangle and vertex", "edge and edge"};
    if (impact.exists())
      std::printf("  %s %u, %u would come together first\n", kinds[static_cast<int>(impact.kind)],
                  impact.pair.first, impact.pair.second);
  }
  page.write();
}
