#pragma once

#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>

#include "support/meshes.h"

namespace adaptive_bvh_test {

/// A binary PLY file of doubles and triangles, as these are; empty if there is none.
inline TriangleMesh loadStepFile(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::string line, word;
  std::size_t vertices = 0, faces = 0;
  while (std::getline(file, line) && line != "end_header") {
    std::istringstream words(line);
    words >> word;
    if (word != "element") continue;
    words >> word;
    words >> (word == "vertex" ? vertices : faces);
  }
  TriangleMesh mesh;
  mesh.vertices.resize(vertices);
  file.read(reinterpret_cast<char*>(mesh.vertices.data()),
            std::streamsize(vertices * sizeof(fcl::Vector3d)));
  for (std::size_t i = 0; i < faces && file; ++i) {
    std::int32_t v[3];
    file.get();
    file.read(reinterpret_cast<char*>(v), sizeof(v));
    mesh.triangles.emplace_back(std::size_t(v[0]), std::size_t(v[1]), std::size_t(v[2]));
  }
  return mesh;
}

#ifdef ADAPTIVE_BVH_TEST_DATA
/// The folder of the steps of simulations (Wang et al. 2022) beside the project, or that which
/// ADAPTIVE_BVH_TEST_DATA names.
inline std::string dataFolder() {
  const char* named = std::getenv("ADAPTIVE_BVH_TEST_DATA");
  return named ? named : ADAPTIVE_BVH_TEST_DATA;
}
inline TriangleMesh loadStep(const std::string& name) {
  return loadStepFile(dataFolder() + "/" + name + ".ply");
}
#endif

}  // namespace adaptive_bvh_test
