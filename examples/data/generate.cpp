// Writes the meshes of this folder: helmet.obj (385 vertices, 710 triangles) and plate.ply (100,
// 162), the sizes of thesis Table 1. They are generated, so nobody owns them.
//   generate FOLDER
#include <cstdio>
#include <fstream>
#include <iostream>
#include <string>

#include "scenarios.h"

namespace {

using scenarios::Mesh;

void writeObj(const Mesh& mesh, const std::string& path) {
  std::ofstream out(path);
  out.precision(9);
  for (const auto& v : mesh.vertices) out << "v " << v[0] << ' ' << v[1] << ' ' << v[2] << '\n';
  for (const auto& t : mesh.triangles)
    out << "f " << t[0] + 1 << ' ' << t[1] + 1 << ' ' << t[2] + 1 << '\n';
}

void writePly(const Mesh& mesh, const std::string& path) {
  std::ofstream out(path);
  out.precision(9);
  out << "ply\nformat ascii 1.0\nelement vertex " << mesh.vertices.size()
      << "\nproperty float x\nproperty float y\nproperty float z\nelement face "
      << mesh.triangles.size() << "\nproperty list uchar int vertex_indices\nend_header\n";
  for (const auto& v : mesh.vertices) out << v[0] << ' ' << v[1] << ' ' << v[2] << '\n';
  for (const auto& t : mesh.triangles) out << "3 " << t[0] << ' ' << t[1] << ' ' << t[2] << '\n';
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: generate FOLDER\n";
    return 2;
  }
  const std::string folder = argv[1];
  const Mesh helmet = scenarios::helmet().mesh();
  Mesh plate = scenarios::plate().mesh();
  for (auto& v : plate.vertices) v[2] -= 0.6;  // below the helmet
  writeObj(helmet, folder + "/helmet.obj");
  writePly(plate, folder + "/plate.ply");
  std::printf("helmet: %zu vertices, %zu triangles\nplate: %zu vertices, %zu triangles\n",
              helmet.vertices.size(), helmet.triangles.size(), plate.vertices.size(),
              plate.triangles.size());
}
