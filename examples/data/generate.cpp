// Writes the meshes of this folder: helmet.obj (385 vertices, 710 triangles) and plate.ply (100,
// 162), the sizes of thesis Table 1. They are generated, so nobody owns them.
//   generate FOLDER
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

namespace {

struct Vertex {
  double x, y, z;
};
using Face = std::vector<std::size_t>;

struct Mesh {
  std::vector<Vertex> vertices;
  std::vector<Face> faces;
};

/// A dome of radius 1 with a flared rim: a pole and rings of 6, 12, ... 54, 56, 58 vertices, so
/// that the edges are about equally long everywhere.
Mesh helmet() {
  std::vector<std::size_t> ring_sizes;
  for (std::size_t n = 6; n <= 54; n += 6) ring_sizes.push_back(n);
  ring_sizes.push_back(56);
  ring_sizes.push_back(58);

  Mesh mesh;
  mesh.vertices.push_back({0, 0, 1.1});
  std::size_t inner = 0, inner_size = 1;  // the ring before: first vertex, size
  for (std::size_t k = 0; k < ring_sizes.size(); ++k) {
    const std::size_t n = ring_sizes[k], outer = mesh.vertices.size();
    const double t = double(k + 1) / double(ring_sizes.size());
    const double polar = 1.75 * t;  // a little past the equator
    const double flare = 1 + 0.12 * std::pow(t, 8);
    for (std::size_t i = 0; i < n; ++i) {
      const double angle = 2 * M_PI * double(i) / double(n);
      mesh.vertices.push_back({0.85 * flare * std::sin(polar) * std::cos(angle),
                               flare * std::sin(polar) * std::sin(angle), 1.1 * std::cos(polar)});
    }
    // Zip the two rings: always step on the side that lags behind.
    std::size_t i = 0, j = 0;
    const std::size_t inner_steps = inner_size == 1 ? 0 : inner_size;
    while (i < inner_steps || j < n) {
      const bool step_outer = i == inner_steps || (j < n && j * inner_size <= i * n);
      const std::size_t a = inner + i % inner_size, b = outer + j % n;
      if (step_outer)
        mesh.faces.push_back({a, b, outer + ++j % n});
      else
        mesh.faces.push_back({a, b, inner + ++i % inner_size});
    }
    inner = outer;
    inner_size = n;
  }
  return mesh;
}

/// 9 x 9 cells below the helmet.
Mesh plate() {
  Mesh mesh;
  for (int j = 0; j < 10; ++j)
    for (int i = 0; i < 10; ++i) mesh.vertices.push_back({-1.35 + 0.3 * i, -1.35 + 0.3 * j, -0.6});
  for (std::size_t j = 0; j < 9; ++j)
    for (std::size_t i = 0; i < 9; ++i) {
      const std::size_t v = 10 * j + i;
      mesh.faces.push_back({v, v + 1, v + 11});
      mesh.faces.push_back({v, v + 11, v + 10});
    }
  return mesh;
}

void writeObj(const Mesh& mesh, const std::string& path) {
  std::ofstream out(path);
  out.precision(9);
  for (const Vertex& v : mesh.vertices) out << "v " << v.x << ' ' << v.y << ' ' << v.z << '\n';
  for (const Face& f : mesh.faces)
    out << "f " << f[0] + 1 << ' ' << f[1] + 1 << ' ' << f[2] + 1 << '\n';
}

void writePly(const Mesh& mesh, const std::string& path) {
  std::ofstream out(path);
  out.precision(9);
  out << "ply\nformat ascii 1.0\nelement vertex " << mesh.vertices.size()
      << "\nproperty float x\nproperty float y\nproperty float z\nelement face "
      << mesh.faces.size() << "\nproperty list uchar int vertex_indices\nend_header\n";
  for (const Vertex& v : mesh.vertices) out << v.x << ' ' << v.y << ' ' << v.z << '\n';
  for (const Face& f : mesh.faces) out << "3 " << f[0] << ' ' << f[1] << ' ' << f[2] << '\n';
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: generate FOLDER\n";
    return 2;
  }
  const std::string folder = argv[1];
  const Mesh h = helmet(), p = plate();
  writeObj(h, folder + "/helmet.obj");
  writePly(p, folder + "/plate.ply");
  std::printf("helmet: %zu vertices, %zu triangles\nplate: %zu vertices, %zu triangles\n",
              h.vertices.size(), h.faces.size(), p.vertices.size(), p.faces.size());
}
