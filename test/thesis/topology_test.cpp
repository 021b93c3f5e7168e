// Topology, against FCL's nodes and the vertices below them.
#include "thesis/adaptive_tree.h"

#include <gtest/gtest.h>

#include "support/long_mode.h"
#include "support/random_geometry.h"
#include "thesis/model_state.h"

namespace adaptive_bvh_test {
namespace topology_test {

using adaptive_bvh::AdaptiveBVHModel;
using adaptive_bvh::Topology;

template <typename S>
class Trees : public testing::Test {
 protected:
  using BV = fcl::RSS<S>;

  static std::vector<TriangleMesh> meshes() {
    std::mt19937 random(testSeed(3));
    return {plate(1, 1), plate(7, 5), tube(6, 9), soup(50, random), soup(1, random)};
  }
  static int depthBelow(const fcl::BVHModel<BV>& model, int i) {
    const auto& node = model.getBV(i);
    if (node.isLeaf()) return 0;
    return 1 + std::max(depthBelow(model, node.leftChild()), depthBelow(model, node.rightChild()));
  }
};

using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(Trees, Scalars);

/// What is known of FCL's numbers: siblings are 2k + 1 and 2k + 2, below a left sibling lies the
/// range of nodes right after its pair, and the leaves below a node are a range.
TYPED_TEST(Trees, FclNumbersItsNodesAsAssumed) {
  for (const auto& mesh : this->meshes())
    for (const auto strategy :
         {adaptive_bvh::HierarchyStrategy::BottomUp, adaptive_bvh::HierarchyStrategy::TopDown}) {
      AdaptiveBVHModel<fcl::RSS<TypeParam>> model(strategy);
      fillModel(mesh, model);
      int inner = 0;
      for (int i = 0; i < model.getNumBVs(); ++i) {
        const auto& node = model.getBV(i);
        if (node.isLeaf()) continue;
        ++inner;
        EXPECT_EQ(1, node.leftChild() % 2);
        const auto &left = model.getBV(node.leftChild()), &right = model.getBV(node.rightChild());
        if (!left.isLeaf()) {
          EXPECT_EQ(node.rightChild() + 1, left.leftChild());
        }
        if (!right.isLeaf()) {
          EXPECT_EQ(node.rightChild() + 1 + 2 * (left.num_primitives - 1), right.leftChild());
        }
        EXPECT_EQ(node.first_primitive, left.first_primitive);
        EXPECT_EQ(left.first_primitive + left.num_primitives, right.first_primitive);
        EXPECT_EQ(node.num_primitives, left.num_primitives + right.num_primitives);
      }
      EXPECT_EQ(int(mesh.triangles.size()) - 1, inner);
    }
}

/// The vertices of every leaf, in the order of the leaves, and the depth.
TYPED_TEST(Trees, TopologyTellsLeavesAndDepth) {
  using BV = fcl::RSS<TypeParam>;
  for (const auto& mesh : this->meshes()) {
    fcl::BVHModel<BV> model;
    fillModel(mesh, model);
    Topology topology;
    topology.assign(model);
    EXPECT_EQ(this->depthBelow(model, 0), topology.depth);
    EXPECT_GT(topology.stackCapacity(), std::size_t(topology.depth));
    ASSERT_EQ(mesh.triangles.size(), topology.slots.leaves());
    EXPECT_GE(topology.bytes(), 8 * mesh.triangles.size());
    for (int i = 0; i < model.getNumBVs(); ++i) {
      const auto& node = model.getBV(i);
      if (!node.isLeaf()) continue;
      for (int k = 0; k < 3; ++k)
        EXPECT_EQ(mesh.triangles[std::size_t(node.primitiveId())][k],
                  topology.slots.verticesOf(std::size_t(node.first_primitive))[std::size_t(k)]);
    }
  }
}

/// Links are FCL's, and each inner node has a number of its own.
TYPED_TEST(Trees, LinksAreFcls) {
  for (const auto& mesh : this->meshes()) {
    fcl::BVHModel<fcl::RSS<TypeParam>> model;
    fillModel(mesh, model);
    Topology topology;
    topology.assign(model);
    std::vector<bool> seen(mesh.triangles.size() - 1);
    for (int i = 0; i < model.getNumBVs(); ++i) {
      const auto& node = model.getBV(i);
      ASSERT_EQ(node.isLeaf(), topology.isLeaf(i));
      if (node.isLeaf()) {
        EXPECT_EQ(node.first_primitive, topology.leafIndex(i));
      } else {
        EXPECT_EQ(node.leftChild(), topology.left(i));
        ASSERT_LT(topology.innerIndex(i), seen.size());
        EXPECT_FALSE(seen[topology.innerIndex(i)]);
        seen[topology.innerIndex(i)] = true;
      }
    }
  }
}

}  // namespace topology_test
}  // namespace adaptive_bvh_test
