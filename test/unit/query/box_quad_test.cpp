// Four nodes below one: together they hold its leaves, each once, and their boxes are the tree's.
#include "query/box_quad.h"

#include <gtest/gtest.h>

#include <set>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "model_state.h"
#include "support/meshes.h"

namespace adaptive_bvh_test {
namespace box_quad_test {

using adaptive_bvh::Box;
using adaptive_bvh::BoxNode;
using adaptive_bvh::BoxNodes;
using adaptive_bvh::BoxQuad;
using adaptive_bvh::CountedNode;
using Model = adaptive_bvh::AdaptiveBVHModel<fcl::RSSd>;

class BoxQuadTest : public testing::Test {
 protected:
  BoxQuadTest() { fillModel(plate<double>(9, 7), model_); }

  BoxNodes<const BoxNode> nodes() const {
    return adaptive_bvh::detail::ModelAccess<fcl::RSSd>::tree(model_).boxes->nodes();
  }
  CountedNode counted(int node) const { return {node, model_.getBV(node).num_primitives}; }
  std::multiset<int> leaves(int node) const {
    const auto& bv = model_.getBV(node);
    if (bv.isLeaf()) return {node};
    std::multiset<int> below = leaves(bv.leftChild());
    below.merge(leaves(bv.rightChild()));
    return below;
  }
  void expectBoxes(const BoxQuad& quad) const {
    for (int lane = 0; lane < 4; ++lane) {
      const Box box = nodes().box(quad.below[lane < quad.count ? lane : 0].node);
      for (int k = 0; k < 3; ++k) {
        EXPECT_EQ(quad.boxes.low[k][lane], box.low[k]);
        EXPECT_EQ(quad.boxes.high[k][lane], box.high[k]);
      }
    }
  }

  Model model_;
};

TEST_F(BoxQuadTest, HoldsWhatIsBelowOnce) {
  for (int node = 0; node < model_.getNumBVs(); ++node) {
    if (model_.getBV(node).isLeaf()) continue;
    BoxQuad quad;
    quad.setBelow(nodes(), counted(node));
    std::multiset<int> below, left;
    for (int i = 0; i < quad.count; ++i) {
      EXPECT_EQ(quad.below[i].leaves, model_.getBV(quad.below[i].node).num_primitives);
      below.merge(leaves(quad.below[i].node));
      if (quad.leftLanes() >> i & 1) left.merge(leaves(quad.below[i].node));
    }
    EXPECT_EQ(below, leaves(node));
    EXPECT_EQ(left, leaves(model_.getBV(node).leftChild()));
    EXPECT_EQ(quad.lanes(), (1u << quad.count) - 1);
    expectBoxes(quad);
  }
}

TEST_F(BoxQuadTest, OfFewLeavesIsOfSingleOnes) {
  for (int node = 0; node < model_.getNumBVs(); ++node) {
    const int leaves = model_.getBV(node).num_primitives;
    if (leaves < 2 || leaves > BoxQuad::kSmall) continue;
    BoxQuad quad;
    quad.setBelow(nodes(), counted(node));
    EXPECT_EQ(quad.count, leaves);
  }
}

TEST_F(BoxQuadTest, MayBeANodeAlone) {
  for (int node : {0, *leaves(0).begin()}) {
    BoxQuad quad;
    quad.setNode(nodes(), counted(node));
    ASSERT_EQ(quad.count, 1);
    EXPECT_EQ(quad.below[0].node, node);
    expectBoxes(quad);
  }
}

TEST_F(BoxQuadTest, KnowsItsLargestBox) {
  BoxQuad quad;
  quad.setBelow(nodes(), counted(0));
  float most = 0;
  for (int i = 0; i < quad.count; ++i) {
    const Box box = nodes().box(quad.below[i].node);
    most = std::max(most, adaptive_bvh::float4::sum(box.high - box.low));
  }
  EXPECT_NEAR(quad.largest(), most, 1e-6f);
}

}  // namespace box_quad_test
}  // namespace adaptive_bvh_test
