#pragma once

#include <string>
#include <vector>

#include "adaptive_bvh/mesh.h"

namespace tools {

/// A surface in one colour; `normals` by vertex, or none.
struct Part {
  adaptive_bvh::TriangleMesh mesh;
  std::vector<fcl::Vector3d> normals;
};

/// Writes the parts as one mesh file, each in a colour of its own, by assimp. The path must end in
/// .ply, .obj, .gltf, .glb or .stl. Throws std::runtime_error when it does not, or cannot be
/// written.
void write(const std::vector<Part>& parts, const std::string& path);

}  // namespace tools
