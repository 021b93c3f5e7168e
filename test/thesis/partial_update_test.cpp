// update(indices, positions): the same model as after an update of all vertices.
#include <gtest/gtest.h>

#include <optional>

#include <limits>
#include <set>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/coherent_distance.h"
#include "adaptive_bvh/query.h"
#include "support/brute_force.h"
#include "support/fcl_float.h"
#include "support/long_mode.h"
#include "support/test_volume.h"

namespace adaptive_bvh_test {
namespace partial_update_test {

using adaptive_bvh::AdaptiveBVHModel;
using adaptive_bvh::FitnessCriterion;
using adaptive_bvh::RefitPolicy;

class PartialUpdate : public testing::Test {
 protected:
  using Model = AdaptiveBVHModel<TestVolume<double>>;
  using Plain = fcl::BVHModel<TestVolume<double>>;

  PartialUpdate() : mesh_(plate(9, 8)), positions_(mesh_.vertices) {
    fillModel(mesh_, model_);
    fillModel(tube(5, 6), tool_);
    pair_.emplace(model_.mesh(), tool_.mesh());
    above_.translation() = fcl::Vector3d(0.3, 0.4, 0.7);
  }

  /// Moves `count` random vertices, in one call.
  void moveSome(std::size_t count, double by) {
    std::uniform_int_distribution<unsigned> vertex(0, unsigned(positions_.size() - 1));
    std::uniform_real_distribution<double> step(-by, by);
    std::vector<unsigned> indices;
    std::vector<fcl::Vector3d> to;
    for (std::size_t i = 0; i < count; ++i) {
      const unsigned v = vertex(random_);
      positions_[v] += fcl::Vector3d(step(random_), step(random_), step(random_));
      indices.push_back(v);
      to.push_back(positions_[v]);
    }
    model_.update(indices, to);
  }

  /// The box that FCL itself finds, and a radius that is no smaller than FCL's, and no larger than
  /// that of the ball around the box.
  static void expectLocalBounds(Model& model) {
    const fcl::AABBd box = model.aabb_local;
    const double radius = model.aabb_radius;
    const fcl::Vector3d center = model.aabb_center;
    model.Plain::computeLocalAABB();
    ASSERT_EQ(model.aabb_local.min_, box.min_);
    ASSERT_EQ(model.aabb_local.max_, box.max_);
    ASSERT_EQ(model.aabb_center, center);
    const double slack = 8 * std::numeric_limits<double>::epsilon() * radius;
    ASSERT_LE(model.aabb_radius, radius + slack);
    ASSERT_LE(radius, (box.max_ - center).norm() + slack);
  }

  void expectRight() {
    std::string reason;
    ASSERT_TRUE(model_.validate(&reason)) << reason;
    for (std::size_t v = 0; v < positions_.size(); ++v)
      ASSERT_EQ(positions_[v], model_.vertices[v]) << v;
    ASSERT_NO_FATAL_FAILURE(expectLocalBounds(model_));

    const double tolerance = 1e-12;
    const BruteForce brute(model_, origin_, tool_, above_);
    const double expected = brute.distance();
    fcl::DistanceResultd recorded, coherent, drop_in;
    const fcl::DistanceRequestd request;
    adaptive_bvh::distance(&model_, origin_, &tool_, above_, request, recorded);
    model_.mesh();  // brings it up to date after a change through the base
    pair_->distance(origin_, above_, request, coherent);
    fcl::distance(&model_, origin_, &tool_, above_, request, drop_in);
    for (const auto& result : {recorded, coherent, drop_in})
      EXPECT_NEAR(expected, result.min_distance, tolerance);
  }

  TriangleMesh mesh_;
  std::vector<fcl::Vector3d> positions_;
  Model model_, tool_;
  std::optional<adaptive_bvh::CoherentDistance> pair_;
  const fcl::Transform3d origin_ = fcl::Transform3d::Identity();
  fcl::Transform3d above_ = origin_;
  std::mt19937 random_{testSeed(23)};
};

TEST_F(PartialUpdate, KeepsTheInvariantAndTheDistance) {
  for (int frame = 0; frame < 120; ++frame) {
    this->moveSome(frame % 7 == 6 ? 0 : std::size_t(1 + frame % 9), 0.03);
    this->expectRight();
  }
}

/// What a partial update leaves in vertices that then rest must not move them again.
TEST_F(PartialUpdate, MixesWithUpdatesOfAll) {
  Deformation bend(this->mesh_, Deformation::Kind::Smooth, 4);
  for (int frame = 0; frame < 60; ++frame) {
    if (frame % 3 == 0) {
      this->positions_ = bend.next();
      this->model_.update(this->positions_);
    } else {
      this->moveSome(4, 0.02);
    }
    this->expectRight();
  }
}

TEST_F(PartialUpdate, ReachesOnlyWhatStandsAboveTheMovedVertices) {
  const auto& report = this->model_.update({12}, {this->positions_[12] * 1.01});
  std::set<int> above;
  for (int t = 0; t < this->model_.num_tris; ++t)
    for (int k = 0; k < 3; ++k)
      if (this->model_.tri_indices[t][k] == 12) above.insert(t);
  int expected = 0;
  std::vector<bool> moved(std::size_t(this->model_.getNumBVs()));
  for (int i = this->model_.getNumBVs() - 1; i >= 0; --i) {
    const auto& node = this->model_.getBV(i);
    moved[std::size_t(i)] = node.isLeaf() ? above.count(node.primitiveId()) > 0
                                          : moved[std::size_t(node.leftChild())] ||
                                                moved[std::size_t(node.rightChild())];
    expected += moved[std::size_t(i)];
  }
  EXPECT_GT(expected, 8);
  EXPECT_GE(report.moved, expected);
  EXPECT_LE(report.moved, 2 * expected) << "siblings go along";
  EXPECT_GT(report.inflated, 0);
  EXPECT_LE(report.inflated, expected);
}

TEST_F(PartialUpdate, OfAVertexNamedTwiceTheLastPositionCounts) {
  const fcl::Vector3d first(5, 5, 5), last = this->positions_[7] + fcl::Vector3d(0, 0, 0.2);
  this->model_.update({7, 3, 7}, {first, this->positions_[3], last});
  this->positions_[7] = last;
  this->expectRight();
  EXPECT_NEAR(0.2, double(this->model_.lastUpdate().largest_displacement), 1e-6);
}

/// Positions may lie in the model's own arrays: they count as they were before the call.
TEST_F(PartialUpdate, TakesPositionsFromItsOwnArrays) {
  using Columns = Eigen::Matrix<double, 3, Eigen::Dynamic>;
  for (const bool boxes : {true, false}) {
    this->model_.setRefitPolicy(boxes ? RefitPolicy() : RefitPolicy::thesis(FitnessCriterion::AB));
    // Two vertices change places.
    const unsigned swapped[] = {1, 0};
    this->model_.update(swapped, this->model_.vertices, 2);
    std::swap(this->positions_[0], this->positions_[1]);
    this->expectRight();
    // Each takes the place of the next, whichever way the loop goes.
    std::vector<unsigned> all(this->positions_.size() - 1);
    for (std::size_t v = 0; v < all.size(); ++v) all[v] = unsigned(v);
    this->model_.update(all.data(), this->model_.vertices + 1, all.size());
    std::copy(this->positions_.begin() + 1, this->positions_.end(), this->positions_.begin());
    this->expectRight();
    for (unsigned& v : all) ++v;
    this->model_.update(all.data(), this->model_.vertices, all.size());
    std::copy_backward(this->positions_.begin(), this->positions_.end() - 1,
                       this->positions_.end());
    this->expectRight();

    // Back to the frame before, by either update.
    for (const bool map : {false, true}) {
      const std::vector<fcl::Vector3d> last = this->positions_;
      for (auto& p : this->positions_) p[2] += 0.05;
      this->model_.beginUpdateModel();
      this->model_.updateSubModel(this->positions_);
      ASSERT_EQ(fcl::BVH_OK, this->model_.endUpdateModel());
      const int n = this->model_.num_vertices;
      if (map)
        this->model_.update(Eigen::Map<const Columns>(this->model_.prev_vertices[0].data(), 3, n));
      else
        this->model_.update(this->model_.prev_vertices, std::size_t(n));
      this->positions_ = last;
      this->expectRight();
    }
    // A part of the frame before.
    this->model_.beginUpdateModel();
    this->model_.updateSubModel(this->positions_);
    ASSERT_EQ(fcl::BVH_OK, this->model_.endUpdateModel());
    this->model_.update(swapped, this->model_.prev_vertices, 2);
    std::swap(this->positions_[0], this->positions_[1]);
    this->expectRight();
    // All of `vertices`, as they are, and written in place.
    for (const double height : {0., 0.5}) {
      for (auto& p : this->positions_) p[2] += height;
      std::copy(this->positions_.begin(), this->positions_.end(), this->model_.vertices);
      this->model_.update(this->model_.vertices, this->positions_.size());
      this->expectRight();
    }
  }
}

TEST_F(PartialUpdate, TakesIndicesOfAnyInteger) {
  this->positions_[4][2] = 0.2;
  this->model_.update(std::vector<int>{4}, {this->positions_[4]});
  this->expectRight();
  this->positions_[5][2] = 0.1;
  this->model_.update(std::vector<std::size_t>{5}, {this->positions_[5]});
  this->expectRight();
  for (const long wrong : {-1l, 4294967296l, 1000l})
    EXPECT_THROW(this->model_.update(std::vector<long>{wrong}, {this->positions_[4]}),
                 std::invalid_argument)
        << wrong;
  this->expectRight();
}

/// An update clears the statistics of the queries before it, also of nodes that it did not visit.
TEST_F(PartialUpdate, ForgetsAllVisits) {
  fcl::DistanceResultd result;
  adaptive_bvh::distance(&this->model_, this->origin_, &this->tool_, this->above_,
                         fcl::DistanceRequestd(), result);
  int visited = 0;
  for (int i = 0; i < this->model_.getNumBVs(); ++i) visited += this->model_.traversed(i);
  EXPECT_GT(visited, 5);
  EXPECT_TRUE(this->model_.traversed(0));
  this->model_.update({0}, {this->positions_[0] * 1.001});
  for (int i = 0; i < this->model_.getNumBVs(); ++i) EXPECT_FALSE(this->model_.traversed(i)) << i;
}

TEST_F(PartialUpdate, RefusesWhatIsWrongAndStays) {
  const fcl::Vector3d p(0, 0, 1), nan(0, 0, std::numeric_limits<double>::quiet_NaN());
  const auto count = unsigned(this->positions_.size());
  EXPECT_THROW(this->model_.update({count}, {p}), std::invalid_argument);
  EXPECT_THROW(this->model_.update({1, 2}, {p}), std::invalid_argument);
  EXPECT_THROW(this->model_.update({1, 2}, {p, nan}), std::invalid_argument);
  this->expectRight();
  Model empty;
  EXPECT_THROW(empty.update({0}, {p}), std::logic_error);
}

/// Also a position that a later one of the same vertex replaces must be a number.
TEST_F(PartialUpdate, RefusesAPositionThatIsNotANumberAndNotUsed) {
  const fcl::Vector3d there = this->positions_[3] + fcl::Vector3d(0, 0, 0.1);
  const fcl::Vector3d nowhere(0, std::numeric_limits<double>::quiet_NaN(), 0);
  for (const auto& policy : {RefitPolicy(), RefitPolicy::thesis(FitnessCriterion::ABOrBC)}) {
    this->model_.setRefitPolicy(policy);
    EXPECT_THROW(this->model_.update(std::vector<unsigned>{3, 3}, {nowhere, there}),
                 std::invalid_argument);
    this->expectRight();
  }
}

/// A step of no vertices, from vectors that hold nothing and may have no memory, moves nothing.
TEST_F(PartialUpdate, OfNoVerticesMovesNothing) {
  for (const auto& policy : {RefitPolicy(), RefitPolicy::thesis(FitnessCriterion::ABOrBC)}) {
    this->model_.setRefitPolicy(policy);
    const auto& report = this->model_.update(std::vector<unsigned>(), std::vector<fcl::Vector3d>());
    EXPECT_EQ(0, report.largest_displacement);
    EXPECT_EQ(0, report.moved);
    this->expectRight();
  }
}

TEST_F(PartialUpdate, WorksInEveryState) {
  this->model_.setRefitPolicy(RefitPolicy::thesis(FitnessCriterion::ABOrBC));
  this->moveSome(3, 0.05);
  this->expectRight();
  this->model_.setRefitPolicy(RefitPolicy());
  this->moveSome(3, 0.05);
  this->expectRight();
  this->positions_[5][2] += 0.1;  // two-frame update: the positions before are kept
  this->model_.beginUpdateModel();
  this->model_.updateSubModel(this->positions_);
  this->model_.endUpdateModel();
  this->moveSome(3, 0.05);
  EXPECT_EQ(nullptr, this->model_.prev_vertices);
  this->expectRight();
  this->moveSome(3, 0.05);
  this->expectRight();
  this->model_.beginReplaceModel();  // abandoned
  this->moveSome(3, 0.05);
  this->expectRight();
  Model copy(this->model_);  // with the tables of partial updates
  copy.update({4}, {this->positions_[4] + fcl::Vector3d(0, 0, 0.1)});
  EXPECT_TRUE(copy.validate());
  this->moveSome(3, 0.05);
  this->expectRight();
}

/// A dent, now here and now there on a large sheet, that sinks in and comes back: what box and
/// radius rest on moves out, and in again, and is found among thousands of vertices.
TEST_F(PartialUpdate, FindsWhatTheLocalBoundsRestOn) {
  const fcl::Transform3d turned(
      Eigen::AngleAxis<double>(0.7, fcl::Vector3d(1, 2, -0.5).normalized()));
  for (const auto& placed : {this->origin_, turned})
    for (const bool with_loose_vertex : {false, true}) {
      TriangleMesh sheet = plate(60, 50);
      for (auto& p : sheet.vertices) p = placed * (p + fcl::Vector3d(0.1, 3, 0.01 * p[0]));
      if (with_loose_vertex) sheet.vertices.push_back(placed * fcl::Vector3d(-2, -2, 5));
      Model model;
      fillModel(sheet, model);
      std::uniform_int_distribution<std::size_t> any(0, sheet.vertices.size() - 1);
      std::size_t middle = 0;
      for (int frame = 0; frame < 80; ++frame) {
        if (frame % 20 == 0) middle = any(this->random_);
        const double depth =
            0.3 * std::sin(double(frame % 20) * double(M_PI / 10));  // to both sides
        std::vector<unsigned> indices;
        std::vector<fcl::Vector3d> to;
        for (unsigned v = 0; v < sheet.vertices.size(); ++v) {
          const double r = (sheet.vertices[v] - sheet.vertices[middle]).norm() / 0.1;
          if (r >= 1) continue;
          indices.push_back(v);
          to.push_back(sheet.vertices[v] +
                       placed.linear() * fcl::Vector3d(depth / 2, 0, depth) * (1 - r * r));
        }
        model.update(indices, to);
        ASSERT_NO_FATAL_FAILURE(this->expectLocalBounds(model)) << frame;
      }
    }
}

/// A change through the base class, which leaves FCL's local box as it was, then updates that
/// change nothing.
TEST_F(PartialUpdate, BringsTheLocalBoundsUpToDateAfterAChangeThroughTheBase) {
  for (const RefitPolicy& policy : {RefitPolicy(), RefitPolicy::thesis(FitnessCriterion::A)}) {
    this->model_.setRefitPolicy(policy);
    for (auto& p : this->positions_) p *= 1.5;
    Plain& base = this->model_;
    base.beginReplaceModel();
    base.replaceSubModel(this->positions_);
    base.endReplaceModel();
    this->model_.update({3}, {this->positions_[3]});
    this->expectRight();
  }
}

TEST(PartialUpdatePoints, ACloudAndASingleTriangle) {
  using Point = fcl::Vector3d;
  AdaptiveModel cloud;
  cloud.beginModel();
  cloud.addSubModel(std::vector<Point>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}});
  ASSERT_EQ(fcl::BVH_OK, cloud.endModel());
  cloud.update({3, 0}, {Point(0, 0, 2), Point(-1, 0, 0)});
  EXPECT_TRUE(cloud.validate());
  EXPECT_EQ(Point(0, 0, 2), cloud.vertices[3]);

  AdaptiveModel triangle;
  triangle.beginModel();
  triangle.addTriangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  ASSERT_EQ(fcl::BVH_OK, triangle.endModel());
  triangle.update({2}, {Point(0, 3, 0)});
  EXPECT_TRUE(triangle.validate());
}

}  // namespace partial_update_test
}  // namespace adaptive_bvh_test
