// Distances of meshes that nearly touch, by the four-wide trees, against brute force: whatever the
// query before said, the search begins there.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "model_state.h"
#include "query/pair_cache.h"
#include "support/brute_force.h"
#include "support/fcl_float.h"
#include "support/random_geometry.h"
#include "support/test_volume.h"

namespace adaptive_bvh_test {
namespace near_distance_test {

using adaptive_bvh::AdaptiveBVHModel;
using adaptive_bvh::PairCache;
using adaptive_bvh::PlacedMesh;

template <typename S>
class NearDistance : public testing::Test {
 protected:
  using BV = TestVolume<S>;
  using Model = AdaptiveBVHModel<BV>;
  using Transform = fcl::Transform3<S>;

  static S tolerance() { return std::is_same<S, float>::value ? S(1e-5) : S(1e-12); }

  NearDistance() {
    sheet_ = plate<S>(9, 9);  // a trough, in which the hose lies: no plane separates them
    for (auto& p : sheet_.vertices) p[2] = 2 * (p[1] - S(0.5)) * (p[1] - S(0.5));
    hose_ = tube<S>(8, 10);
  }
  static PlacedMesh<BV> placed(const Model& model, const Transform& tf) {
    return {&model, &adaptive_bvh::detail::ModelAccess<BV>::tree(model), tf};
  }
  static bool hasWideTree(const Model& model) {
    const auto& tree = adaptive_bvh::detail::ModelAccess<BV>::tree(model);
    return tree.wide.isCurrent(tree);
  }
  /// A query that takes the bodies to be near; brute force judges.
  void ask(PairCache<BV>& cache, const Transform& tf1, const Transform& tf2, S abs_err = 0) {
    cache.are_near = true;
    fcl::DistanceRequest<S> request(true);
    request.abs_err = abs_err;
    fcl::DistanceResult<S> result;
    ASSERT_TRUE(adaptive_bvh::distanceByBoxes<BV>(placed(first_, tf1), placed(second_, tf2),
                                                  {request, result}, cache));
    const BruteForce<S> brute(first_, tf1, second_, tf2);
    const S expected = brute.distance();
    ASSERT_NEAR(expected, result.min_distance, tolerance() + abs_err);
    ASSERT_EQ("", brute.findError(result, tf1, tolerance()));
    ++queries_;
    touching_ += result.min_distance <= 0;
    on_wide_trees_ += hasWideTree(first_) && hasWideTree(second_);
    with_front_ += cache.front && cache.front->size() > 0;
  }
  /// In single precision placements are too coarse for common coordinates.
  void expectWideTrees() const {
    if (std::is_same<S, double>::value) {
      EXPECT_GT(on_wide_trees_, queries_ * 3 / 4);
    }
  }

  TriangleMesh<S> sheet_, hose_;
  Model first_, second_;
  RandomGeometry<S> random_{83};
  int queries_ = 0, touching_ = 0, on_wide_trees_ = 0, with_front_ = 0;
};

TYPED_TEST_SUITE(NearDistance, TestScalars);

/// General poses, all volumes kept or left out, with a front and without.
TYPED_TEST(NearDistance, IsThatOfEveryPairOfTriangles) {
  using S = TypeParam;
  using Kind = typename Deformation<S>::Kind;
  for (bool on_demand : {false, true})
    for (Kind kind : {Kind::Smooth, Kind::Jerky})
      for (bool front : {false, true}) {
        adaptive_bvh::RefitPolicy policy;
        policy.volumes_on_demand = on_demand;
        for (auto* model : {&this->first_, &this->second_}) model->setRefitPolicy(policy);
        fillModel(this->sheet_, this->first_);
        fillModel(this->hose_, this->second_);
        for (auto* model : {&this->first_, &this->second_}) model->computeLocalAABB();
        Deformation<S> bend1(this->sheet_, kind, 1), bend2(this->hose_, kind, 2);
        PairCache<typename TestFixture::BV> cache;
        if (front) cache.front.emplace();
        auto tf1 = randomPose<S>(this->random_.engine(), S(3));
        auto beside = TestFixture::Transform::Identity();
        beside.linear() = Eigen::AngleAxis<S>(S(0.2), this->random_.direction()).matrix();
        for (int frame = 0; frame < 40; ++frame) {
          if (frame % 2) this->first_.update(bend1.next());
          if (frame % 3) this->second_.update(bend2.next());
          if (frame % 4 == 0)
            beside.translation() =
                Vector3<S>(S(-0.5), S(0.4), S(1.9)) + this->random_.point() * S(0.4);
          if (frame == 20) tf1 = randomPose<S>(this->random_.engine(), S(3));
          ASSERT_NO_FATAL_FAILURE(this->ask(cache, tf1, tf1 * beside, frame % 7 ? S(0) : S(0.01)));
        }
      }
  this->expectWideTrees();
  EXPECT_GT(this->with_front_, 0);
  EXPECT_LT(this->touching_, this->queries_ / 2);
}

/// Soups, whose tree is of no use, and bodies that pass through each other.
TYPED_TEST(NearDistance, OfLooseTrianglesAndOfBodiesThatIntersect) {
  using S = TypeParam;
  for (int round = 0; round < 60; ++round) {
    const int count = 3 + this->random_.below(60);
    fillModel(soup<S>(count, this->random_.engine()), this->first_);
    fillModel(round % 2 ? soup<S>(count, this->random_.engine()) : this->hose_, this->second_);
    for (auto* model : {&this->first_, &this->second_}) model->computeLocalAABB();
    PairCache<typename TestFixture::BV> cache;
    if (round % 3 == 0) cache.front.emplace();
    for (int i = 0; i < 3; ++i) {
      const auto tf1 = randomPose<S>(this->random_.engine(), S(1));
      auto tf2 = randomPose<S>(this->random_.engine(), S(1));
      tf2.translation() = tf1.translation() + this->random_.direction() * S(0.8 * i);
      ASSERT_NO_FATAL_FAILURE(this->ask(cache, tf1, tf2));
    }
  }
  this->expectWideTrees();
  EXPECT_GT(this->touching_, 20);
}

/// A bent sheet moves by up to a fiftieth of an edge a step, some tenths to two below another:
/// where the last search stopped, nearly all bounds still hold.
TYPED_TEST(NearDistance, SmallStepsTestFewBoxes) {
  using S = TypeParam;
  constexpr int kSide = 40;
  const S edge = S(1) / kSide;
  const auto sheet = [&](S height, S bend, S wave) {
    return bent<S>(kSide, kSide, [=](S x, S y) -> Vector3<S> {
      return {x + wave * std::sin(9 * x + 4 * y), y,
              height + bend * std::sin(7 * x) * std::cos(5 * y)};
    });
  };
  fillModel(sheet(0, S(0.03), 0), this->first_);
  fillModel(sheet(S(1.2) * edge, S(0.055), 0), this->second_);
  for (auto* model : {&this->first_, &this->second_}) model->computeLocalAABB();
  PairCache<typename TestFixture::BV> from_roots, from_front;
  from_front.front.emplace();
  const auto tf = randomPose<S>(this->random_.engine(), S(1));
  const auto boxTests = [&](PairCache<typename TestFixture::BV>& cache, S& distance) {
    const long before = this->first_.recordedWork().box_tests;
    const fcl::DistanceRequest<S> request;
    fcl::DistanceResult<S> result;
    adaptive_bvh::distanceByBoxes<typename TestFixture::BV>(
        this->placed(this->first_, tf), this->placed(this->second_, tf), {request, result}, cache);
    distance = result.min_distance;
    return double(this->first_.recordedWork().box_tests - before);
  };
  std::vector<double> shares;
  for (int step = 0; step < 60; ++step) {
    const int away = std::min(step % 10, 10 - step % 10);
    this->first_.update(sheet(0, S(0.03), S(0.02) * edge * S(away)).vertices);
    const bool is_coherent = from_front.front->size() > 0;
    S expected, found;
    const double all = boxTests(from_roots, expected), some = boxTests(from_front, found);
    ASSERT_NEAR(expected, found, this->tolerance());
    ASSERT_GT(found, 0);
    if (is_coherent) shares.push_back(some / all);
  }
  ASSERT_GT(shares.size(), 40u);
  std::sort(shares.begin(), shares.end());
  EXPECT_LT(shares[shares.size() / 2], 0.2);
}

/// A model much larger than the other has coordinates of its own: the boxes of FCL's nodes serve.
TYPED_TEST(NearDistance, OfBodiesWithoutCommonCoordinates) {
  using S = TypeParam;
  TriangleMesh<S> large = this->sheet_;
  for (auto& p : large.vertices) p = 100 * (p - Vector3<S>(S(0.5), S(0.5), 0));
  fillModel(this->hose_, this->first_);
  fillModel(large, this->second_);
  for (auto* model : {&this->first_, &this->second_}) model->computeLocalAABB();
  PairCache<typename TestFixture::BV> cache;
  cache.are_near = true;
  fcl::DistanceRequest<S> request;
  fcl::DistanceResult<S> result;
  const auto tf1 = TestFixture::Transform::Identity();
  ASSERT_TRUE(adaptive_bvh::distanceByBoxes<typename TestFixture::BV>(
      this->placed(this->first_, tf1), this->placed(this->second_, tf1), {request, result}, cache));
  EXPECT_FALSE(cache.are_near);
  EXPECT_FALSE(this->hasWideTree(this->first_)) << "a tree for nothing";
  const S expected = BruteForce<S>(this->first_, tf1, this->second_, tf1).distance();
  EXPECT_NEAR(expected, result.min_distance, 100 * this->tolerance());
}

}  // namespace near_distance_test
}  // namespace adaptive_bvh_test
