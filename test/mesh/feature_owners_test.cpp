// Which triangle owns which vertex and edge, against sets of all vertices and edges.
#include "boxes/feature_leaves.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "adaptive_bvh/feature_pairs.h"
#include "deformable/mesh_state.h"
#include "support/long_mode.h"
#include "support/meshes.h"

namespace adaptive_bvh_test {
namespace feature_owners_test {

using adaptive_bvh::DeformableMesh;
using adaptive_bvh::FeatureOwner;
using adaptive_bvh::FeatureOwners;
using adaptive_bvh::detail::MeshAccess;
using Edge = std::pair<unsigned, unsigned>;

std::vector<TriangleMesh> meshesWithSharedEdges() {
  std::mt19937 random(testSeed(5));
  TriangleMesh repeated = plate(5, 5);
  for (std::size_t i = 0; i < repeated.triangles.size(); i += 3) {
    fcl::Triangle& t = repeated.triangles[i];
    t.set(t[0], t[1], i % 2 == 0 ? t[1] : t[0]);
  }
  TriangleMesh fan = plate(1, 30);  // one edge of many triangles
  for (std::size_t i = 0; i < fan.triangles.size(); ++i) fan.triangles[i].set(0, 1, 2 + i % 60);
  return {plate(1, 1), plate(9, 7), tube(6, 20), soup(40, random), repeated, fan};
}

const adaptive_bvh::MeshTopology& topologyOf(const DeformableMesh& body) {
  return *MeshAccess::state(body).topology;
}

Edge edgeOf(const TriangleMesh& mesh, unsigned number) {
  const auto ends = adaptive_bvh::edgeVertices(mesh.triangles.data(), number);
  return {std::min(ends[0], ends[1]), std::max(ends[0], ends[1])};
}

/// Each vertex of a triangle, and each edge, has one owner: that with the smallest number.
TEST(FeatureOwners, EachFeatureHasTheSmallestTriangle) {
  for (const auto& mesh : meshesWithSharedEdges()) {
    const DeformableMesh body(mesh);
    const FeatureOwners& owners = topologyOf(body).owners;
    std::map<unsigned, unsigned> vertices;
    std::map<Edge, unsigned> edges;
    for (unsigned i = 0; i < 3 * mesh.triangles.size(); ++i) {
      vertices.emplace(unsigned(mesh.triangles[i / 3][int(i % 3)]), i);
      const Edge edge = edgeOf(mesh, i);
      if (edge.first != edge.second) edges.emplace(edge, i);
    }
    ASSERT_EQ(mesh.triangles.size(), owners.size());
    std::set<unsigned> owned_vertices, owned_edges, triangles;
    for (std::size_t place = 0; place < owners.size(); ++place) {
      const FeatureOwner& owner = owners[place];
      triangles.insert(owner.triangle);
      for (unsigned k = 0; k < 3; ++k) {
        if (owner.ownsVertex(k)) owned_vertices.insert(3 * owner.triangle + k);
        if (owner.ownsEdge(k)) owned_edges.insert(3 * owner.triangle + k);
        EXPECT_EQ(owner.ownsEdge(k), (owner.edges() >> k & 1) != 0);
        EXPECT_EQ(owner.ownsVertex(k), (owner.vertices() >> k & 1) != 0);
      }
    }
    EXPECT_EQ(mesh.triangles.size(), triangles.size());
    std::set<unsigned> expected_vertices, expected_edges;
    for (const auto& v : vertices) expected_vertices.insert(v.second);
    for (const auto& e : edges) expected_edges.insert(e.second);
    EXPECT_EQ(expected_vertices, owned_vertices);
    EXPECT_EQ(expected_edges, owned_edges);
  }
}

/// Places are those of the tree's leaves.
TEST(FeatureOwners, AreInTheOrderOfLeaves) {
  const DeformableMesh body(tube(6, 20));
  const FeatureOwners& owners = topologyOf(body).owners;
  for (unsigned place = 0; place < owners.size(); ++place)
    EXPECT_EQ(unsigned(MeshAccess::state(body).tree.triangle(place)), owners[place].triangle);
}

/// Leaves of a four-wide tree have what their triangles own: every vertex and edge once, in groups
/// that are filled up.
TEST(FeatureLeaves, HaveAllFeaturesOnce) {
  for (const auto& mesh : meshesWithSharedEdges()) {
    const DeformableMesh body(mesh);
    const FeatureOwners& owners = topologyOf(body).owners;
    const adaptive_bvh::VertexSlots& slots = topologyOf(body).leaves.slots;
    const adaptive_bvh::FeatureLeaves& features = topologyOf(body).features;
    std::size_t vertices = 0, edges = 0;
    for (std::size_t place = 0; place < owners.size(); ++place) {
      vertices += std::size_t(__builtin_popcount(owners[place].vertices()));
      edges += std::size_t(__builtin_popcount(owners[place].edges()));
    }
    std::set<unsigned> found_vertices, found_edges;
    for (const auto& leaf : features.leaves()) {
      for (unsigned i = 0; i < leaf.num_vertices; ++i) {
        const auto& owned = features.vertices()[4 * leaf.vertices + i];
        EXPECT_TRUE(found_vertices.insert(owned.vertex).second);
        EXPECT_EQ(owned.vertex, slots.vertices()[owned.slot]);
      }
      for (unsigned i = 0; i < leaf.num_edges; ++i) {
        const auto& owned = features.edges()[4 * leaf.edges + i];
        EXPECT_TRUE(found_edges.insert(owned.number).second);
        const auto ends = adaptive_bvh::edgeVertices(mesh.triangles.data(), owned.number);
        for (int k = 0; k < 2; ++k) {
          EXPECT_EQ(ends[std::size_t(k)], owned.vertices[k]);
          EXPECT_EQ(owned.vertices[k], slots.vertices()[owned.slots[k]]);
        }
      }
      EXPECT_EQ((leaf.num_edges + 3u) / 4, leaf.edgeGroups());
      EXPECT_EQ((leaf.num_vertices + 3u) / 4, leaf.vertexGroups());
    }
    EXPECT_EQ(vertices, found_vertices.size());
    EXPECT_EQ(edges, found_edges.size());
    EXPECT_EQ(0u, features.vertices().size() % 4);
    EXPECT_EQ(0u, features.edges().size() % 4);
  }
}

}  // namespace feature_owners_test
}  // namespace adaptive_bvh_test
