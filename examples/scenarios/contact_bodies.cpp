#include "contact_bodies.h"

#include <cmath>

#include "bodies.h"

namespace scenarios {
namespace {

Point coil(const Point& rest, double t) {
  const double along = -rest[2], turn = (2 + 12 * t) * along;
  const double radius = 1 - 0.2 * t + rest[0];
  return {radius * std::cos(turn), radius * std::sin(turn), 0.3 * along + rest[1]};
}

/// By less than half of the size.
Point crumple(const Point& rest, double t) {
  const double a = 37 * rest[0], b = 41 * rest[1];
  return rest + 0.1 * t * Point(std::sin(3 * a + b), std::cos(a - 2 * b), std::sin(a * b));
}

constexpr double kRodRadius = 0.1, kRodLength = 4;
/// A rod's axis from the planes in which it meets its neighbours: it is flattened there.
constexpr double kRodFlat = 0.95 * kRodRadius;
/// The same rod in its rest position, so far away that the signs of a vertex identify its rod.
constexpr double kRodOffset = 2 * kRodRadius;
constexpr int kRodFrames = 21;  // odd: in no frame do the rods touch without a gap or a depth

/// Between two rods, at the height z over their middle; negative where they press.
double rodGap(double z, double t) {
  constexpr double kLargestGap = 1e-6, kLargestDepth = 1e-3, kWave = 1e-4;
  const double least = t < 0.5 ? kLargestGap * (1 - 2 * t) : kLargestDepth * (1 - 2 * t);
  return least + kWave * std::pow(std::sin(4 * M_PI * (z / kRodLength + 0.5)), 2);
}

/// Cross sections stay in their planes, so that what is apart in every plane is apart.
Point twistRod(const Point& rest, double t) {
  const double z = rest[2] + kRodLength / 2, gap = rodGap(z, t);
  const auto placed = [&](double x) {
    const double from_axis = std::max(std::abs(x) - kRodOffset, -kRodFlat);
    return std::copysign(1, x) * (from_axis + kRodFlat + gap / 2);
  };
  const double turn = 2 * M_PI * (3 + 0.5 * t) * z / kRodLength;
  const double x = placed(rest[0]), y = placed(rest[1]);
  return {x * std::cos(turn) - y * std::sin(turn), x * std::sin(turn) + y * std::cos(turn), z};
}

Mesh mirrored(Mesh mesh) {
  for (Point& p : mesh.vertices) p[1] = -p[1];
  for (fcl::Triangle& t : mesh.triangles) t.set(t[0], t[2], t[1]);
  return mesh;
}

/// One rod for each pair of signs. A vertex of one faces a vertex of the next, as 8 around are
/// divisible by 4, and one rod is the mirror image of the next, diagonals included: so their
/// surfaces are as far apart between their vertices as at these. The least gaps are at vertices,
/// as 80 along are divisible by 4.
Mesh rods(int resolution, const std::vector<Point>& signs) {
  const Mesh rod = tube(8 * resolution, 80 * resolution, kRodRadius, kRodLength);
  const Mesh image = mirrored(rod);
  Mesh all;
  for (const Point& sign : signs) {
    const Mesh& one = sign[0] * sign[1] > 0 ? rod : image;
    const std::size_t first = all.vertices.size();
    for (const Point& p : one.vertices) all.vertices.push_back(p + kRodOffset * sign);
    for (const fcl::Triangle& t : one.triangles)
      all.triangles.emplace_back(first + t[0], first + t[1], first + t[2]);
  }
  return all;
}

}  // namespace

Body coilingCable(int resolution) {
  return {"coiling cable", tube(9 * resolution, 10 * resolution, 0.13, 1), 40, coil};
}
Body crumpledSheet(int resolution) {
  return {"crumpled sheet", grid(9 * resolution, 9 * resolution, 1, 1), 20, crumple};
}
Body pressedRods(int resolution) {
  return {"pressed rods", rods(resolution, {{1, 1, 0}, {-1, -1, 0}, {1, -1, 0}, {-1, 1, 0}}),
          kRodFrames, twistRod};
}

Scenario pressedRodsPair(const Options& options) {
  const int s = options.resolution;
  const Scenario scenario = {
      "pressed rods",
      {"two rods", rods(s, {{1, 1, 0}, {-1, -1, 0}}), kRodFrames, twistRod},
      {"the other two", rods(s, {{1, -1, 0}, {-1, 1, 0}}), kRodFrames, twistRod}};
  return options.aligned ? scenario : turnedGenerically(scenario);
}

}  // namespace scenarios
