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

class Coherent : public testing::Test {
 protected:
  using Model = DeformableMesh;
  using Kind = typename Deformation::Kind;

  static double tolerance() { return 1e-12; }

  Coherent() { above_.translation() = fcl::Vector3d(0.2, 0.3, 0.8); }

  /// Asks, and lets brute force judge.
  fcl::DistanceResultd ask(const fcl::Transform3d& tf1, const fcl::Transform3d& tf2) {
    const BruteForce brute(first_, tf1, second_, tf2);
    fcl::DistanceResultd result;
    const double returned = pair_.distance(tf1, tf2, fcl::DistanceRequestd(true), result);
    EXPECT_EQ(returned, result.min_distance);
    EXPECT_NEAR(brute.distance(), result.min_distance, tolerance());
    EXPECT_EQ("", brute.findError(result, tf1, tolerance()));
    touching_ += result.min_distance <= 0;
    return result;
  }

  const TriangleMesh sheet_ = plate(7, 7), hose_ = tube(6, 8);
  Model first_{sheet_}, second_{hose_};
  CoherentDistance pair_{first_, second_};
  const fcl::Transform3d origin_ = fcl::Transform3d::Identity();
  fcl::Transform3d above_ = origin_;
  std::mt19937 random_{testSeed(17)};
  int touching_ = 0;
};

TEST_F(Coherent, IsExactWhileBothDeform) {
  for (const auto kind : {Kind::Smooth, Kind::Jerky}) {
    Deformation bend_first(this->sheet_, kind, 1), bend_second(this->hose_, kind, 2);
    for (int frame = 0; frame < 120; ++frame) {
      this->first_.update(bend_first.next());
      if (frame % 3 != 0) this->second_.update(bend_second.next());
      this->ask(this->origin_, this->above_);
    }
  }
}

/// Slow turns and shifts of either object, then a leap, over and over.
TEST_F(Coherent, IsExactWhileObjectsMove) {
  Deformation bend(this->sheet_, Kind::Smooth, 3);
  fcl::Transform3d tf1 = this->origin_, tf2 = this->above_;
  for (int frame = 0; frame < 200; ++frame) {
    if (frame % 4 == 0) this->first_.update(bend.next());
    if (frame % 50 == 49) {
      tf1 = randomPose(this->random_, 0.4);
      tf2 = randomPose(this->random_, 0.4);
    } else {
      const auto turn = Eigen::AngleAxis<double>(0.02, fcl::Vector3d(1, 2, -1).normalized());
      (frame % 2 == 0 ? tf1 : tf2).linear() *= turn.toRotationMatrix();
      tf2.translation() += fcl::Vector3d(0.004, -0.003, -0.008);
    }
    this->ask(tf1, tf2);
  }
  EXPECT_GT(this->touching_, 5) << "some poses must touch, or that end is not tried";
  EXPECT_LT(this->touching_, 150);
}

/// The kept answer is returned only if nothing has moved, with the requested points.
TEST_F(Coherent, KeepsItsAnswerOnlyWhileNothingMoves) {
  const auto same = [](const fcl::DistanceResultd& a, const fcl::DistanceResultd& b) {
    return a.min_distance == b.min_distance && a.b1 == b.b1 && a.b2 == b.b2 &&
           a.nearest_points[0] == b.nearest_points[0] && a.nearest_points[1] == b.nearest_points[1];
  };
  const auto first = this->ask(this->origin_, this->above_);
  EXPECT_TRUE(same(first, this->ask(this->origin_, this->above_)));
  fcl::DistanceResultd without;
  this->pair_.distance(this->origin_, this->above_, fcl::DistanceRequestd(), without);
  EXPECT_NEAR(first.min_distance, without.min_distance, this->tolerance());
  EXPECT_TRUE(without.nearest_points[0].array().isNaN().all()) << "not requested";
  EXPECT_TRUE(same(first, this->ask(this->origin_, this->above_)));

  // One vertex, a transform, and back again.
  const std::vector<fcl::Vector3d> nearer = {this->sheet_.vertices[30] + fcl::Vector3d(0, 0, 0.2)};
  this->first_.update(std::vector<int>{30}, nearer);
  EXPECT_FALSE(same(first, this->ask(this->origin_, this->above_)));
  this->first_.update(this->sheet_.vertices);
  EXPECT_NEAR(first.min_distance, this->ask(this->origin_, this->above_).min_distance,
              this->tolerance());
  fcl::Transform3d lower = this->above_;
  lower.translation()[2] -= 0.1;
  EXPECT_FALSE(same(first, this->ask(this->origin_, lower)));
  this->ask(this->origin_, this->above_);
}

/// Everything after which the kept pair of triangles means nothing.
TEST_F(Coherent, ForgetsWhatNoLongerHolds) {
  using Kind = Kind;
  using Model = Model;
  Deformation bend(this->sheet_, Kind::Smooth, 5);
  this->ask(this->origin_, this->above_);

  // Another mesh, with fewer triangles; with more; and the first again.
  this->second_ = Model(plate(1, 1));
  this->ask(this->origin_, this->above_);
  this->second_ = Model(tube(12, 12));
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
  std::vector<fcl::Vector3d> broken = bend.positions();
  broken[5][1] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(this->first_.update(broken), std::invalid_argument);
  this->ask(this->origin_, this->above_);
}

/// Many large steps.
TEST_F(Coherent, SurvivesLongWays) {
  std::vector<fcl::Vector3d> positions = this->sheet_.vertices;
  for (int frame = 0; frame < 400; ++frame) {
    const fcl::Vector3d by(0.9 * double(frame % 2 == 0 ? 1 : -1), 0, 0.001);
    for (auto& p : positions) p += by;
    this->first_.update(positions);
    if (frame % 20 == 0) this->ask(this->origin_, this->above_);
  }
  std::string reason;
  EXPECT_TRUE(this->first_.validate(&reason)) << reason;
}

/// A ball above a bumpy sheet: queried near it, once far away, and near it again, in small steps.
TEST_F(Coherent, IsExactAfterAnExcursion) {
  const TriangleMesh bumps = bent(10, 10, [](double u, double v) -> fcl::Vector3d {
    return {10 * u - 5, 10 * v - 5, 0.3 * std::sin(7 * u) * std::cos(9 * v)};
  });
  const TriangleMesh ball = bent(8, 6, [](double u, double v) -> fcl::Vector3d {
    const double around = double(2 * M_PI) * u, polar = 0.1 + 2.9 * v;
    return 0.2 * fcl::Vector3d(std::sin(polar) * std::cos(around),
                               std::sin(polar) * std::sin(around), std::cos(polar));
  });
  Model ground(bumps);
  Model body(ball);
  std::vector<double> ways = {1e3, 1e6, 1e12, 1e13, 1e17, 1e20};
  if (std::is_same<double, double>::value) ways.insert(ways.end(), {1e200, 1e300});
  for (const double way : ways)
    for (const double step : {4e-5, 1e-4, 1e-2}) {
      CoherentDistance pair(body, ground);
      fcl::Transform3d pose = this->origin_;
      pose.translation() = fcl::Vector3d(-0.3, 0.2, 0.9);
      const auto ask = [&](const fcl::Transform3d& tf) {
        fcl::DistanceResultd result;
        return pair.distance(tf, this->origin_, fcl::DistanceRequestd(), result);
      };
      ask(pose);
      fcl::Transform3d far = pose;
      far.translation()[0] = double(way);
      ask(far);
      const int steps = step < 1e-3 ? 6000 : 200;
      for (int i = 0; i < steps; ++i) {
        pose.translation()[0] += double(step);  // along the bumps: other triangles come near
        const double found = ask(pose);
        if (i % (steps / 10) != steps / 10 - 1) continue;
        const double expected = BruteForce(body, pose, ground, this->origin_).distance();
        ASSERT_NEAR(expected, found, this->tolerance()) << way << ' ' << step << ' ' << i;
      }
    }
}

TEST_F(Coherent, KeepsASmallerDistanceAndTakesTolerances) {
  fcl::DistanceResultd small;
  small.min_distance = 0.01;
  this->pair_.distance(this->origin_, this->above_, fcl::DistanceRequestd(), small);
  EXPECT_EQ(0.01, small.min_distance);
  EXPECT_EQ(nullptr, small.o1);
  const double exact = this->ask(this->origin_, this->above_).min_distance;

  fcl::DistanceRequestd coarse;
  coarse.rel_err = 0.2;
  fcl::DistanceResultd result;
  CoherentDistance fresh(this->first_, this->second_);
  fresh.distance(this->origin_, this->above_, coarse, result);
  EXPECT_GE(result.min_distance, exact * (1 - this->tolerance()));
  EXPECT_LE(result.min_distance, exact * 1.2);
  EXPECT_GT(exact, 0.01);
}

/// So far apart, and so unequal in size, that single precision in common coordinates would not do.
TEST_F(Coherent, ManagesExtremes) {
  for (const double scale : {1e-8, 1e8}) {
    TriangleMesh mesh = plate(3, 3);
    for (auto& p : mesh.vertices) p *= scale;
    Model other(mesh);
    CoherentDistance pair(this->first_, other);
    for (const double away : {0., 1e3, 1e9}) {
      fcl::Transform3d tf = this->origin_;
      tf.translation() = fcl::Vector3d(away, away / 2, 0.3 * (1 + scale) + away);
      fcl::DistanceResultd result;
      pair.distance(this->origin_, tf, fcl::DistanceRequestd(), result);
      const double expected = BruteForce(this->first_, this->origin_, other, tf).distance();
      EXPECT_NEAR(expected, result.min_distance, this->tolerance() * (scale + away + 1))
          << scale << ' ' << away;
    }
  }
}

}  // namespace coherent_distance_test
}  // namespace adaptive_bvh_test
