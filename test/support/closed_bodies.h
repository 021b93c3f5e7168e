#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "support/exact_geometry.h"
#include "support/random_geometry.h"
#include "support/test_mesh.h"

namespace adaptive_bvh_test {

// Closed surfaces that face outward, and how often a surface winds around a point.

/// The surface of [0, n]^3 with n x n squares a side, on whole numbers.
inline TriangleMesh latticeBox(int n) {
  TriangleMesh mesh;
  std::vector<int> number(std::size_t((n + 1) * (n + 1) * (n + 1)), -1);
  const auto vertex = [&](const int(&x)[3]) {
    int& known = number[std::size_t((x[0] * (n + 1) + x[1]) * (n + 1) + x[2])];
    if (known < 0) {
      known = int(mesh.vertices.size());
      mesh.vertices.emplace_back(double(x[0]), double(x[1]), double(x[2]));
    }
    return std::size_t(known);
  };
  for (int axis = 0; axis < 3; ++axis)
    for (const int end : {0, n})
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
          const auto at = [&](int u, int v) {
            int x[3];
            x[axis] = end;
            x[(axis + 1) % 3] = i + u;
            x[(axis + 2) % 3] = j + v;
            return vertex(x);
          };
          const std::size_t a = at(0, 0), b = at(1, 0), c = at(1, 1), d = at(0, 1);
          mesh.triangles.emplace_back(a, end ? b : c, end ? c : b);
          mesh.triangles.emplace_back(a, end ? c : d, end ? d : c);
        }
  return mesh;
}

/// A ball of radius 1 around the origin, from a grid around its axis.
inline TriangleMesh gridBall(int around, int rings) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 1}, {0, 0, -1}};
  const auto at = [&](int ring, int i) { return std::size_t(2 + ring * around + i % around); };
  for (int r = 0; r < rings; ++r)
    for (int i = 0; i < around; ++i) {
      const double polar = M_PI * (r + 1) / (rings + 1), angle = 2 * M_PI * i / around;
      mesh.vertices.emplace_back(double(std::sin(polar) * std::cos(angle)),
                                 double(std::sin(polar) * std::sin(angle)),
                                 double(std::cos(polar)));
    }
  for (int i = 0; i < around; ++i) {
    mesh.triangles.emplace_back(0, at(0, i), at(0, i + 1));
    mesh.triangles.emplace_back(1, at(rings - 1, i + 1), at(rings - 1, i));
    for (int r = 0; r + 1 < rings; ++r) {
      mesh.triangles.emplace_back(at(r, i), at(r + 1, i), at(r + 1, i + 1));
      mesh.triangles.emplace_back(at(r, i), at(r + 1, i + 1), at(r, i + 1));
    }
  }
  return mesh;
}

/// Adds another surface, moved, and turned inside out on request.
inline void addSurface(const TriangleMesh& other, const fcl::Vector3d& by, bool turns,
                       TriangleMesh& mesh) {
  const std::size_t first = mesh.vertices.size();
  for (const fcl::Vector3d& p : other.vertices) mesh.vertices.push_back(p + by);
  for (const fcl::Triangle& t : other.triangles)
    mesh.triangles.emplace_back(first + t[0], first + t[turns ? 2 : 1], first + t[turns ? 1 : 2]);
}

/// A closed body of any kind, of about size 1: balls, boxes on lattices, needles, sheets, two
/// bodies, one with a cavity, and one that crosses itself.
inline TriangleMesh closedBody(RandomGeometry& random) {
  const int side = 2 + random.below(4);
  TriangleMesh mesh = gridBall(3 + 2 * side, 1 + 2 * side);
  switch (random.below(8)) {
    case 0: break;
    case 1: mesh = latticeBox(side); break;
    case 2:
    case 3: {
      const fcl::Vector3d shape(1, random.size(-5, 0), random.size(-5, 0));
      for (fcl::Vector3d& p : mesh.vertices) p = p.cwiseProduct(shape);
      break;
    }
    case 4: addSurface(latticeBox(2), fcl::Vector3d(2, 0, 0), false, mesh); break;
    case 5: {
      TriangleMesh cavity = gridBall(5, 4);
      for (fcl::Vector3d& p : cavity.vertices) p *= 0.5;
      addSurface(cavity, fcl::Vector3d(0, 0, 0.1), true, mesh);
      break;
    }
    case 6: addSurface(gridBall(5, 4), fcl::Vector3d(0.5, 0, 0), false, mesh); break;
    default:
      for (fcl::Vector3d& p : mesh.vertices) p += 0.5 * random.point();
  }
  return mesh;
}

/// By solid angles, in long double; in numbers of whole turns where the surface is closed.
template <typename Model>
exact::Real windingNumberOf(const Model& model, const exact::Point& x) {
  exact::Real sum = 0;
  for (const fcl::Triangle& t : model.triangles()) {
    exact::Point p[3];
    exact::Real n[3];
    for (int k = 0; k < 3; ++k) {
      p[k] = exact::of(model.vertices()[t[k]]) - x;
      n[k] = p[k].norm();
    }
    sum +=
        std::atan2(p[0].dot(p[1].cross(p[2])), n[0] * n[1] * n[2] + p[0].dot(p[1]) * n[2] +
                                                   p[1].dot(p[2]) * n[0] + p[2].dot(p[0]) * n[1]);
  }
  return sum / (2 * std::acos(exact::Real(-1)));
}

}  // namespace adaptive_bvh_test
