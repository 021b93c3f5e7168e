// The four-wide tree: it has every triangle once, and its boxes hold their triangles, after a refit
// of all nodes and of those above a few vertices.
#include "boxes/wide_tree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "hierarchy/bottom_up.h"
#include "support/exact_geometry.h"
#include "support/random_geometry.h"

namespace adaptive_bvh_test {
namespace wide_tree_test {

using adaptive_bvh::BodyCoordinates;
using adaptive_bvh::Int4;
using adaptive_bvh::LeafTriangles;
using adaptive_bvh::MeshView;
using adaptive_bvh::OrderedTree;
using adaptive_bvh::TaskPool;
using adaptive_bvh::VertexIndices;
using adaptive_bvh::WideNode;
using adaptive_bvh::WideTree;

class Wide : public testing::Test {
 protected:
  void adopt(const TriangleMesh& mesh) {
    mesh_ = mesh;
    const MeshView<double> view{mesh_.vertices.data(), nullptr, mesh_.triangles.data()};
    const auto count = unsigned(mesh_.triangles.size());
    const OrderedTree order(adaptive_bvh::buildBottomUp(view, count));
    auto leaves = std::make_shared<LeafTriangles>();
    leaves->slots.assign(order, view, mesh_.vertices.size());
    for (const unsigned t : order.primitives) {
      const VertexIndices v = view.verticesOf(t);
      leaves->corners.push_back(Int4{int(v[0]), int(v[1]), int(v[2]), int(t)});
    }
    tree_ = WideTree(order, leaves);
  }

  /// Expects that the node's boxes hold all triangles below it, whose places are added to `places`.
  void expectHeld(int number, std::vector<int>& places) {
    const WideNode& node = tree_.nodes()[number];
    for (int lane = 0; lane < int(node.count); ++lane) {
      std::vector<int> below;
      if (node.isLeaf())
        below.push_back(node.first + lane);
      else
        expectHeld(node.below[lane], below);
      for (int place : below)
        for (int k = 0; k < 3; ++k) {
          const auto vertex = std::size_t(tree_.corners(unsigned(place))[k]);
          const exact::Point y = exact::of(tree_.toBody()) *
                                 (exact::of(mesh_.vertices[vertex]) - exact::of(tree_.origin()));
          EXPECT_LE(y.template lpNorm<Eigen::Infinity>(), 2.0001L);
          for (int axis = 0; axis < 3; ++axis) {
            EXPECT_LT(node.boxes.low[axis][lane], y[axis]);
            EXPECT_GT(node.boxes.high[axis][lane], y[axis]);
          }
        }
      places.insert(places.end(), below.begin(), below.end());
    }
    for (int lane = int(node.count); lane < 4; ++lane)
      EXPECT_GT(node.boxes.low[0][lane], node.boxes.high[0][lane]) << "an empty box";
  }
  /// Expects that of the whole tree, and that it has every triangle once.
  void expectRight() {
    std::vector<int> places, all(mesh_.triangles.size());
    expectHeld(0, places);
    std::iota(all.begin(), all.end(), 0);
    EXPECT_EQ(all, places) << "in the order of the leaves";
    std::vector<int> triangles;
    for (const int place : places) triangles.push_back(tree_.triangle(unsigned(place)));
    std::sort(triangles.begin(), triangles.end());
    EXPECT_EQ(all, triangles);
  }

  TriangleMesh mesh_;
  WideTree tree_;
  RandomGeometry random_{61};
};

TEST_F(Wide, HasEveryTriangleOnce) {
  for (int triangles : {1, 2, 3, 4, 5, 9, 100, 700}) {
    adopt(soup(triangles, random_.engine()));
    const auto coordinates =
        BodyCoordinates::about(fcl::Vector3d::Zero(), fcl::Matrix3d::Identity(), 4);
    tree_.refit(mesh_.vertices.data(), coordinates, TaskPool(1));
    expectRight();
    int leaves = 0;
    for (int i = 0; i < tree_.size(); ++i) {
      const WideNode& node = tree_.nodes()[i];
      EXPECT_EQ(node.isLeaf() ? leaves : -1, node.leaf);
      leaves += node.isLeaf();
      EXPECT_GE(int(node.count), node.isLeaf() ? 1 : 2);
      for (int k = 0; k < int(node.count) && !node.isLeaf(); ++k) EXPECT_GT(node.below[k], i);
    }
  }
}

TEST_F(Wide, BoxesHoldTheirTriangles) {
  for (double scale : {1e-3, 1., 1e6}) {
    TriangleMesh mesh = soup(300, random_.engine());
    for (fcl::Vector3d& p : mesh.vertices) p *= double(scale);
    const fcl::Matrix3d axes = randomPose(random_.engine(), 0).linear();
    const fcl::Vector3d origin = fcl::Vector3d::Constant(double(0.5 * scale));
    double size = 0;
    for (const fcl::Vector3d& p : mesh.vertices)
      size = std::max(size, (axes.transpose() * (p - origin)).cwiseAbs().maxCoeff());
    const auto coordinates = BodyCoordinates::about(origin, axes, size);
    for (int threads : {1, 3}) {
      adopt(mesh);
      tree_.refit(mesh_.vertices.data(), coordinates, TaskPool(threads));
      expectRight();
    }
    // Node by node, those below first.
    for (fcl::Vector3d& p : mesh_.vertices) p += 0.1 * (origin - p);
    for (int node = tree_.size(); node-- > 0;) tree_.refitNode(mesh_.vertices.data(), node);
    expectRight();
  }
}

}  // namespace wide_tree_test
}  // namespace adaptive_bvh_test
