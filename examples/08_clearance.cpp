// How close does a flexing hose come to the duct that it lies in? The clearance of every vertex,
// and the step in which it is least as a mesh in colours: red where it is tight, green where it is
// not.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>

#include "adaptive_bvh/proximity.h"
#include "page.h"

using Model = adaptive_bvh::AdaptiveBVHModeld;
using Point = fcl::Vector3d;

constexpr std::size_t kAround = 24, kAlong = 120;
constexpr double kLimit = 0.2;  // farther is not of interest

// A pipe of length 3 along x, whose middle line swings by `swing`.
std::vector<Point> pipe(double radius, double swing) {
  std::vector<Point> points;
  for (std::size_t j = 0; j <= kAlong; ++j)
    for (std::size_t i = 0; i < kAround; ++i) {
      const double x = 3. * double(j) / kAlong, angle = 2 * M_PI * double(i) / kAround;
      const double y = swing * std::sin(M_PI * x / 3) * std::sin(4 * x);
      points.emplace_back(x, y + radius * std::cos(angle), radius * std::sin(angle));
    }
  return points;
}

void build(Model& model, const std::vector<Point>& points) {
  std::vector<fcl::Triangle> triangles;
  for (std::size_t j = 0; j < kAlong; ++j)
    for (std::size_t i = 0; i < kAround; ++i) {
      const std::size_t a = j * kAround + i, b = j * kAround + (i + 1) % kAround;
      triangles.emplace_back(a, b, b + kAround);
      triangles.emplace_back(a, b + kAround, a + kAround);
    }
  model.beginModel();
  model.addSubModel(points, triangles);
  model.endModel();
}

void write(const char* path, const Model& model, const std::vector<double>& clearance) {
  std::ofstream out(path);
  out << "ply\nformat ascii 1.0\nelement vertex " << model.num_vertices
      << "\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\n"
         "property uchar green\nproperty uchar blue\nelement face "
      << model.num_tris << "\nproperty list uchar int vertex_indices\nend_header\n";
  for (int v = 0; v < model.num_vertices; ++v) {
    const int green = int(255 * clearance[std::size_t(v)] / kLimit);
    out << model.vertices[v].transpose() << ' ' << 255 - green << ' ' << green << " 60\n";
  }
  for (int t = 0; t < model.num_tris; ++t)
    out << "3 " << model.tri_indices[t][0] << ' ' << model.tri_indices[t][1] << ' '
        << model.tri_indices[t][2] << '\n';
}

int main(int argc, char** argv) {
  Model hose, duct;
  build(hose, pipe(0.1, 0));
  build(duct, pipe(0.25, 0));
  const fcl::Transform3d origin = fcl::Transform3d::Identity();
  Page page(argc, argv, "The clearance of a hose in a duct");
  page.add(hose, origin, "hose");
  std::vector<double> clearance;
  for (int step = 0; step <= 10; ++step) {
    hose.update(pipe(0.1, 0.014 * step));
    adaptive_bvh::clearance(hose, origin, duct, origin, kLimit, clearance);
    const double now = *std::min_element(clearance.begin(), clearance.end());
    const auto near =
        std::count_if(clearance.begin(), clearance.end(), [](double c) { return c < 0.05; });
    std::printf("step %2d: clearance %.6f, %4ld vertices nearer than 0.05\n", step, now,
                long(near));
    page.paint(0, clearance);
    page.frame();
  }
  page.write();
  if (argc == 2) write(argv[1], hose, clearance);
}
