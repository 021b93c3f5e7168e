// How close does a flexing hose come to the duct that it lies in? The clearance of every vertex,
// and the step in which it is least as a mesh in colours: red where it is tight, green where it is
// not.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>

#include "adaptive_bvh/proximity.h"
#include "page.h"

using Mesh = adaptive_bvh::DeformableMesh;
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

Mesh meshOf(const std::vector<Point>& points) {
  std::vector<fcl::Triangle> triangles;
  for (std::size_t j = 0; j < kAlong; ++j)
    for (std::size_t i = 0; i < kAround; ++i) {
      const std::size_t a = j * kAround + i, b = j * kAround + (i + 1) % kAround;
      triangles.emplace_back(a, b, b + kAround);
      triangles.emplace_back(a, b + kAround, a + kAround);
    }
  return Mesh(points, triangles);
}

void write(const char* path, const Mesh& mesh, const std::vector<double>& clearance) {
  std::ofstream out(path);
  out << "ply\nformat ascii 1.0\nelement vertex " << mesh.vertices().size()
      << "\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\n"
         "property uchar green\nproperty uchar blue\nelement face "
      << mesh.triangles().size() << "\nproperty list uchar int vertex_indices\nend_header\n";
  for (std::size_t v = 0; v < clearance.size(); ++v) {
    const int green = int(255 * clearance[v] / kLimit);
    out << mesh.vertices()[v].transpose() << ' ' << 255 - green << ' ' << green << " 60\n";
  }
  for (const fcl::Triangle& t : mesh.triangles())
    out << "3 " << t[0] << ' ' << t[1] << ' ' << t[2] << '\n';
}

int main(int argc, char** argv) {
  Mesh hose = meshOf(pipe(0.1, 0));
  const Mesh duct = meshOf(pipe(0.25, 0));
  const fcl::Transform3d origin = fcl::Transform3d::Identity();
  Page page(argc, argv, "The clearance of a hose in a duct");
  page.add(hose, origin, "hose");
  std::vector<double> clearance;
  for (int step = 0; step <= 10; ++step) {
    hose.update(pipe(0.1, 0.014 * step));
    adaptive_bvh::vertexDistances(hose, origin, duct, origin, kLimit, clearance);
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
