// Random glTF and Collada scenes become the triangles that they say, wherever the bytes are and
// however nodes, meshes and lists are shared.
#include "adaptive_bvh/mesh_io.h"

#include <gtest/gtest.h>

#include "support/long_mode.h"
#include "support/random_scenes.h"
#include "support/temporary_file.h"

namespace adaptive_bvh_test {
namespace random_scenes_test {

/// The triangles of a file in ascending order; none where it is refused because it has none.
std::vector<IntegerTriangle> trianglesOf(const std::string& path) {
  std::vector<IntegerTriangle> triangles;
  try {
    adaptive_bvh::MeshLoadOptions options;
    options.weld = false;
    const auto mesh = adaptive_bvh::loadMesh(path, options);
    for (const fcl::Triangle& t : mesh.triangles) {
      IntegerTriangle triangle;
      for (std::size_t c = 0; c < 3; ++c)
        for (std::size_t k = 0; k < 3; ++k) {
          const double x = mesh.vertices[t[int(c)]][int(k)];
          EXPECT_EQ(x, double(int(x)));
          triangle[c][k] = int(x);
        }
      triangles.push_back(triangle);
    }
  } catch (const adaptive_bvh::MeshLoadError& error) {
    EXPECT_NE(std::string::npos, std::string(error.what()).find("no triangles")) << error.what();
  }
  return sorted(triangles);
}

TEST(RandomScenes, OfGltfBecomeTheirTriangles) {
  std::size_t triangles = 0;
  for (int step = 0; step < manySteps(1000); ++step) {
    SCOPED_TRACE(step);
    const TemporaryFile external("external.bin");
    const std::string& path = external.path();
    const bool is_binary = step % 2 == 0;
    RandomGltf gltf(testSeed(unsigned(step)), path.substr(path.find_last_of('/') + 1), is_binary);
    const SceneFile file = gltf.write();
    std::ofstream(path, std::ios::binary) << gltf.external();
    const TemporaryFile binary("random.glb", glbOf(file.text, file.chunk)),
        text("random.gltf", file.text);
    ASSERT_EQ(sorted(file.triangles), trianglesOf((is_binary ? binary : text).path())) << file.text;
    triangles += file.triangles.size();
  }
  EXPECT_GT(triangles, 10000u);
}

TEST(RandomScenes, OfColladaBecomeTheirTriangles) {
  std::size_t triangles = 0;
  for (int step = 0; step < manySteps(1000); ++step) {
    SCOPED_TRACE(step);
    const SceneFile file = RandomCollada(testSeed(unsigned(step))).write();
    const TemporaryFile text("random.dae", file.text);
    ASSERT_EQ(sorted(file.triangles), trianglesOf(text.path())) << file.text;
    triangles += file.triangles.size();
  }
  EXPECT_GT(triangles, 10000u);
}

}  // namespace random_scenes_test
}  // namespace adaptive_bvh_test
