// CoherentDistance against brute force: smooth and jerky deformation, objects at rest and moving,
// everything that could make what it remembers wrong.
#include "adaptive_bvh/coherent_distance.h"

#include <gtest/gtest.h>

#include "adaptive_bvh/query.h"
#include "support/brute_force.h"
#include "support/fcl_float.h"
#include "support/long_mode.h"
#include "support/test_mesh.h"

namespace adaptive_bvh_test {
namespace coherent_distance_test {

using adaptive_bvh::CoherentDistance;
using adaptive_bvh::DeformableMesh;

template <typename S>
class Coherent : public testing::Test {
 protected:
  using Model = DeformableMesh<S>;
  using Kind = typename Deformation<S>::Kind;

  static S tolerance() { return std::is_same<S, float>::value ? S(1e-5) : S(1e-12); }

  Coherent() { above_.translation() = Vector3<S>(S(0.2), S(0.3), S(0.8)); }

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

  const TriangleMesh<S> sheet_ = plate<S>(7, 7), hose_ = tube<S>(6, 8);
  Model first_{sheet_}, second_{hose_};
  CoherentDistance<S> pair_{first_, second_};
  const fcl::Transform3<S> origin_ = fcl::Transform3<S>::Identity();
  fcl::Transform3<S> above_ = origin_;
  std::mt19937 random_{testSeed(17)};
  int touching_ = 0;
};

using Scalars = QueryScalars;
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

/// The kept answer is returned only if nothing has moved, with the requested points.
TYPED_TEST(Coherent, KeepsItsAnswerOnlyWhileNothingMoves) {
  using S = TypeParam;
  const auto same = [](const fcl::DistanceResult<S>& a, const fcl::DistanceResult<S>& b) {
    return a.min_distance == b.min_distance && a.b1 == b.b1 && a.b2 == b.b2 &&
           a.nearest_points[0] == b.nearest_points[0] && a.nearest_points[1] == b.nearest_points[1];
  };
  const auto first = this->ask(this->origin_, this->above_);
  EXPECT_TRUE(same(first, this->ask(this->origin_, this->above_)));
  fcl::DistanceResult<S> without;
  this->pair_.distance(this->origin_, this->above_, fcl::DistanceRequest<S>(), without);
  EXPECT_NEAR(first.min_distance, without.min_distance, this->tolerance());
  EXPECT_TRUE(without.nearest_points[0].array().isNaN().all()) << "not requested";
  EXPECT_TRUE(same(first, this->ask(this->origin_, this->above_)));

  // One vertex, a transform, and back again.
  const std::vector<Vector3<S>> nearer = {this->sheet_.vertices[30] + Vector3<S>(0, 0, S(0.2))};
  this->first_.update(std::vector<int>{30}, nearer);
  EXPECT_FALSE(same(first, this->ask(this->origin_, this->above_)));
  this->first_.update(this->sheet_.vertices);
  EXPECT_NEAR(first.min_distance, this->ask(this->origin_, this->above_).min_distance,
              this->tolerance());
  fcl::Transform3<S> lower = this->above_;
  lower.translation()[2] -= S(0.1);
  EXPECT_FALSE(same(first, this->ask(this->origin_, lower)));
  this->ask(this->origin_, this->above_);
}

/// Everything after which the kept pair of triangles means nothing.
TYPED_TEST(Coherent, ForgetsWhatNoLongerHolds) {
  using S = TypeParam;
  using Kind = typename TestFixture::Kind;
  using Model = typename TestFixture::Model;
  Deformation<S> bend(this->sheet_, Kind::Smooth, 5);
  this->ask(this->origin_, this->above_);

  // Another mesh, with fewer triangles; with more; and the first again.
  this->second_ = Model(plate<S>(1, 1));
  this->ask(this->origin_, this->above_);
  this->second_ = Model(tube<S>(12, 12));
  this->ask(this->origin_, this->above_);
  this->second_ = Model(this->hose_);
  this->ask(this->origin_, this->above_);

  // A copy of a mesh that has gone on.
  const Model before = this->first_;
  this->first_.update(bend.next());
  this->ask(this->origin_, this->above_);
  this->first_ = before;
  this->ask(this->origin_, this->above_);

  // Many updates without a question.
  for (int frame = 0; frame < 30; ++frame) this->first_.update(bend.next());
  this->ask(this->origin_, this->above_);

  // Of a two-frame update the last positions count.
  this->first_.updateTwoFrames(bend.next());
  this->ask(this->origin_, this->above_);
  this->first_.update(bend.next());
  this->ask(this->origin_, this->above_);

  // A refused update changes nothing.
  std::vector<Vector3<S>> broken = bend.positions();
  broken[5][1] = std::numeric_limits<S>::quiet_NaN();
  EXPECT_THROW(this->first_.update(broken), std::invalid_argument);
  this->ask(this->origin_, this->above_);
}

/// Many large steps.
TYPED_TEST(Coherent, SurvivesLongWays) {
  using S = TypeParam;
  std::vector<Vector3<S>> positions = this->sheet_.vertices;
  for (int frame = 0; frame < 400; ++frame) {
    const Vector3<S> by(S(0.9) * S(frame % 2 == 0 ? 1 : -1), 0, S(0.001));
    for (auto& p : positions) p += by;
    this->first_.update(positions);
    if (frame % 20 == 0) this->ask(this->origin_, this->above_);
  }
  std::string reason;
  EXPECT_TRUE(this->first_.validate(&reason)) << reason;
}

/// A ball above a bumpy sheet: queried near it, once far away, and near it again, in small steps.
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
  typename TestFixture::Model ground(bumps);
  typename TestFixture::Model body(ball);
  std::vector<double> ways = {1e3, 1e6, 1e12, 1e13, 1e17, 1e20};
  if (std::is_same<S, double>::value) ways.insert(ways.end(), {1e200, 1e300});
  for (const double way : ways)
    for (const double step : {4e-5, 1e-4, 1e-2}) {
      CoherentDistance<S> pair(body, ground);
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
  CoherentDistance<S> fresh(this->first_, this->second_);
  fresh.distance(this->origin_, this->above_, coarse, result);
  EXPECT_GE(result.min_distance, exact * (1 - this->tolerance()));
  EXPECT_LE(result.min_distance, exact * S(1.2));
  EXPECT_GT(exact, S(0.01));
}

/// So far apart, and so unequal in size, that single precision in common coordinates would not do.
TYPED_TEST(Coherent, ManagesExtremes) {
  using S = TypeParam;
  for (const S scale : {S(1e-8), S(1e8)}) {
    TriangleMesh<S> mesh = plate<S>(3, 3);
    for (auto& p : mesh.vertices) p *= scale;
    typename TestFixture::Model other(mesh);
    CoherentDistance<S> pair(this->first_, other);
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

}  // namespace coherent_distance_test
}  // namespace adaptive_bvh_test
