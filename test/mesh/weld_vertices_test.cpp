// Meshes in memory: vertices that are welded, and models that are built from them.
#include "adaptive_bvh/mesh.h"

#include <gtest/gtest.h>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/self_collision.h"
#include "support/meshes.h"

namespace adaptive_bvh_test {
namespace weld_vertices_test {

class MeshTest : public testing::Test {};
/// Every triangle with corners of its own.
TriangleMesh unwelded(const TriangleMesh& mesh) {
  TriangleMesh soup;
  for (const fcl::Triangle& t : mesh.triangles) {
    const std::size_t first = soup.vertices.size();
    for (int k = 0; k < 3; ++k) soup.vertices.push_back(mesh.vertices[t[k]]);
    soup.triangles.emplace_back(first, first + 1, first + 2);
  }
  return soup;
}

// Welding finds the mesh again that the triangles were taken from.
TEST_F(MeshTest, WeldingRestoresConnectivity) {
  const auto mesh = plate(4, 3);
  auto welded = unwelded(mesh);
  ASSERT_EQ(3 * mesh.triangles.size(), welded.vertices.size());
  weldVertices(welded);
  EXPECT_EQ(mesh.vertices.size(), welded.vertices.size());
  ASSERT_EQ(mesh.triangles.size(), welded.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k)
      EXPECT_EQ(mesh.vertices[mesh.triangles[t][k]], welded.vertices[welded.triangles[t][k]]);
}

// Only exactly equal positions are one; the first stays, signed zeros are equal.
TEST_F(MeshTest, WeldingKeepsTheFirstOfEqualPositions) {
  const double next = std::nextafter(1., 2.);
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {-0., 0, 0}, {0, 1, 0}, {next, 0, 0}};
  mesh.triangles = {{0, 1, 3}, {2, 4, 3}};
  weldVertices(mesh);
  ASSERT_EQ(4u, mesh.vertices.size());
  EXPECT_FALSE(std::signbit(mesh.vertices[0][0]));
  EXPECT_EQ(next, mesh.vertices[3][0]);
  EXPECT_EQ(0u, mesh.triangles[1][0]);
  EXPECT_EQ(3u, mesh.triangles[1][1]);
  EXPECT_EQ(2u, mesh.triangles[1][2]);
}

// What welding is for: a surface does not meet itself where its triangles are neighbours.
TEST_F(MeshTest, NeighboursAreKnownOnlyInAWeldedMesh) {
  const auto pairs = [](const TriangleMesh& mesh) {
    const adaptive_bvh::DeformableMesh body(mesh);
    EXPECT_TRUE(body.validate());
    fcl::CollisionResultd result;
    return selfCollide(body, fcl::CollisionRequestd(1000), result);
  };
  auto mesh = unwelded(plate(3, 3));
  EXPECT_GT(pairs(mesh), 0u);
  weldVertices(mesh);
  EXPECT_EQ(0u, pairs(mesh));
}

// Vertex i of the mesh is vertex i of the model, new or used, adaptive or FCL's.
TEST_F(MeshTest, FillsNewAndUsedModels) {
  const auto small = plate(1, 2), large = plate(5, 4);
  adaptive_bvh::AdaptiveBVHModel<fcl::RSSd> adaptive;
  fcl::BVHModel<fcl::OBBRSSd> plain;
  testing::internal::CaptureStderr();  // FCL remarks on a model that is built twice
  for (const auto* mesh : {&small, &large, &small}) {
    EXPECT_EQ(fcl::BVH_OK, fillModel(*mesh, adaptive));
    EXPECT_EQ(fcl::BVH_OK, fillModel(*mesh, plain));
    ASSERT_EQ(int(mesh->vertices.size()), adaptive.num_vertices);
    ASSERT_EQ(int(mesh->triangles.size()), plain.num_tris);
    for (std::size_t v = 0; v < mesh->vertices.size(); ++v) {
      EXPECT_EQ(mesh->vertices[v], adaptive.vertices[v]);
      EXPECT_EQ(mesh->vertices[v], plain.vertices[v]);
    }
    EXPECT_TRUE(adaptive.validate());
  }
  testing::internal::GetCapturedStderr();
}

// Without triangles there is nothing to build: FCL's code says so.
TEST_F(MeshTest, AnEmptyMeshFillsNothing) {
  adaptive_bvh::AdaptiveBVHModel<fcl::RSSd> model;
  testing::internal::CaptureStderr();
  EXPECT_NE(fcl::BVH_OK, fillModel(TriangleMesh(), model));
  testing::internal::GetCapturedStderr();
}

}  // namespace weld_vertices_test
}  // namespace adaptive_bvh_test
