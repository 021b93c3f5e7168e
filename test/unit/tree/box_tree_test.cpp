// Topology and the tree of boxes, against FCL's nodes and the vertices below them.
#include "tree/box_tree.h"

#include <gtest/gtest.h>

#include "model_state.h"
#include "support/long_mode.h"
#include "support/random_geometry.h"
#include "tree/topology.h"

namespace adaptive_bvh_test {
namespace box_tree_test {

using adaptive_bvh::AdaptiveBVHModel;
using adaptive_bvh::Box;
using adaptive_bvh::BoxNode;
using adaptive_bvh::BoxTree;
using adaptive_bvh::Float4;
using adaptive_bvh::Topology;

void expectEqual(const Box& expected, const Box& found) {
  for (int k = 0; k < 3; ++k) {
    EXPECT_EQ(expected.low[k], found.low[k]);
    EXPECT_EQ(expected.high[k], found.high[k]);
  }
}

/// A node's link shares its memory with the box: neither disturbs the other, also for the numbers
/// of the largest trees.
TEST(BoxNode, KeepsBoxAndLinkApart) {
  const Box box{{-1, -2, -3, 99}, {4, 5, 6, -99}}, other{{7, 8, 9, 0}, {7, 8, 9, 0}};
  for (const int number : {0, 1, 2, 12345, 100000000}) {
    BoxNode node;
    node.setBox(box);
    node.setLeafIndex(number);
    EXPECT_TRUE(node.isLeaf());
    EXPECT_EQ(number, node.leafIndex());
    expectEqual(box, node.box());
    node.setBox(other);
    EXPECT_EQ(number, node.leafIndex());
    node.setLeft(number);
    EXPECT_FALSE(node.isLeaf());
    EXPECT_EQ(number, node.left());
    expectEqual(other, node.box());
    EXPECT_EQ(0, node.largeIndex());
    node.setLargeIndex(number);
    node.setBox(box);
    EXPECT_EQ(number, node.largeIndex());
    EXPECT_EQ(number, node.left());
    expectEqual(box, node.box());
    EXPECT_TRUE(std::isnormal(node.box().low[3])) << "the fourth lane takes part in arithmetic";
    EXPECT_TRUE(std::isnormal(node.box().high[3]));
  }
  EXPECT_EQ(32u, sizeof(BoxNode)) << "siblings share a cache line";
}

template <typename S>
class Trees : public testing::Test {
 protected:
  using BV = fcl::RSS<S>;

  static std::vector<TriangleMesh<S>> meshes() {
    std::mt19937 random(testSeed(3));
    return {plate<S>(1, 1), plate<S>(7, 5), tube<S>(6, 9), soup<S>(50, random), soup<S>(1, random)};
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
    topology.adopt(model);
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

/// Nodes with three triangles or more are numbered from 0.
TYPED_TEST(Trees, LargeNodesHaveNumbersOfTheirOwn) {
  using S = TypeParam;
  for (const auto& mesh : this->meshes()) {
    fcl::BVHModel<fcl::RSS<S>> model;
    fillModel(mesh, model);
    BoxTree<S> boxes;
    boxes.adopt(model);
    int large = 0;
    for (int i = 0; i < model.getNumBVs(); ++i) {
      boxes.nodes().setBox(i, Box{{7, 8, 9, 0}, {7, 8, 9, 0}});
      if (model.getBV(i).num_primitives > 2) {
        EXPECT_EQ(large++, boxes.nodes().largeIndex(i));
      }
    }
    EXPECT_EQ(large, boxes.largeNodes());
  }
}

/// Adopted links are FCL's.
TYPED_TEST(Trees, BoxesHaveFclsLinks) {
  using S = TypeParam;
  for (const auto& mesh : this->meshes()) {
    fcl::BVHModel<fcl::RSS<S>> model;
    fillModel(mesh, model);
    BoxTree<S> boxes;
    boxes.adopt(model);
    const auto nodes = boxes.nodes();
    for (int i = 0; i < model.getNumBVs(); ++i) {
      const auto& node = model.getBV(i);
      ASSERT_EQ(node.isLeaf(), nodes.isLeaf(i));
      if (node.isLeaf())
        EXPECT_EQ(node.first_primitive, nodes.leafIndex(i));
      else
        EXPECT_EQ(node.leftChild(), nodes.left(i));
    }
    EXPECT_GE(boxes.bytes(), std::size_t(model.getNumBVs()) * sizeof(BoxNode));
    const Box box{{1, 2, 3, 0}, {3, 4, 5, 0}};
    nodes.setBox(0, box);
    expectEqual(box, boxes.root());
    EXPECT_EQ(boxes.frame.fromBodyFrame(Float4{2, 3, 4, 0}), boxes.middle());
  }
}

/// In a model every box is exactly the box of the vertices below, in body coordinates: after the
/// build, after a step of all vertices and after one of some.
TYPED_TEST(Trees, BoxesOfAModelAreTightAfterEveryStep) {
  using S = TypeParam;
  RandomGeometry<S> random(43);
  for (const auto& mesh : this->meshes()) {
    AdaptiveBVHModel<fcl::RSS<S>> model;
    fillModel(mesh, model);
    const auto& tree = adaptive_bvh::detail::ModelAccess<fcl::RSS<S>>::tree(model);
    std::vector<Vector3<S>> positions = mesh.vertices;
    for (int step = 0; step < 12; ++step) {
      for (int i = 0; i < model.getNumBVs(); ++i) {
        const auto& node = model.getBV(i);
        Box expected{{1e9f, 1e9f, 1e9f, 0}, {-1e9f, -1e9f, -1e9f, 0}};
        for (int leaf = 0; leaf < node.num_primitives; ++leaf)
          for (const unsigned v :
               tree.topology.slots.verticesOf(std::size_t(node.first_primitive + leaf)))
            expected.add(tree.boxes->frame.toBodyFrame(model.vertices[v]));
        expectEqual(expected, tree.boxes->nodes().box(i));
      }
      const unsigned v = unsigned(random.below(int(positions.size())));
      if (step % 3 == 0) {
        for (auto& p : positions) p += random.point() / 10;
        model.update(positions);
      } else {
        positions[v] += random.point() / 10;
        model.update(std::vector<unsigned>{v}, {positions[v]});
      }
      if (testing::Test::HasFailure()) return;
    }
  }
}

}  // namespace box_tree_test
}  // namespace adaptive_bvh_test
