// Two soft fingers close on a cylinder. Contact forces come from vertexContacts: depth, normal and
// area of every vertex near the cylinder. The fingers come to rest where these forces and those of
// the soft material balance.
#include <array>
#include <cmath>
#include <cstdio>

#include <fcl/geometry/shape/cylinder.h>

#include "adaptive_bvh/penetration.h"
#include "page.h"

using Mesh = adaptive_bvh::DeformableMesh;
using Point = fcl::Vector3d;
using Points = std::vector<Point>;

constexpr double kMargin = 0.002;   // m: forces begin this far from the surface
constexpr double kPressure = 8e7;   // Pa for each m that a vertex is nearer than that
constexpr double kMaterial = 300;   // N for each m between a vertex and where its finger holds it
constexpr double kMobility = 1e-3;  // m for each N in a step
constexpr double kTravel = 0.012;   // m that each finger closes
constexpr int kSteps = 120;

// A pad of 60 x 40 mm in the plane x = at, of 24 x 16 squares.
Mesh pad(double at) {
  constexpr int kRows = 24, kColumns = 16;
  Points points;
  std::vector<fcl::Triangle> triangles;
  for (int j = 0; j <= kRows; ++j)
    for (int i = 0; i <= kColumns; ++i)
      points.push_back(Point(at, 0.04 * i / kColumns - 0.02, 0.06 * j / kRows - 0.03));
  for (std::size_t j = 0; j < kRows; ++j)
    for (std::size_t i = 0; i < kColumns; ++i) {
      const std::size_t v = (kColumns + 1) * j + i;
      triangles.emplace_back(v, v + 1, v + kColumns + 2);
      triangles.emplace_back(v, v + kColumns + 2, v + kColumns + 1);
    }
  return Mesh(points, triangles);
}

int main(int argc, char** argv) {
  const fcl::Cylinderd cylinder(0.02, 0.08);  // radius and length, m
  const fcl::Transform3d still = fcl::Transform3d::Identity();
  std::array<Mesh, 2> fingers = {pad(-0.03), pad(0.03)};
  const std::array<Points, 2> open = {fingers[0].vertices(), fingers[1].vertices()};
  Page page(argc, argv, "Two soft fingers close on a cylinder", "m");
  page.add(cylinder, still, "cylinder");
  const std::array<int, 2> bodies = {page.add(fingers[0], still, "left finger"),
                                     page.add(fingers[1], still, "right finger")};
  adaptive_bvh::VertexContacts contacts;
  for (int step = 1; step <= kSteps; ++step) {
    const double closed = kTravel * std::min(1., 2. * step / kSteps);
    double moved = 0, deepest = 0;
    std::array<double, 2> grip = {0, 0};
    for (std::size_t f = 0; f < 2; ++f) {
      Points forces(open[f].size()), positions = fingers[f].vertices();
      for (std::size_t v = 0; v < forces.size(); ++v) {
        const Point held = open[f][v] + Point(f == 0 ? closed : -closed, 0, 0);
        forces[v] = kMaterial * (held - positions[v]);
      }
      vertexContacts(fingers[f], still, cylinder, still, kMargin, contacts);
      Points pushes;  // contact forces, for the page
      for (std::size_t i = 0; i < contacts.size(); ++i) {
        const double pressure = kPressure * (kMargin - contacts.distances[i]);
        const Point force = -pressure * contacts.areas[i] * contacts.normals[i];
        forces[contacts.vertices[i]] += force;
        pushes.push_back(force);
        grip[f] += force[0];
        deepest = std::min(deepest, contacts.distances[i]);
      }
      page.arrows("contact force, N", contacts.positions, pushes);
      page.colour(bodies[f], fingers[f].triangles(), contacts.vertices);
      for (std::size_t v = 0; v < positions.size(); ++v) {
        positions[v] += kMobility * forces[v];
        moved = std::max(moved, kMobility * forces[v].norm());
      }
      fingers[f].update(positions);
    }
    page.frame();
    if (step % 20 == 0)
      std::printf("step %3d: grip %+.3f and %+.3f N, deepest %.3f mm, moved by %.2e mm\n", step,
                  grip[0], grip[1], 1e3 * std::abs(deepest), 1e3 * moved);
  }
  page.write();
}
