// The vertices of the leaves in the order of the tree, against FCL's nodes and triangles.
#include "hierarchy/vertex_slots.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "support/long_mode.h"
#include "support/meshes.h"
#include "thesis/adaptive_tree.h"

namespace adaptive_bvh_test {
namespace vertex_slots_test {

using adaptive_bvh::HierarchyStrategy;
using adaptive_bvh::Topology;
using adaptive_bvh::VertexSlots;
using BV = fcl::RSSd;
using Model = adaptive_bvh::AdaptiveBVHModel<BV>;

std::vector<TriangleMesh> meshesWithLooseVertices() {
  std::mt19937 random(testSeed(3));
  TriangleMesh loose = plate(9, 9);
  for (int i = 0; i < 5; ++i) loose.vertices.emplace_back(i, 7, 7);  // of no triangle
  TriangleMesh repeated = soup(30, random);
  for (fcl::Triangle& t : repeated.triangles) t.set(t[0], t[1], t[1]);
  return {plate(1, 1),     plate(7, 7),       plate(20, 9), tube(6, 40),
          soup(1, random), soup(300, random), loose,        repeated};
}

std::vector<unsigned> slotsBelow(const VertexSlots& slots, const fcl::BVNode<BV>& node) {
  const VertexSlots::Set set =
      slots.below(std::size_t(node.first_primitive), std::size_t(node.num_primitives));
  std::vector<unsigned> below;
  if (set.bits == 0)
    for (unsigned slot = set.first; slot < set.last; ++slot) below.push_back(slot);
  for (unsigned bit = 0; bit < 64; ++bit)
    if (set.bits >> bit & 1) below.push_back(set.first + bit);
  return below;
}

/// Calls check(mesh, model, slots) for meshes in trees of both kinds.
template <typename Check>
void forEachTree(Check&& check) {
  for (const auto& mesh : meshesWithLooseVertices())
    for (const auto strategy : {HierarchyStrategy::BottomUp, HierarchyStrategy::TopDown}) {
      Model model(strategy);
      ASSERT_EQ(fcl::BVH_OK, fillModel(mesh, model));
      Topology topology;
      topology.assign(model);
      check(mesh, model, topology.slots);
    }
}

/// A leaf has its triangle's vertices, in order.
TEST(VertexSlots, LeavesHaveTheirVertices) {
  forEachTree([](const auto& mesh, const Model& model, const VertexSlots& slots) {
    ASSERT_EQ(mesh.triangles.size(), slots.leaves());
    for (int i = 0; i < model.getNumBVs(); ++i) {
      const auto& node = model.getBV(i);
      if (!node.isLeaf()) continue;
      const auto leaf = std::size_t(node.first_primitive);
      for (std::size_t k = 0; k < 3; ++k) {
        const auto v = unsigned(mesh.triangles[std::size_t(node.primitiveId())][k]);
        EXPECT_EQ(v, slots.verticesOf(leaf)[k]);
        EXPECT_EQ(v, slots.vertices()[slots.slotsOf(leaf)[k]]);
      }
    }
    EXPECT_GE(slots.bytes(), 4 * slots.size());
  });
}

/// The slots below a node are those of its leaves: all of them and no other, none twice.
TEST(VertexSlots, BelowANodeAreExactlyItsVertices) {
  int ranges = 0, sets = 0;
  forEachTree([&](const auto&, const Model& model, const VertexSlots& slots) {
    for (int i = 0; i < model.getNumBVs(); ++i) {
      const auto& node = model.getBV(i);
      std::set<unsigned> expected;
      for (int leaf = 0; leaf < node.num_primitives; ++leaf)
        for (unsigned slot : slots.slotsOf(std::size_t(node.first_primitive + leaf)))
          expected.insert(slot);
      const std::vector<unsigned> found = slotsBelow(slots, node);
      ASSERT_EQ(expected.size(), found.size());
      ASSERT_TRUE(std::equal(expected.begin(), expected.end(), found.begin()));
      (found.size() > 64 ? ranges : sets) += 1;
    }
  });
  EXPECT_GT(ranges, 10);
  EXPECT_GT(sets, 1000);
}

/// A block is a subtree: as large as possible with at most 64 vertices, each of which has one slot
/// in it. So siblings in different blocks have more than that together.
TEST(VertexSlots, BlocksAreTheLargestSubtreesThatFit) {
  forEachTree([](const auto&, const Model& model, const VertexSlots& slots) {
    for (int i = 0; i < model.getNumBVs(); ++i) {
      const auto& node = model.getBV(i);
      std::set<unsigned> vertices;
      for (const unsigned slot : slotsBelow(slots, node)) vertices.insert(slots.vertices()[slot]);
      const bool in_a_block =
          slots.below(std::size_t(node.first_primitive), std::size_t(node.num_primitives)).bits !=
          0;
      ASSERT_EQ(vertices.size() <= std::size_t(VertexSlots::kBlock), in_a_block) << i;
      if (in_a_block) {
        ASSERT_EQ(vertices.size(), slotsBelow(slots, node).size()) << "a vertex twice";
      }
    }
  });
}

/// All vertices have a slot; vertices without a triangle come last, once.
TEST(VertexSlots, VerticesWithoutATriangleComeLast) {
  forEachTree([](const auto& mesh, const Model& model, const VertexSlots& slots) {
    std::set<unsigned> used;
    for (const fcl::Triangle& t : mesh.triangles)
      for (int k = 0; k < 3; ++k) used.insert(unsigned(t[k]));
    const std::size_t of_leaves = slotsBelow(slots, model.getBV(0)).size();
    std::map<unsigned, int> times;
    for (std::size_t slot = 0; slot < slots.size(); ++slot) {
      const unsigned v = slots.vertices()[slot];
      ++times[v];
      ASSERT_EQ(slot<of_leaves, used.count(v)> 0);
    }
    ASSERT_EQ(mesh.vertices.size(), times.size());
    for (const auto& [v, count] : times) {
      if (used.count(v) == 0) {
        EXPECT_EQ(1, count);
      }
    }
    if (mesh.vertices.size() > 100 && used.size() < 2 * mesh.triangles.size()) {
      EXPECT_LT(slots.size(), 2 * mesh.vertices.size()) << "few are shared by blocks";
    }
  });
}

/// A point is a triangle with three equal vertices.
TEST(VertexSlots, OfPointClouds) {
  fcl::BVHModel<BV> cloud;
  cloud.beginModel();
  const std::vector<fcl::Vector3d> points = tube(10, 9).vertices;
  cloud.addSubModel(points);
  cloud.endModel();
  Topology topology;
  topology.assign(cloud);
  const VertexSlots& slots = topology.slots;
  ASSERT_EQ(points.size(), slots.leaves());
  EXPECT_EQ(points.size(), slots.size());
  for (int i = 0; i < cloud.getNumBVs(); ++i) {
    const auto& node = cloud.getBV(i);
    EXPECT_EQ(std::size_t(node.num_primitives), slotsBelow(slots, node).size());
    if (!node.isLeaf()) continue;
    for (unsigned v : slots.verticesOf(std::size_t(node.first_primitive)))
      EXPECT_EQ(unsigned(node.primitiveId()), v);
  }
}

}  // namespace vertex_slots_test
}  // namespace adaptive_bvh_test
