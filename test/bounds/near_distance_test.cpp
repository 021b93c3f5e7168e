// What a search on four-wide trees with common coordinates prunes by, against the distances of the
// triangles in long double: gaps of boxes, and TriangleBlock on positions with residuals.
#include "query/near_distance.h"

#include <gtest/gtest.h>

#include "model_state.h"
#include "support/exact_geometry.h"
#include "support/random_geometry.h"

namespace adaptive_bvh_test {
namespace near_distance_test {

using adaptive_bvh::AdaptiveBVHModel;
using adaptive_bvh::CommonGaps;
using adaptive_bvh::Gaps4x4;
using adaptive_bvh::Origin4;
using adaptive_bvh::PlacedMesh;
using adaptive_bvh::RelativeFrame;
using adaptive_bvh::TriangleBlock;
using adaptive_bvh::Triangles4;
using adaptive_bvh::TriangleSides;
using adaptive_bvh::WideNode;
using adaptive_bvh::WideTree;
using exact::Real;

using BV = fcl::RSSd;
using Model = AdaptiveBVHModel<BV>;
using P = Vector3<double>;

/// Two bodies side by side, whose trees have the same coordinates.
class CommonCoordinates : public testing::Test {
 protected:
  TriangleMesh<double> body(double size, const P& at) {
    const int side = 2 + random_.below(3);
    TriangleMesh<double> mesh =
        random_.oneIn(2) ? plate<double>(side, side) : tube<double>(3 + random_.below(4), side);
    for (P& p : mesh.vertices) p = size * (p + 0.2 * random_.point()) + at;
    return mesh;
  }
  static PlacedMesh<BV> placed(const Model& model, const fcl::Transform3d& tf) {
    return {&model, &adaptive_bvh::detail::ModelAccess<BV>::tree(model), tf};
  }
  /// In the model's own coordinates, placed by (R, T).
  static exact::Triangle triangle(const Model& model, int index, const fcl::Matrix3d& R,
                                  const P& T) {
    exact::Triangle t;
    for (int k = 0; k < 3; ++k)
      t[std::size_t(k)] =
          exact::of(R) * exact::of(model.vertices[model.tri_indices[index][std::size_t(k)]]) +
          exact::of(T);
    return t;
  }

  RandomGeometry<double> random_{61};
};

TEST_F(CommonCoordinates, NoBoundExceedsTheDistanceOfTheTriangles) {
  long pairs = 0, positive = 0, close = 0, block_positive = 0;
  int same = 0;
  for (int round = 0; round < 150; ++round) {
    const double size = random_.size(-4, 4), far = size * random_.size(-1, 3);
    const P at = random_.point() * far;
    Model first, second;
    fillModel(body(size, at), first);
    const fcl::Transform3d tf1 = random_.pose(far);
    // The second lies beside the first, in its own coordinates somewhere else.
    const fcl::Transform3d tf2 = random_.pose(far);
    const P where = tf1 * (at + random_.point() * size * random_.size(-3, 0.3));
    const double size2 = size * random_.size(-1, 0.5);
    fillModel(body(size2, tf2.inverse() * where), second);
    for (Model* model : {&first, &second}) model->computeLocalAABB();
    const PlacedMesh<BV> a = placed(first, tf1), b = placed(second, tf2);
    const fcl::Matrix3d R = tf1.linear().transpose() * tf2.linear();
    const P T = tf1.linear().transpose() * (tf2.translation() - tf1.translation());

    const bool expected = adaptive_bvh::canShareCoordinates(a, b, R, T);
    const auto trees = adaptive_bvh::wideTreesOf(a, b);
    const RelativeFrame<double> frame(trees.first, trees.second, R, T);
    ASSERT_EQ(expected, adaptive_bvh::canShareCoordinates(a, b, R, T)) << "after the trees exist";
    if (!frame.isSame()) continue;
    ASSERT_TRUE(expected);
    ++same;

    const CommonGaps gaps(trees.first.scale());
    const P direction = random_.direction();
    const auto in_body =
        adaptive_bvh::vectors::all(trees.first.coordinates().axes().transpose() * direction);
    const double unit = 1 / trees.first.scale(),
                 error = 4 * double(frame.same().preciseError()) * unit;
    for (int n2 = 0; n2 < trees.second.size(); ++n2) {
      const WideNode& q = trees.second.nodes()[n2];
      if (!q.isLeaf()) continue;
      const auto& slots1 = a.tree->topology.slots;
      const auto& slots2 = b.tree->topology.slots;
      const Origin4 origin(slots2, trees.second, q);
      const Triangles4 block2 = origin.corners(slots2, trees.second, q);
      const TriangleSides side2(block2, in_body);
      for (int n1 = 0; n1 < trees.first.size(); ++n1) {
        const WideNode& p = trees.first.nodes()[n1];
        if (!p.isLeaf()) continue;
        const Gaps4x4 squared = adaptive_bvh::squaredGaps(p.boxes, q.boxes);
        const Triangles4 block1 = origin.corners(slots1, trees.first, p);
        const TriangleSides side1(block1, in_body);
        const TriangleBlock block(side1, side2);
        const std::array<adaptive_bvh::Float4, 4> bounds = {block.bounds<0>(), block.bounds<1>(),
                                                            block.bounds<2>(), block.bounds<3>()};
        for (int j = 0; j < q.count; ++j)
          for (int i = 0; i < p.count; ++i) {
            const auto index = [](const WideTree<double>& tree, const WideNode& leaf, int lane) {
              return tree.triangle(unsigned(leaf.first + lane));
            };
            const Real d = exact::distance(
                triangle(first, index(trees.first, p, i), fcl::Matrix3d::Identity(), P::Zero()),
                triangle(second, index(trees.second, q, j), R, T));
            ++pairs;
            ASSERT_LE(Real(gaps.distanceFor(squared(i, j))), d);
            ASSERT_LT(squared(i, j),
                      gaps.squaredGapFor(double(d * (1 + Real(1e-15)) + Real(1e-300))))
                << "a pair nearer than that would be pruned";
            positive += squared(i, j) > 0;
            close += gaps.distanceFor(squared(i, j)) > 0.9 * double(d);
            const Real bound = Real(bounds[std::size_t(j)][i]) * Real(unit) - Real(error);
            ASSERT_LE(bound, d + 4 * Real(std::numeric_limits<double>::epsilon()) *
                                     Real(T.lpNorm<1>() + at.lpNorm<1>() + size));
            block_positive += bound > d / 2;
          }
      }
    }
  }
  EXPECT_GT(same, 100);
  EXPECT_GT(pairs, 20000);
  EXPECT_GT(positive, pairs / 2);
  EXPECT_GT(close, pairs / 20) << "boxes are no looser than their sides";
  EXPECT_GT(block_positive, pairs / 2) << "-infinity would be a lower bound, too";
}

/// Gaps that underflow when they are squared: two boxes that touch are never pruned.
TEST_F(CommonCoordinates, TouchingBoxesAreNotPrunedHoweverSmallTheLimit) {
  for (double scale : {1e-30, 1., 1e30})
    for (double distance : {0., 1e-300, 1e-40, 1e-20, 1e-10}) {
      const CommonGaps gaps(scale);
      EXPECT_GT(gaps.squaredGapFor(distance), 0);
      EXPECT_EQ(0, gaps.distanceFor(0));
      EXPECT_LE(gaps.squaredGapNear(distance), gaps.squaredGapFor(distance));
    }
}

}  // namespace near_distance_test
}  // namespace adaptive_bvh_test
