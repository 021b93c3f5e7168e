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

constexpr double kRodRadius = 0.1, kRodLength = 3;
constexpr int kRodFrames = 21;  // odd: in no frame do the rods touch without a gap or a depth
/// Where the rods rest, in x and in y: so far that a vertex tells its rod by its signs.
constexpr double kRodOffset = 2 * kRodRadius;

/// Between two rods, at the height z over their middle; negative where they press.
double rodGap(double z, double t) {
  constexpr double kLargestGap = 1e-6, kLargestDepth = 1e-3, kWave = 2e-3;
  const double least = t < 0.5 ? kLargestGap * (1 - 2 * t) : kLargestDepth * (1 - 2 * t);
  return least + kWave * std::pow(std::sin(4 * M_PI * (z / kRodLength + 0.5)), 2);
}

/// Cross sections stay in their planes, so that what is apart in every plane is apart.
Point twistRod(const Point& rest, double t) {
  const double z = rest[2] + kRodLength / 2, middle = kRodRadius + rodGap(z, t) / 2;
  const auto placed = [&](double x) { return x + std::copysign(middle - kRodOffset, x); };
  const double turn = 2 * M_PI * (1 + 0.5 * t) * z / kRodLength;
  const double x = placed(rest[0]), y = placed(rest[1]);
  return {x * std::cos(turn) - y * std::sin(turn), x * std::sin(turn) + y * std::cos(turn), z};
}

/// One rod for each pair of signs. A vertex of one faces a vertex of the next: 12 around are
/// divisible by 4. The rods' least gaps are at their vertices: 52 along are, too. Between the rows
/// of vertices their surfaces stay apart as long as a row is turned against the next by less than
/// pi / 12.
Mesh rods(int resolution, const std::vector<Point>& signs) {
  const Mesh rod = tube(12 * resolution, 52 * resolution, kRodRadius, kRodLength);
  Mesh all;
  for (const Point& sign : signs) {
    const std::size_t first = all.vertices.size();
    for (const Point& p : rod.vertices) all.vertices.push_back(p + kRodOffset * sign);
    for (const fcl::Triangle& t : rod.triangles)
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
