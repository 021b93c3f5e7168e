// A sheet of cloth that is folded over until it goes through itself: which triangles meet?
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "adaptive_bvh/self_collision.h"
#include "page.h"

using Point = fcl::Vector3d;

constexpr std::size_t kCells = 40;
constexpr std::size_t kShown = 5;  // pairs to print for each step

// The half y > 0.5 of a wavy unit square, folded over by an angle.
std::vector<Point> sheet(double angle) {
  std::vector<Point> points;
  for (std::size_t j = 0; j <= kCells; ++j)
    for (std::size_t i = 0; i <= kCells; ++i) {
      const double x = double(i) / kCells, y = double(j) / kCells - 0.5;
      const double wave = 0.02 * std::sin(9 * x);
      if (y > 0)
        points.emplace_back(x, 0.5 + y * std::cos(angle), wave + y * std::sin(angle));
      else
        points.emplace_back(x, 0.5 + y, wave + 0.05 * std::sin(10 * y));
    }
  return points;
}

int main(int argc, char** argv) {
  std::vector<fcl::Triangle> triangles;
  for (std::size_t j = 0; j < kCells; ++j)
    for (std::size_t i = 0; i < kCells; ++i) {
      const std::size_t v = (kCells + 1) * j + i;
      triangles.emplace_back(v, v + 1, v + kCells + 2);
      triangles.emplace_back(v, v + kCells + 2, v + kCells + 1);
    }
  adaptive_bvh::DeformableMesh mesh(sheet(0), triangles);

  Page page(argc, argv, "A sheet that is folded through itself");
  page.add(mesh, fcl::Transform3d::Identity(), "sheet");
  const fcl::CollisionRequestd all(1000000, true);
  for (int degrees = 0; degrees <= 195; degrees += 15) {
    const double moved = mesh.update(sheet(degrees * M_PI / 180)).largest_displacement;
    fcl::CollisionResultd result;
    selfCollide(mesh, all, result);
    std::printf("folded by %3d degrees: %4zu pairs of triangles meet, moved by %.3f\n", degrees,
                result.numContacts(), moved);
    for (std::size_t i = 0; i < std::min<std::size_t>(kShown, result.numContacts()); ++i)
      std::printf("  triangle %ld meets triangle %ld\n", long(result.getContact(i).b1),
                  long(result.getContact(i).b2));
    if (result.numContacts() > kShown)
      std::printf("  ... and %zu more pairs\n", result.numContacts() - kShown);
    page.note("Folded by " + std::to_string(degrees) + " degrees");
    page.frame(result);
  }
  page.write();
}
