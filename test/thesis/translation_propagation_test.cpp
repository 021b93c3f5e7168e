// Propagation::TranslationCompensated by hand: a part that moves as a whole does not grow, one that
// is strained grows by its own strain, and the numbers kept beside the tree say so.
#include "thesis/translation_propagation.h"

#include <gtest/gtest.h>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/query.h"
#include "support/brute_force.h"
#include "support/fcl_float.h"
#include "support/long_mode.h"
#include "thesis/model_state.h"

namespace adaptive_bvh_test {
namespace translation_propagation_test {

using adaptive_bvh::AdaptiveBVHModel;
using adaptive_bvh::FitnessCriterion;
using adaptive_bvh::RefitPolicy;

class TranslationPropagationOf : public testing::Test {
 protected:
  using BV = fcl::RSSd;

  TranslationPropagationOf() : mesh_(plate(6, 6)), positions_(mesh_.vertices) {
    RefitPolicy policy;
    policy.criterion = FitnessCriterion::RefitNone;
    model_.setRefitPolicy(policy);
    fillModel(mesh_, model_);
    for (int i = 0; i < model_.getNumBVs(); ++i) before_.push_back(model_.getBV(i).bv);
  }

  void update() {
    model_.update(positions_);
    std::string reason;
    EXPECT_TRUE(model_.validate(&reason)) << reason;
  }

  const adaptive_bvh::AdaptiveTree<BV>& tree() const {
    return adaptive_bvh::detail::ModelAccess<BV>::tree(model_);
  }

  /// The motion of single precision, rounded up by one part in 2^20 and a little more.
  static constexpr double kRounding = 1e-5;

  TriangleMesh mesh_;
  std::vector<fcl::Vector3d> positions_;
  AdaptiveBVHModel<BV> model_;
  std::vector<BV> before_;
};

TEST_F(TranslationPropagationOf, ATranslationMovesVolumesAndDoesNotInflateThem) {
  const fcl::Vector3d by(0.3, -0.2, 0.5);
  const double rounding =
      100 * std::numeric_limits<double>::epsilon();  // of positions up to 5, some times
  for (int frame = 1; frame <= 5; ++frame) {
    for (auto& p : this->positions_) p += by;
    this->update();
    EXPECT_EQ(this->model_.getNumBVs(), this->model_.lastUpdate().moved);
    EXPECT_EQ(0, this->model_.lastUpdate().inflated);
    for (int i = 0; i < this->model_.getNumBVs(); ++i) {
      const auto &now = this->model_.getBV(i).bv, &then = this->before_[std::size_t(i)];
      EXPECT_LE((now.To - then.To - double(frame) * by).norm(), double(frame) * rounding) << i;
      EXPECT_GE(now.r, then.r);
      EXPECT_LE(now.r - then.r, double(frame) * rounding) << i;
      EXPECT_EQ(then.axis, now.axis);
    }
  }
}

/// A body that is carried along while it deforms a little grows by its deformation.
TEST_F(TranslationPropagationOf, ACarriedBodyGrowsByItsStrainOnly) {
  const double strain = 1e-9;
  for (std::size_t v = 0; v < this->positions_.size(); ++v)
    this->positions_[v] += fcl::Vector3d(20, strain * double(v % 2), 0);
  this->update();
  EXPECT_GT(this->model_.lastUpdate().inflated, this->model_.getNumBVs() / 2);
  for (int i = 0; i < this->model_.getNumBVs(); ++i) {
    const double grown = this->model_.getBV(i).bv.r - this->before_[std::size_t(i)].r;
    EXPECT_GE(grown, 0);
    EXPECT_LE(grown, strain / 2 * 1.2 + 1000 * std::numeric_limits<double>::epsilon()) << i;
  }
}

/// Displacements lie in [0, d]: every volume above goes d/2 along and grows by |d|/2.
TEST_F(TranslationPropagationOf, OneVertexCarriesHalfItsWayAlong) {
  const fcl::Vector3d d(0.06, -0.02, 0.09);
  this->positions_[24] += d;
  this->update();
  int above = 0;
  for (int i = 0; i < this->model_.getNumBVs(); ++i) {
    const auto &now = this->model_.getBV(i).bv, &then = this->before_[std::size_t(i)];
    const fcl::Vector3d shift = now.To - then.To;
    const bool moved = shift.norm() > 0.01;
    above += moved;
    EXPECT_LE((shift - (moved ? (d / 2).eval() : fcl::Vector3d::Zero().eval())).norm(),
              this->kRounding);
    EXPECT_NEAR(moved ? d.norm() / 2 : 0, now.r - then.r, this->kRounding) << i;
    EXPECT_NEAR(then.r, this->model_.originalRadius(i), this->kRounding) << i;
  }
  EXPECT_GT(above, 6);
  EXPECT_LT(above, this->model_.getNumBVs() / 2);
}

/// Volumes that are not visited grow in every step, but are replaced before they outgrow the boxes
/// around their triangles.
TEST_F(TranslationPropagationOf, VolumesThatAreNotVisitedDoNotOutgrowTheirTriangles) {
  RefitPolicy policy;
  policy.criterion = FitnessCriterion::AB;
  this->model_.setRefitPolicy(policy);
  Deformation bend(this->mesh_, Deformation::Kind::Smooth, 2);
  double largest = 0;
  for (int frame = 0; frame < 400; ++frame) {
    this->positions_ = bend.next();
    // A query that saw nothing: no node counts as visited.
    this->tree().statistics.recordQuery(adaptive_bvh::QueryWork());
    this->update();
    ASSERT_LE(this->model_.lastUpdate().refitted(), this->model_.getNumBVs() / 64 + 1)
        << "those whose turn it is";
    for (int i = 0; i < this->model_.getNumBVs(); ++i) {
      const auto& node = this->model_.getBV(i);
      Eigen::AlignedBox<double, 3> box;
      for (int leaf = 0; leaf < node.num_primitives; ++leaf)
        for (const unsigned v :
             this->tree().topology.slots.verticesOf(std::size_t(node.first_primitive + leaf)))
          box.extend(this->positions_[v]);
      const double diagonal = box.diagonal().norm();
      const double one_round = double(65 * 0.1);
      ASSERT_LE(this->model_.getBV(i).bv.r, diagonal + one_round) << i;
      largest = std::max(largest, this->model_.getBV(i).bv.r);
    }
  }
  // The same without the bound, for comparison.
  RefitPolicy never;
  never.criterion = FitnessCriterion::RefitNone;
  AdaptiveBVHModel<fcl::RSSd> left_alone(never);
  fillModel(this->mesh_, left_alone);
  Deformation again(this->mesh_, Deformation::Kind::Smooth, 2);
  for (int frame = 0; frame < 400; ++frame) left_alone.update(again.next());
  double grown = 0;
  for (int i = 0; i < left_alone.getNumBVs(); ++i)
    grown = std::max(grown, left_alone.getBV(i).bv.r);
  EXPECT_GT(grown, 5 * largest);
}

/// The bound on what moving rounds holds for steps of all sizes, and none is lost in it.
TEST_F(TranslationPropagationOf, SumsOverStepsLoseNothing) {
  std::mt19937 random(testSeed(5));
  std::uniform_real_distribution<double> exponent(-9, -1);
  for (int step = 0; step < 3000; ++step) {
    const double by = double(std::pow(10, exponent(random)));
    this->positions_[7][step % 3] += step % 2 ? by : -by;  // one vertex, the others stay
    this->model_.update(this->positions_);
    if (step % 100 != 0) continue;
    for (int i = 0; i < this->model_.getNumBVs(); ++i) {
      const auto& bv = this->model_.getBV(i).bv;
      ASSERT_LE(adaptive_bvh::Volume<fcl::RSSd>::cornerSum(bv),
                this->tree().inflations.coordinateSum());
    }
  }
  std::string reason;
  EXPECT_TRUE(this->model_.validate(&reason)) << reason;

  adaptive_bvh::Inflations<double> bounds;
  bounds.include(1);
  const double little = std::numeric_limits<double>::epsilon() / 64;
  for (int step = 0; step < 1000; ++step) bounds.extend(little, 1);
  EXPECT_GE(bounds.coordinateSum(), 1 + 4000 * little);
}

/// At the documented limit nothing overflows.
TEST_F(TranslationPropagationOf, ManagesTheLargestCoordinates) {
  const int exponent = 252;
  const auto scaled = [&](std::vector<fcl::Vector3d> positions) {
    for (auto& p : positions)
      for (int k = 0; k < 3; ++k) {
        p[k] = std::min(std::max(p[k], -1.), 1.);
        p[k] = std::ldexp(p[k], exponent);
      }
    return positions;
  };
  TriangleMesh mesh = this->mesh_, tool = tube(5, 6);
  for (auto& p : mesh.vertices) p = 2 * p - fcl::Vector3d(1, 1, 0.5);  // corners at the limit
  for (auto& p : tool.vertices) p *= 0.5;
  AdaptiveBVHModel<fcl::RSSd> small, other_small, large, other;
  fillModel(mesh, small);
  fillModel(tool, other_small);
  fillModel(TriangleMesh{scaled(mesh.vertices), mesh.triangles}, large);
  fillModel(TriangleMesh{scaled(tool.vertices), tool.triangles}, other);
  const fcl::Transform3d still = fcl::Transform3d::Identity();
  for (int frame = 0; frame < 12; ++frame) {
    std::vector<fcl::Vector3d> positions = mesh.vertices;
    for (auto& p : positions) p[2] += 0.1 * double(frame % 5) * p[0] * p[0];
    small.update(positions);
    large.update(scaled(positions));
    std::string reason;
    ASSERT_TRUE(large.validate(&reason)) << reason;
    const double expected = BruteForce(small, still, other_small, still).distance();
    const double tolerance = 1e-12;
    fcl::DistanceResultd ours, plain;
    adaptive_bvh::distance(&large, still, &other, still, fcl::DistanceRequestd(), ours);
    fcl::distance(&large, still, &other, still, fcl::DistanceRequestd(), plain);
    EXPECT_NEAR(expected, std::ldexp(ours.min_distance, -exponent), tolerance) << frame;
    EXPECT_NEAR(expected, std::ldexp(plain.min_distance, -exponent), tolerance) << frame;
    fcl::CollisionResultd few, many;
    const fcl::CollisionRequestd all(10000);
    EXPECT_EQ(adaptive_bvh::collide(&small, still, &other_small, still, all, few),
              adaptive_bvh::collide(&large, still, &other, still, all, many));
  }
  std::vector<fcl::Vector3d> beyond = scaled(mesh.vertices);
  beyond[3][1] = std::nextafter(std::ldexp(1., exponent), std::numeric_limits<double>::infinity());
  EXPECT_THROW(large.update(beyond), std::invalid_argument);
  EXPECT_TRUE(large.validate());
}

TEST_F(TranslationPropagationOf, ManagesHugeAndTinyMeshes) {
  const double huge = 1e75;
  for (const double scale : {1 / huge, 1e-6, huge}) {
    AdaptiveBVHModel<fcl::RSSd> model;
    TriangleMesh mesh = this->mesh_;
    for (auto& p : mesh.vertices) p *= scale;
    fillModel(mesh, model);
    Deformation bend(this->mesh_, Deformation::Kind::Smooth, 3);
    for (int frame = 0; frame < 10; ++frame) {
      std::vector<fcl::Vector3d> positions = bend.next();
      for (auto& p : positions) p *= scale;
      model.update(positions);
      std::string reason;
      ASSERT_TRUE(model.validate(&reason)) << reason << " at scale " << scale;
    }
  }
}

}  // namespace translation_propagation_test
}  // namespace adaptive_bvh_test
