// The four-wide tree: its nodes are FCL's, each once, and its boxes hold their triangles.
#include "tree/wide_tree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "support/exact_geometry.h"
#include "support/random_geometry.h"
#include "volume/volume.h"

namespace adaptive_bvh_test {
namespace wide_tree_test {

using adaptive_bvh::BodyFrame;
using adaptive_bvh::Boxes4;
using adaptive_bvh::TaskPool;
using adaptive_bvh::VertexSlots;
using adaptive_bvh::WideNode;
using adaptive_bvh::WideTree;

template <typename S>
class Wide : public testing::Test {
 protected:
  using Model = fcl::BVHModel<fcl::RSS<S>>;

  void adopt(const TriangleMesh<S>& mesh) {
    fillModel(mesh, model_);
    slots_.adopt(model_);
    tree_.adopt(model_, slots_);
  }

  /// Expects that the node's boxes hold all triangles below it, which are added to `triangles`.
  void expectHeld(int number, std::vector<int>& triangles) {
    const WideNode& node = tree_.nodes()[number];
    for (int lane = 0; lane < node.count; ++lane) {
      std::vector<int> below;
      if (node.isLeaf())
        below.push_back(node.first + lane);
      else
        expectHeld(node.below[lane], below);
      for (int t : below)
        for (int k = 0; k < 3; ++k) {
          const auto vertex = std::size_t(tree_.vertices(unsigned(t))[k]);
          const exact::Point y = exact::of(tree_.toBody()) *
                                 (exact::of(model_.vertices[vertex]) - exact::of(tree_.origin()));
          EXPECT_LE(y.template lpNorm<Eigen::Infinity>(), 2.0001L);
          for (int axis = 0; axis < 3; ++axis) {
            EXPECT_LT(node.boxes.low[axis][lane], y[axis]);
            EXPECT_GT(node.boxes.high[axis][lane], y[axis]);
          }
        }
      triangles.insert(triangles.end(), below.begin(), below.end());
    }
    for (int lane = node.count; lane < 4; ++lane)
      EXPECT_GT(node.boxes.low[0][lane], node.boxes.high[0][lane]) << "an empty box";
  }

  Model model_;
  VertexSlots slots_;
  WideTree<S> tree_;
  RandomGeometry<S> random_{61};
};

using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(Wide, Scalars);

TYPED_TEST(Wide, StandsForEveryNodeOnce) {
  for (int triangles : {1, 2, 3, 4, 5, 9, 100, 700}) {
    this->adopt(soup<TypeParam>(triangles, this->random_.engine()));
    std::vector<int> nodes;
    for (int i = 0; i < this->tree_.size(); ++i) {
      const WideNode& node = this->tree_.nodes()[i];
      for (int binary : node.binary)
        if (binary >= 0 && !this->model_.getBV(binary).isLeaf()) nodes.push_back(binary);
      if (node.isLeaf()) nodes.insert(nodes.end(), node.below, node.below + node.count);
    }
    for (int t = 0; t < triangles; ++t)
      EXPECT_EQ(t, this->model_.getBV(this->tree_.leaf(unsigned(t))).first_primitive);
    std::sort(nodes.begin(), nodes.end());
    std::vector<int> all(std::size_t(this->model_.getNumBVs()));
    std::iota(all.begin(), all.end(), 0);
    EXPECT_EQ(all, nodes) << triangles;
  }
}

TYPED_TEST(Wide, BoxesHoldTheirTriangles) {
  using S = TypeParam;
  for (double scale : {1e-3, 1., 1e6}) {
    TriangleMesh<S> mesh = soup<S>(300, this->random_.engine());
    for (Vector3<S>& p : mesh.vertices) p *= S(scale);
    this->adopt(mesh);
    const fcl::Matrix3d axes = randomPose<double>(this->random_.engine(), 0).linear();
    const Vector3<S> origin = Vector3<S>::Constant(S(0.5 * scale));
    const BodyFrame<S> frame(axes, origin, S(scale));
    float size = 0;
    for (const Vector3<S>& p : mesh.vertices)
      for (int k = 0; k < 3; ++k) size = std::max(size, std::abs(frame.toBodyFrame(p)[k]));
    for (int threads : {1, 3}) {
      this->tree_.adopt(this->model_, this->slots_);
      this->tree_.refit(this->model_, this->slots_, {frame, size}, TaskPool(threads));
      std::vector<int> triangles;
      this->expectHeld(0, triangles);
      EXPECT_EQ(300u, triangles.size());
    }
  }
}

}  // namespace wide_tree_test
}  // namespace adaptive_bvh_test
