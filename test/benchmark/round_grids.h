#pragma once

#include <cmath>
#include <cstddef>

#include "adaptive_bvh/mesh.h"

// Grids around an axis, for scenes of many bodies.
namespace adaptive_bvh_bench {

/// A grid around an axis: place(u, v) for u in [0, 1) around, v in [0, 1] along.
template <typename Place>
adaptive_bvh::TriangleMesh around(int columns, int rows, const Place& place) {
  adaptive_bvh::TriangleMesh mesh;
  for (int j = 0; j <= rows; ++j)
    for (int i = 0; i < columns; ++i)
      mesh.vertices.push_back(place(double(i) / columns, double(j) / rows));
  const auto at = [&](int i, int j) { return std::size_t(j * columns + i % columns); };
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < columns; ++i) {
      mesh.triangles.emplace_back(at(i, j), at(i + 1, j), at(i + 1, j + 1));
      mesh.triangles.emplace_back(at(i, j), at(i + 1, j + 1), at(i, j + 1));
    }
  return mesh;
}

inline adaptive_bvh::TriangleMesh ball(int columns, int rows, double radius,
                                       const fcl::Vector3d& at) {
  return around(columns, rows, [&](double u, double v) -> fcl::Vector3d {
    const double polar = M_PI * (0.01 + 0.98 * v), angle = 2 * M_PI * u;
    const fcl::Vector3d direction(std::sin(polar) * std::cos(angle),
                                  std::sin(polar) * std::sin(angle), std::cos(polar));
    return at + radius * direction;
  });
}

}  // namespace adaptive_bvh_bench
