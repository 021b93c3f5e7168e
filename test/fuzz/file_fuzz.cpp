// Loads any bytes as a mesh file of one of the formats that are read here; the first byte chooses
// the format. What is not refused must be sound.
#include <cstdint>
#include <cstdlib>
#include <string>

#include "adaptive_bvh/mesh_io.h"
#include "support/temporary_file.h"

namespace adaptive_bvh_test {
namespace {

bool isSound(const adaptive_bvh::TriangleMesh& mesh) {
  for (const auto& p : mesh.vertices)
    if (!p.allFinite()) return false;
  for (const fcl::Triangle& t : mesh.triangles)
    for (int k = 0; k < 3; ++k)
      if (t[k] >= mesh.vertices.size()) return false;
  return !mesh.triangles.empty();
}

}  // namespace
}  // namespace adaptive_bvh_test

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const char* const kExtensions[] = {"gltf", "glb", "dae", "obj", "stl", "off", "ply"};
  if (size == 0) return 0;
  const std::string bytes(data + 1, data + size);
  const adaptive_bvh_test::TemporaryFile file(
      std::string("fuzz.") + kExtensions[data[0] % std::size(kExtensions)], bytes);
  try {
    if (!adaptive_bvh_test::isSound(adaptive_bvh::loadMesh(file.path()))) std::abort();
  } catch (const adaptive_bvh::MeshLoadError&) {  // refused
  }
  return 0;
}
