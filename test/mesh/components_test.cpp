// Connected components, boundaries and the triangles of a vertex, by repeated marking and by maps.
#include "mesh/components.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

#include "mesh/boundary_loops.h"
#include "mesh/vertex_triangles.h"
#include "support/long_mode.h"
#include "support/meshes.h"

namespace adaptive_bvh_test {
namespace components_test {

using adaptive_bvh::BoundaryEdge;
using adaptive_bvh::BoundaryLoops;
using adaptive_bvh::MeshView;
using Mesh = TriangleMesh;

/// Triangles between random vertices, repeated ones included: few, so that components form.
Mesh randomMesh(std::mt19937& random, std::size_t vertices, std::size_t triangles) {
  Mesh mesh;
  mesh.vertices.assign(vertices, fcl::Vector3d::Zero());
  while (mesh.triangles.size() < triangles)
    mesh.triangles.emplace_back(random() % vertices, random() % vertices, random() % vertices);
  return mesh;
}

MeshView<double> viewOf(const Mesh& mesh) {
  MeshView<double> view;
  view.vertices = mesh.vertices.data();
  view.triangles = mesh.triangles.data();
  return view;
}

/// Each vertex gets the smallest number among the triangles that reach it, until nothing changes.
std::set<unsigned> firstTriangles(const Mesh& mesh) {
  const auto count = unsigned(mesh.triangles.size());
  std::vector<unsigned> least(mesh.vertices.size(), count);
  for (bool changes = true; changes;) {
    changes = false;
    for (unsigned t = 0; t < count; ++t) {
      const fcl::Triangle& corners = mesh.triangles[t];
      unsigned smallest = t;
      for (int k = 0; k < 3; ++k) smallest = std::min(smallest, least[corners[k]]);
      for (int k = 0; k < 3; ++k) {
        changes = changes || least[corners[k]] != smallest;
        least[corners[k]] = smallest;
      }
    }
  }
  std::set<unsigned> firsts;
  for (const fcl::Triangle& t : mesh.triangles) firsts.insert(least[t[0]]);
  return firsts;
}

TEST(ComponentsTest, AreThoseOfRepeatedMarking) {
  std::mt19937 random(testSeed(6));
  for (std::size_t triangles = 1; triangles < 200; ++triangles) {
    const Mesh mesh = randomMesh(random, 3 * triangles / 2 + 1, triangles);
    adaptive_bvh::Components components;
    components.assign(viewOf(mesh), triangles, mesh.vertices.size());
    const std::set<unsigned> expected = firstTriangles(mesh);
    ASSERT_EQ(std::vector<unsigned>(expected.begin(), expected.end()), components.firstTriangles());
  }
}

TEST(VertexTrianglesTest, AreThoseOfAMap) {
  std::mt19937 random(testSeed(7));
  for (std::size_t triangles = 0; triangles < 100; ++triangles) {
    const Mesh mesh = randomMesh(random, triangles / 2 + 1, triangles);
    std::map<std::size_t, std::set<unsigned>> expected;
    for (unsigned t = 0; t < triangles; ++t)
      for (int k = 0; k < 3; ++k) expected[mesh.triangles[t][k]].insert(t);
    adaptive_bvh::VertexTriangles found;
    found.assign(viewOf(mesh), triangles, mesh.vertices.size());
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
      const auto range = found[v];
      ASSERT_EQ(std::vector<unsigned>(expected[v].begin(), expected[v].end()),
                std::vector<unsigned>(range.begin(), range.end()));
    }
  }
}

/// Every use of an edge is that of a closed curve, and no curve has another edge.
TEST(BoundaryLoopsTest, GoThroughEachEdgeAsOftenAsItsSurplus) {
  std::mt19937 random(testSeed(8));
  for (std::size_t triangles = 0; triangles < 200; ++triangles) {
    const Mesh mesh = randomMesh(random, triangles / 3 + 3, triangles);
    std::map<std::pair<unsigned, unsigned>, int> uses, left;
    for (const fcl::Triangle& t : mesh.triangles)
      for (int k = 0; k < 3; ++k) {
        const auto a = unsigned(t[k]), b = unsigned(t[(k + 1) % 3]);
        if (a == b) continue;
        ++uses[{a, b}];
        --uses[{b, a}];
      }
    std::vector<BoundaryEdge> boundary;
    for (const auto& [edge, surplus] : uses)
      if (surplus > 0) {
        boundary.push_back({edge.first, edge.second, surplus});
        left[edge] = surplus;
      }
    std::shuffle(boundary.begin(), boundary.end(), random);
    BoundaryLoops loops;
    loops.assign(boundary);
    EXPECT_EQ(boundary.empty(), loops.isEmpty());
    std::size_t begin = 0;
    for (std::size_t curve = 0; curve < loops.size(); begin = loops.end(curve++))
      for (std::size_t i = begin; i < loops.end(curve); ++i) {
        const std::size_t next = i + 1 < loops.end(curve) ? i + 1 : begin;
        ASSERT_GE(--left[std::make_pair(loops.vertices()[i], loops.vertices()[next])], 0);
      }
    EXPECT_EQ(begin, loops.vertices().size());
    for (const auto& [edge, uses_left] : left)
      ASSERT_EQ(0, uses_left) << edge.first << ' ' << edge.second;
  }
}

}  // namespace components_test
}  // namespace adaptive_bvh_test
