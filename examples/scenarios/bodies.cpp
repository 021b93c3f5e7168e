#include "bodies.h"

#include <cmath>
#include <map>
#include <utility>

namespace scenarios {
namespace {

/// The two triangles of every cell of a grid whose rows have `columns` vertices.
void addCells(Mesh& mesh, std::size_t cells, std::size_t rows, std::size_t columns) {
  for (std::size_t j = 0; j < rows; ++j)
    for (std::size_t i = 0; i < cells; ++i) {
      const std::size_t a = columns * j + i, b = columns * j + (i + 1) % columns;
      mesh.triangles.emplace_back(a, b, b + columns);
      mesh.triangles.emplace_back(a, b + columns, a + columns);
    }
}

/// The helmet seen from above: the point of the plane at distance t from the middle, in the
/// direction `angle`. The rim is at t = 1.
Point flat(double t, double angle) { return {t * std::cos(angle), t * std::sin(angle), 0}; }

/// From there onto the helmet.
Point raised(const Point& p) {
  const double t = p.norm();
  if (t == 0) return {0, 0, 1.1};
  const double polar = 1.75 * t;  // a little past the equator
  const double out = (1 + 0.12 * std::pow(t, 8)) * std::sin(polar) / t;
  return {0.85 * out * p[0], out * p[1], 1.1 * std::cos(polar)};
}

/// A disc of a middle and rings of 6, 12, ... 54, 56, 58 vertices: edges about equally long.
Mesh disc() {
  std::vector<std::size_t> ring_sizes;
  for (std::size_t n = 6; n <= 54; n += 6) ring_sizes.push_back(n);
  ring_sizes.push_back(56);
  ring_sizes.push_back(58);

  Mesh mesh;
  mesh.vertices.push_back(Point::Zero());
  std::size_t inner = 0, inner_size = 1;  // the ring before: first vertex, size
  for (std::size_t k = 0; k < ring_sizes.size(); ++k) {
    const std::size_t n = ring_sizes[k], outer = mesh.vertices.size();
    for (std::size_t i = 0; i < n; ++i)
      mesh.vertices.push_back(
          flat(double(k + 1) / double(ring_sizes.size()), 2 * M_PI * double(i) / double(n)));
    // Zip the two rings: always step on the side that lags behind.
    std::size_t i = 0, j = 0;
    const std::size_t inner_steps = inner_size == 1 ? 0 : inner_size;
    while (i < inner_steps || j < n) {
      const bool step_outer = i == inner_steps || (j < n && j * inner_size <= i * n);
      const std::size_t a = inner + i % inner_size, b = outer + j % n;
      if (step_outer)
        mesh.triangles.emplace_back(a, b, outer + ++j % n);
      else
        mesh.triangles.emplace_back(a, b, inner + ++i % inner_size);
    }
    inner = outer;
    inner_size = n;
  }
  return mesh;
}

/// Cuts every triangle into n x n; vertices on common edges are shared.
class Subdivision {
 public:
  Subdivision(const Mesh& coarse, int n) : coarse_(coarse), n_(n) {
    fine_.vertices = coarse.vertices;
    for (const fcl::Triangle& t : coarse.triangles) cut(t);
  }
  Mesh take() { return std::move(fine_); }

 private:
  void cut(const fcl::Triangle& t) {
    std::vector<std::vector<std::size_t>> row(n_ + 1);
    for (int j = 0; j <= n_; ++j)
      for (int i = 0; i <= n_ - j; ++i) row[j].push_back(vertex(t, i, j));
    for (int j = 0; j < n_; ++j)
      for (int i = 0; i < n_ - j; ++i) {
        fine_.triangles.emplace_back(row[j][i], row[j][i + 1], row[j + 1][i]);
        if (i + 1 < n_ - j)
          fine_.triangles.emplace_back(row[j][i + 1], row[j + 1][i + 1], row[j + 1][i]);
      }
  }

  /// The point (n - i - j, i, j) / n in barycentric coordinates.
  std::size_t vertex(const fcl::Triangle& t, int i, int j) {
    std::map<std::size_t, int> weights;  // sorted, so that both sides of an edge name it alike
    weights[t[0]] += n_ - i - j;
    weights[t[1]] += i;
    weights[t[2]] += j;
    Point p = Point::Zero();
    for (auto w = weights.begin(); w != weights.end();) {
      p += coarse_.vertices[w->first] * (double(w->second) / n_);
      w = w->second == 0 ? weights.erase(w) : std::next(w);
    }
    if (weights.size() == 1) return weights.begin()->first;
    const auto [known, is_new] = names_.emplace(std::move(weights), fine_.vertices.size());
    if (is_new) fine_.vertices.push_back(p);
    return known->second;
  }

  const Mesh& coarse_;
  int n_;
  Mesh fine_;
  std::map<std::map<std::size_t, int>, std::size_t> names_;
};

}  // namespace

Mesh grid(int columns, int rows, double width, double height) {
  Mesh mesh;
  for (int j = 0; j <= rows; ++j)
    for (int i = 0; i <= columns; ++i)
      mesh.vertices.emplace_back(width * (double(i) / columns - 0.5),
                                 height * (double(j) / rows - 0.5), 0);
  addCells(mesh, std::size_t(columns), std::size_t(rows), std::size_t(columns) + 1);
  return mesh;
}

Mesh tube(int around, int along, double radius, double length) {
  Mesh mesh;
  for (int j = 0; j <= along; ++j)
    for (int i = 0; i < around; ++i) {
      const double angle = 2 * M_PI * i / around;
      mesh.vertices.emplace_back(radius * std::cos(angle), radius * std::sin(angle),
                                 -length * j / along);
    }
  addCells(mesh, std::size_t(around), std::size_t(along), std::size_t(around));
  return mesh;
}

Mesh dome(int resolution) {
  Mesh mesh = Subdivision(disc(), resolution).take();
  for (Point& p : mesh.vertices) p = raised(p);
  return mesh;
}

}  // namespace scenarios
