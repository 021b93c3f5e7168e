// The nodes above moved vertices, judged by sets and by walking FCL's nodes.
#include "hierarchy/dirty_nodes.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "support/long_mode.h"
#include "support/meshes.h"
#include "thesis/adaptive_tree.h"

namespace adaptive_bvh_test {
namespace dirty_nodes_test {

using adaptive_bvh::DirtyNodes;
using adaptive_bvh::Topology;

/// All marked nodes and those above them, from the last to the first; unmarks them.
std::vector<int> take(DirtyNodes& nodes) {
  std::vector<int> found;
  for (int node = nodes.size(); (node = nodes.before(node)) >= 0;) {
    EXPECT_TRUE(nodes.isMarked(node));
    found.push_back(node);
  }
  for (const int node : found) nodes.unmark(node);
  EXPECT_EQ(-1, nodes.before(nodes.size()));
  return found;
}

/// Random trees of any size, whose leaves have random vertices, against std::set.
TEST(DirtyNodesOfRandomTrees, AreThoseAboveTheVertices) {
  std::mt19937 random(testSeed(5));
  for (const unsigned size : {1u, 2u, 63u, 64u, 65u, 128u, 129u, 1000u}) {
    std::vector<unsigned> parents(size, 0);
    for (unsigned node = 1; node < size; ++node) parents[node] = random() % node;
    std::vector<std::pair<unsigned, unsigned>> leaves;  // vertex, node
    for (unsigned i = 0; i < 3 * size; ++i) leaves.emplace_back(random() % 40, i / 3);
    DirtyNodes nodes(41, parents, [&](const auto& visit) {
      for (const auto& [vertex, node] : leaves) visit(vertex, node);
    });
    EXPECT_FALSE(nodes.isEmpty());
    EXPECT_TRUE(DirtyNodes(nodes).isEmpty()) << "a copy";
    for (int step = 0; step < 100; ++step) {
      std::set<int> expected;
      for (unsigned count = random() % 4; count-- > 0;) {
        const unsigned vertex = random() % 41;
        nodes.add(vertex);
        for (const auto& [v, leaf] : leaves)
          for (unsigned node = leaf; v == vertex && expected.insert(int(node)).second && node > 0;)
            node = parents[node];
      }
      if (step % 7 == 0) {
        nodes.unmarkAll();
        expected.clear();
      }
      ASSERT_EQ((std::vector<int>(expected.rbegin(), expected.rend())), take(nodes));
    }
  }
}

template <typename S>
class NodesOfModels : public testing::Test {
 protected:
  void build(const TriangleMesh& mesh) {
    fillModel(mesh, model_);
    topology_.assign(model_);
    nodes_ = topology_.dirtyNodes(mesh.vertices.size());
  }

  /// The pairs of siblings on the ways from the leaves of a vertex to the root, by FCL's links.
  std::set<int> above(unsigned vertex) const {
    std::map<int, int> parent;
    std::vector<int> open;
    for (int i = 0; i < model_.getNumBVs(); ++i) {
      const auto& node = model_.getBV(i);
      if (!node.isLeaf()) {
        parent[node.leftChild()] = parent[node.rightChild()] = i;
        continue;
      }
      const fcl::Triangle& t = model_.tri_indices[node.primitiveId()];
      if (t[0] == vertex || t[1] == vertex || t[2] == vertex) open.push_back(i);
    }
    std::set<int> pairs;
    for (int node : open) {
      for (; node > 0; node = parent[node]) pairs.insert((node + 1) / 2);
      pairs.insert(0);
    }
    return pairs;
  }

  fcl::BVHModel<fcl::RSS<S>> model_;
  Topology topology_;
  DirtyNodes nodes_;
};

using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(NodesOfModels, Scalars);

/// Of every vertex of a triangle, a sheet, a hose and a soup: all pairs above its triangles, no
/// other, and its slots.
TYPED_TEST(NodesOfModels, AreWhatIsAboveAVertex) {
  std::mt19937 random(testSeed(7));
  TriangleMesh sheet = plate(5, 4);
  sheet.vertices.emplace_back(5, 5, 5);  // without a triangle
  for (const auto& mesh : {soup(1, random), plate(1, 1), sheet, tube(6, 5)}) {
    this->build(mesh);
    for (unsigned v = 0; v < mesh.vertices.size(); ++v) {
      this->nodes_.add(v);
      const std::set<int> expected = this->above(v);
      ASSERT_EQ((std::vector<int>(expected.rbegin(), expected.rend())), take(this->nodes_)) << v;
      std::set<unsigned> slots;
      this->topology_.forEachSlot(v, this->nodes_, [&](unsigned slot) { slots.insert(slot); });
      const std::vector<unsigned>& vertices = this->topology_.slots.vertices();
      for (unsigned slot = 0; slot < this->topology_.slots.used(); ++slot)
        ASSERT_EQ(vertices[slot] == v, slots.count(slot) > 0) << v;
    }
  }
}

/// Marks of several vertices add up.
TYPED_TEST(NodesOfModels, OfSeveralVerticesAddUp) {
  this->build(plate(6, 6));
  std::set<int> expected;
  for (const unsigned v : {0u, 24u, 48u, 25u, 0u}) {
    this->nodes_.add(v);
    const std::set<int> above = this->above(v);
    expected.insert(above.begin(), above.end());
  }
  EXPECT_EQ((std::vector<int>(expected.rbegin(), expected.rend())), take(this->nodes_));
}

}  // namespace dirty_nodes_test
}  // namespace adaptive_bvh_test
