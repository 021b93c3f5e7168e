// CoherentDistance against brute force: smooth and jerky deformation, objects at rest and moving,
// everything that could make what it remembers wrong.
#include "adaptive_bvh/coherent_distance.h"

#include <gtest/gtest.h>

#include "adaptive_bvh/query.h"
#include "support/brute_force.h"
#include "support/fcl_float.h"
#include "support/long_mode.h"
#include "support/test_volume.h"

namespace adaptive_bvh_test {
namespace coherent_test {

using adaptive_bvh::AdaptiveBVHModel;
using adaptive_bvh::CoherentDistance;
using adaptive_bvh::FitnessCriterion;
using adaptive_bvh::RefitPolicy;

template <typename S>
class Coherent : public testing::Test {
 protected:
  using Model = AdaptiveBVHModel<TestVolume<S>>;
  using Kind = typename Deformation<S>::Kind;

  static S tolerance() { return std::is_same<S, float>::value ? S(1e-5) : S(1e-12); }

  Coherent() {
    sheet_ = plate<S>(7, 7);
    hose_ = tube<S>(6, 8);
    fillModel(sheet_, first_);
    fillModel(hose_, second_);
    above_.translation() = Vector3<S>(S(0.2), S(0.3), S(0.8));
  }

  /// Asks, and lets brute force judge.
  fcl::DistanceResult<S> ask(const fcl::Transform3<S>& tf1, const fcl::Transform3<S>& tf2) {
    const BruteForce<S> brute(first_, tf1, second_, tf2);
    fcl::DistanceResult<S> result;
    const S returned = pair_.distance(tf1, tf2, fcl::DistanceRequest<S>(true), result);
    EXPECT_EQ(returned, result.min_distance);
    EXPECT_NEAR(brute.distance(), result.min_distance, tolerance());
    EXPECT_EQ("", brute.findError(result, tf1, tolerance()));
    touching_ += result.min_distance <= 0;
    return result;
  }

  TriangleMesh<S> sheet_, hose_;
  Model first_, second_;
  CoherentDistance<TestVolume<S>> pair_{first_, second_};
  const fcl::Transform3<S> origin_ = fcl::Transform3<S>::Identity();
  fcl::Transform3<S> above_ = origin_;
  std::mt19937 random_{testSeed(17)};
  int touching_ = 0;
};

using Scalars = TestScalars;
TYPED_TEST_SUITE(Coherent, Scalars);

TYPED_TEST(Coherent, IsExactWhileBothDeform) {
  using S = TypeParam;
  for (const auto kind : {TestFixture::Kind::Smooth, TestFixture::Kind::Jerky}) {
    Deformation<S> bend_first(this->sheet_, kind, 1), bend_second(this->hose_, kind, 2);
    for (int frame = 0; frame < 120; ++frame) {
      this->first_.update(bend_first.next());
      if (frame % 3 != 0) this->second_.update(bend_second.next());
      this->ask(this->origin_, this->above_);
    }
  }
}

/// Slow turns and shifts of either object, then a leap, over and over.
TYPED_TEST(Coherent, IsExactWhileObjectsMove) {
  using S = TypeParam;
  Deformation<S> bend(this->sheet_, TestFixture::Kind::Smooth, 3);
  fcl::Transform3<S> tf1 = this->origin_, tf2 = this->above_;
  for (int frame = 0; frame < 200; ++frame) {
    if (frame % 4 == 0) this->first_.update(bend.next());
    if (frame % 50 == 49) {
      tf1 = randomPose<S>(this->random_, S(0.4));
      tf2 = randomPose<S>(this->random_, S(0.4));
    } else {
      const auto turn = Eigen::AngleAxis<S>(S(0.02), Vector3<S>(1, 2, -1).normalized());
      (frame % 2 == 0 ? tf1 : tf2).linear() *= turn.toRotationMatrix();
      tf2.translation() += Vector3<S>(S(0.004), S(-0.003), S(-0.008));
    }
    this->ask(tf1, tf2);
  }
  EXPECT_GT(this->touching_, 5) << "some poses must touch, or that end is not tried";
  EXPECT_LT(this->touching_, 150);
}

TYPED_TEST(Coherent, RemembersAFrontAndSkipsWhatItSettles) {
  this->ask(this->origin_, this->above_);
  EXPECT_EQ(0u, this->pair_.frontSize()) << "nothing says yet that one would pay";
  const auto fresh = this->first_.recordedWork();
  EXPECT_EQ(1, fresh.queries);
  this->ask(this->origin_, this->above_);  // now with a good bound from the start
  EXPECT_EQ(0u, this->pair_.frontSize()) << "one step says little";
  this->ask(this->origin_, this->above_);
  EXPECT_GT(this->pair_.frontSize(), 0u);
  const auto second = this->first_.recordedWork();
  this->ask(this->origin_, this->above_);  // and nothing moved
  const auto third = this->first_.recordedWork();
  EXPECT_EQ(4, third.queries);
  EXPECT_LT(third.box_tests - second.box_tests, fresh.box_tests / 8);
  EXPECT_GE(this->pair_.bytes(), this->pair_.frontSize() * 32);
}

/// Everything after which old bounds mean nothing.
TYPED_TEST(Coherent, ForgetsWhatNoLongerHolds) {
  using S = TypeParam;
  using Kind = typename TestFixture::Kind;
  Deformation<S> bend(this->sheet_, Kind::Smooth, 5);
  this->ask(this->origin_, this->above_);

  // A new tree, by a rebuild.
  this->first_.beginReplaceModel();
  this->first_.replaceSubModel(bend.next());
  this->first_.endReplaceModel(false);
  this->ask(this->origin_, this->above_);

  // FCL's own refit through the base class moves the vertices without accumulated motion.
  fcl::BVHModel<TestVolume<S>>& base = this->second_;
  std::vector<Vector3<S>> moved = this->hose_.vertices;
  for (auto& p : moved) p[2] -= S(0.4);
  base.beginReplaceModel();
  base.replaceSubModel(moved);
  base.endReplaceModel(true, true);
  this->ask(this->origin_, this->above_);

  // Another propagation, and back.
  this->first_.setRefitPolicy(RefitPolicy::thesis(FitnessCriterion::ABOrBC));
  this->first_.update(bend.next());
  this->ask(this->origin_, this->above_);
  EXPECT_EQ(0u, this->pair_.frontSize());
  this->first_.setRefitPolicy(RefitPolicy());
  this->first_.update(bend.next());
  this->ask(this->origin_, this->above_);
  for (int i = 0; i < 9; ++i) this->ask(this->origin_, this->above_);
  EXPECT_GT(this->pair_.frontSize(), 0u);

  // Many updates without a question.
  for (int frame = 0; frame < 30; ++frame) this->first_.update(bend.next());
  this->ask(this->origin_, this->above_);

  // Both frames of a two-frame update count in the volumes; distances are of the last.
  this->first_.beginUpdateModel();
  this->first_.updateSubModel(bend.next());
  this->first_.endUpdateModel();
  this->ask(this->origin_, this->above_);
}

/// Long ways: accumulated motions begin anew, and the front with them.
TYPED_TEST(Coherent, SurvivesLongWays) {
  using S = TypeParam;
  std::vector<Vector3<S>> positions = this->sheet_.vertices;
  for (int frame = 0; frame < 400; ++frame) {
    const Vector3<S> by(S(0.9) * S(frame % 2 == 0 ? 1 : -1), 0, S(0.001));
    for (auto& p : positions) p += by;
    this->first_.update(positions);
    if (frame % 20 == 0) this->ask(this->origin_, this->above_);
  }
  for (int i = 0; i < 9; ++i) this->ask(this->origin_, this->above_);
  EXPECT_GT(this->pair_.frontSize(), 0u);
  std::string reason;
  EXPECT_TRUE(this->first_.validate(&reason)) << reason;
}

/// A ball above a bumpy sheet: asked near it, once far away, and near it again, in small steps.
/// What the far way adds to a sum must not hide the small ones.
TYPED_TEST(Coherent, IsExactAfterAnExcursion) {
  using S = TypeParam;
  const TriangleMesh<S> bumps = bent<S>(10, 10, [](S u, S v) -> Vector3<S> {
    return {10 * u - 5, 10 * v - 5, S(0.3) * std::sin(7 * u) * std::cos(9 * v)};
  });
  const TriangleMesh<S> ball = bent<S>(8, 6, [](S u, S v) -> Vector3<S> {
    const S around = S(2 * M_PI) * u, polar = S(0.1) + S(2.9) * v;
    return S(0.2) * Vector3<S>(std::sin(polar) * std::cos(around),
                               std::sin(polar) * std::sin(around), std::cos(polar));
  });
  typename TestFixture::Model ground, body;
  fillModel(bumps, ground);
  fillModel(ball, body);
  std::vector<double> ways = {1e3, 1e6, 1e12, 1e13, 1e17, 1e20};
  if (std::is_same<S, double>::value) ways.insert(ways.end(), {1e200, 1e300});
  for (const double way : ways)
    for (const double step : {4e-5, 1e-4, 1e-2}) {
      CoherentDistance<TestVolume<S>> pair(body, ground);
      fcl::Transform3<S> pose = this->origin_;
      pose.translation() = Vector3<S>(S(-0.3), S(0.2), S(0.9));
      const auto ask = [&](const fcl::Transform3<S>& tf) {
        fcl::DistanceResult<S> result;
        return pair.distance(tf, this->origin_, fcl::DistanceRequest<S>(), result);
      };
      ask(pose);
      fcl::Transform3<S> far = pose;
      far.translation()[0] = S(way);
      ask(far);
      const int steps = step < 1e-3 ? 6000 : 200;
      for (int i = 0; i < steps; ++i) {
        pose.translation()[0] += S(step);  // along the bumps: other triangles come near
        const S found = ask(pose);
        if (i % (steps / 10) != steps / 10 - 1) continue;
        const S expected = BruteForce<S>(body, pose, ground, this->origin_).distance();
        ASSERT_NEAR(expected, found, this->tolerance()) << way << ' ' << step << ' ' << i;
      }
    }
}

TYPED_TEST(Coherent, KeepsASmallerDistanceAndTakesTolerances) {
  using S = TypeParam;
  fcl::DistanceResult<S> small;
  small.min_distance = S(0.01);
  this->pair_.distance(this->origin_, this->above_, fcl::DistanceRequest<S>(), small);
  EXPECT_EQ(S(0.01), small.min_distance);
  EXPECT_EQ(nullptr, small.o1);
  const S exact = this->ask(this->origin_, this->above_).min_distance;

  fcl::DistanceRequest<S> coarse;
  coarse.rel_err = S(0.2);
  fcl::DistanceResult<S> result;
  CoherentDistance<TestVolume<S>> fresh(this->first_, this->second_);
  fresh.distance(this->origin_, this->above_, coarse, result);
  EXPECT_GE(result.min_distance, exact * (1 - this->tolerance()));
  EXPECT_LE(result.min_distance, exact * S(1.2));
  EXPECT_GT(exact, S(0.01));
}

TYPED_TEST(Coherent, RefusesModelsWithoutTriangles) {
  using S = TypeParam;
  typename TestFixture::Model empty;
  CoherentDistance<TestVolume<S>> pair(empty, this->second_);
  fcl::DistanceResult<S> result;
  EXPECT_THROW(pair.distance(this->origin_, this->origin_, fcl::DistanceRequest<S>(), result),
               std::invalid_argument);
}

/// So far apart, and so unequal in size, that the boxes' single precision would not do.
TYPED_TEST(Coherent, ManagesExtremes) {
  using S = TypeParam;
  for (const S scale : {S(1e-8), S(1e8)}) {
    TriangleMesh<S> mesh = plate<S>(3, 3);
    for (auto& p : mesh.vertices) p *= scale;
    typename TestFixture::Model other;
    fillModel(mesh, other);
    CoherentDistance<TestVolume<S>> pair(this->first_, other);
    for (const S away : {S(0), S(1e3), S(1e9)}) {
      fcl::Transform3<S> tf = this->origin_;
      tf.translation() = Vector3<S>(away, away / 2, S(0.3) * (1 + scale) + away);
      fcl::DistanceResult<S> result;
      pair.distance(this->origin_, tf, fcl::DistanceRequest<S>(), result);
      const S expected = BruteForce<S>(this->first_, this->origin_, other, tf).distance();
      EXPECT_NEAR(expected, result.min_distance, this->tolerance() * (scale + away + 1))
          << scale << ' ' << away;
    }
  }
}

}  // namespace coherent_test
}  // namespace adaptive_bvh_test
