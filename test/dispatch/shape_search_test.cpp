// What a search of a mesh and a shape prunes by, against distances in long double.
#include "dispatch/shape_search.h"

#include <gtest/gtest.h>

#include "solids/flat.h"
#include "solids/shape_solid.h"
#include "support/exact_geometry.h"
#include "support/random_geometry.h"
#include "support/shapes.h"
#include "support/test_mesh.h"

namespace adaptive_bvh_test {
namespace shape_search_test {

using adaptive_bvh::PlacedMesh;
using adaptive_bvh::ShapeCore;
using adaptive_bvh::ShapeInTree;
using adaptive_bvh::WideNode;
using adaptive_bvh::WideTree;
using exact::Real;

/// Of a point in the shape's frame.
Real distanceToCore(const ShapeCore& core, const exact::Point& x) {
  const exact::Point y = exact::of(core.axes).transpose() * x;
  exact::Point gap;
  for (int k = 0; k < 3; ++k)
    gap[k] = std::max({Real(0), Real(core.low[k]) - y[k], y[k] - Real(core.high[k])});
  return gap.norm();
}

class ShapeBounds : public testing::Test {
 protected:
  using Mesh = adaptive_bvh::DeformableMesh;

  /// Of any proportions: a point, a needle, a box, a slab, a half-space; with a radius or without.
  ShapeCore core(double size) {
    ShapeCore core;
    if (random_.oneIn(3)) {
      const double d = random_.size(-2, 1) * size;
      core = adaptive_bvh::FlatSolid(random_.point(), d, random_.oneIn(2)).core();
    } else {
      for (int k = 0; k < 3; ++k) {
        core.high[k] = random_.oneIn(3) ? 0 : random_.size(-2, 3) * size;
        core.low[k] = random_.oneIn(2) ? -core.high[k] : core.high[k] - 1e-3 * size;
      }
    }
    if (random_.oneIn(2)) core.radius = random_.size(-3, 1) * size;
    return core;
  }

  /// Expects of all boxes around a triangle that they are not farther than a distance. Returns
  /// whether it is below the node.
  bool expectFound(const WideTree& tree, const ShapeInTree& shape, int number, int triangle,
                   Real distance) {
    const WideNode& node = tree.nodes()[number];
    for (int lane = 0; lane < int(node.count); ++lane) {
      const bool holds = node.isLeaf()
                             ? node.first + lane == triangle
                             : expectFound(tree, shape, node.below[lane], triangle, distance);
      if (!holds) continue;
      const double above = std::nextafter(double(distance), 1e300);
      EXPECT_LE(shape.squaredGaps(node.boxes)[lane], shape.squaredLimit(above));
      // What prunes: nearer by a tenth, and by a hundredth of the tree.
      pruned_ += node.isLeaf() && shape.squaredGaps(node.boxes)[lane] >
                                      shape.squaredLimit(0.9 * above - 0.01 / tree.scale());
      return true;
    }
    return false;
  }

  RandomGeometry random_{71};
  long pruned_ = 0, apart_ = 0;
};

TEST_F(ShapeBounds, DoNotExceedTheDistancesOfPoints) {
  for (int round = 0; round < 300; ++round) {
    const double size = this->random_.size(-3, 3), far = size * this->random_.size(-1, 3);
    TriangleMesh triangles = plate(4, 3);
    for (fcl::Vector3d& p : triangles.vertices) p = size * (p + 0.3 * this->random_.point());
    const Mesh mesh(triangles);
    const fcl::Transform3d mesh_tf = this->random_.pose(far);
    const PlacedMesh placed(mesh, mesh_tf);
    fcl::Transform3d shape_tf = this->random_.pose(size);
    shape_tf.translation() += mesh_tf.translation();
    const ShapeCore core = this->core(double(size));
    const WideTree& tree = placed.tree();
    const ShapeInTree shape(core, shape_tf, tree, placed.tf);
    ASSERT_TRUE(shape.isPrecise());
    const exact::Placement mesh_at = exact::placement(mesh_tf),
                           shape_at = exact::placement(shape_tf);
    for (int i = 0; i < numTriangles(mesh); ++i) {
      const adaptive_bvh::TrianglePoints corners = placed.pointsAt(unsigned(i));
      Real u = Real(this->random_.size(-3, 0)), v = Real(this->random_.size(-3, 0));
      if (u + v > 1) u = 1 - u, v = 1 - v;
      exact::Point x = (1 - u - v) * exact::of(corners[0]) + u * exact::of(corners[1]) +
                       v * exact::of(corners[2]);
      x = shape_at.R.transpose() * (mesh_at(x) - shape_at.T);
      const Real distance = std::max(distanceToCore(core, x) - Real(core.radius), Real(0));
      EXPECT_TRUE(this->expectFound(tree, shape, 0, i, distance));
      this->apart_ += distance > Real(size) / 10;
    }
  }
  EXPECT_GT(this->apart_, 1000);
  EXPECT_GT(this->pruned_, this->apart_ / 3);
}

/// Cores hold their shapes: the farthest points along any direction.
TEST_F(ShapeBounds, CoresHoldTheirShapes) {
  for (const auto& shape : boundedShapes()) {
    const adaptive_bvh::ShapeSolid solid(*shape);
    const ShapeCore& core = solid.core();
    shape->computeLocalAABB();
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR(double(shape->aabb_local.min_[k]), core.low[k] - core.radius, 1e-6);
      EXPECT_NEAR(double(shape->aabb_local.max_[k]), core.high[k] + core.radius, 1e-6);
    }
  }
}

TEST_F(ShapeBounds, AreNotForWhatSinglePrecisionCannotExpress) {
  const Mesh mesh(plate(3, 3));
  const PlacedMesh placed(mesh, fcl::Transform3d(fcl::Transform3d::Identity()));
  const WideTree& tree = placed.tree();
  fcl::Transform3d away = fcl::Transform3d::Identity();
  ShapeCore ball;
  ball.low = ball.high = fcl::Vector3d::Zero();
  ball.radius = 0.5;
  EXPECT_TRUE(ShapeInTree(ball, away, tree, placed.tf).isPrecise());
  away.translation()[0] = 1e20;
  EXPECT_FALSE(ShapeInTree(ball, away, tree, placed.tf).isPrecise());
  away.translation()[0] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(ShapeInTree(ball, away, tree, placed.tf).isPrecise());
  away.translation()[0] = 0;
  const ShapeCore nowhere =
      adaptive_bvh::FlatSolid(fcl::Vector3d::Zero(), 1, false).core();  // a plane without a normal
  EXPECT_FALSE(ShapeInTree(nowhere, away, tree, placed.tf).isPrecise());
}

}  // namespace shape_search_test
}  // namespace adaptive_bvh_test
