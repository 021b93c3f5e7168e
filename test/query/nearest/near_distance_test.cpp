// Distances of meshes that nearly touch against brute force, by new queries and step after step:
// whatever the query before said, the search begins there.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "adaptive_bvh/coherent_distance.h"
#include "adaptive_bvh/query.h"
#include "support/brute_force.h"
#include "support/fcl_float.h"
#include "support/random_geometry.h"
#include "support/test_mesh.h"

namespace adaptive_bvh_test {
namespace near_distance_test {

using adaptive_bvh::CoherentDistance;
using adaptive_bvh::DeformableMesh;

class NearDistance : public testing::Test {
 protected:
  using Mesh = DeformableMesh;
  using Transform = fcl::Transform3d;

  static double tolerance() { return 1e-12; }

  NearDistance() {
    sheet_ = plate(9, 9);  // a trough, in which the hose lies: no plane separates them
    for (auto& p : sheet_.vertices) p[2] = 2 * (p[1] - 0.5) * (p[1] - 0.5);
    hose_ = tube(8, 10);
  }
  /// Both queries, judged by brute force.
  void ask(const Mesh& first, const Mesh& second, CoherentDistance& pair, const Transform& tf1,
           const Transform& tf2, double abs_err = 0) {
    fcl::DistanceRequestd request(true);
    request.abs_err = abs_err;
    const BruteForce brute(first, tf1, second, tf2);
    const double expected = brute.distance();
    fcl::DistanceResultd fresh, kept;
    adaptive_bvh::distance(&first, tf1, &second, tf2, request, fresh);
    pair.distance(tf1, tf2, request, kept);
    for (const fcl::DistanceResultd* result : {&fresh, &kept}) {
      ASSERT_NEAR(expected, result->min_distance, tolerance() + abs_err);
      ASSERT_EQ("", brute.findError(*result, tf1, tolerance()));
    }
    ++queries_;
    touching_ += expected <= 0;
  }

  TriangleMesh sheet_, hose_;
  RandomGeometry random_{83};
  int queries_ = 0, touching_ = 0;
};

/// In general poses, while both deform.
TEST_F(NearDistance, IsThatOfEveryPairOfTriangles) {
  using Mesh = Mesh;
  using Kind = typename Deformation::Kind;
  for (Kind kind : {Kind::Smooth, Kind::Jerky})
    for (int round = 0; round < 3; ++round) {
      Mesh first(this->sheet_), second(this->hose_);
      CoherentDistance pair(first, second);
      Deformation bend1(this->sheet_, kind, 1 + 2 * unsigned(round)),
          bend2(this->hose_, kind, 2 + 2 * unsigned(round));
      auto tf1 = randomPose(this->random_.engine(), 3.);
      auto beside = Transform::Identity();
      beside.linear() = Eigen::AngleAxis<double>(0.2, this->random_.direction()).matrix();
      for (int frame = 0; frame < 40; ++frame) {
        if (frame % 2) first.update(bend1.next());
        if (frame % 3) second.update(bend2.next());
        if (frame % 4 == 0)
          beside.translation() = fcl::Vector3d(-0.5, 0.4, 1.9) + this->random_.point() * 0.4;
        if (frame == 20) tf1 = randomPose(this->random_.engine(), 3.);
        ASSERT_NO_FATAL_FAILURE(
            this->ask(first, second, pair, tf1, tf1 * beside, frame % 7 ? 0. : 0.01));
      }
    }
  EXPECT_LT(this->touching_, this->queries_ / 2);
}

/// Soups, whose tree is of no use, and bodies that pass through each other.
TEST_F(NearDistance, OfLooseTrianglesAndOfBodiesThatIntersect) {
  using Mesh = Mesh;
  for (int round = 0; round < 60; ++round) {
    const int count = 3 + this->random_.below(60);
    const Mesh first(soup(count, this->random_.engine()));
    const Mesh second(round % 2 ? soup(count, this->random_.engine()) : this->hose_);
    CoherentDistance pair(first, second);
    for (int i = 0; i < 3; ++i) {
      const auto tf1 = randomPose(this->random_.engine(), 1.);
      auto tf2 = randomPose(this->random_.engine(), 1.);
      tf2.translation() = tf1.translation() + this->random_.direction() * double(0.8 * i);
      ASSERT_NO_FATAL_FAILURE(this->ask(first, second, pair, tf1, tf2));
    }
  }
  EXPECT_GT(this->touching_, 20);
}

/// A bent sheet moves by up to a fiftieth of an edge a step, some tenths to two edges below
/// another.
TEST_F(NearDistance, OfNearlyParallelSheetsInSmallSteps) {
  constexpr int kSide = 14;
  const double edge = 1. / kSide;
  const auto sheet = [&](double height, double bend, double wave) {
    return bent(kSide, kSide, [=](double x, double y) -> fcl::Vector3d {
      return {x + wave * std::sin(9 * x + 4 * y), y,
              height + bend * std::sin(7 * x) * std::cos(5 * y)};
    });
  };
  Mesh first(sheet(0, 0.03, 0));
  const Mesh second(sheet(1.2 * edge, 0.055, 0));
  CoherentDistance pair(first, second);
  const auto tf = randomPose(this->random_.engine(), 1.);
  for (int step = 0; step < 30; ++step) {
    const int away = std::min(step % 10, 10 - step % 10);
    first.update(sheet(0, 0.03, 0.02 * edge * double(away)).vertices);
    ASSERT_NO_FATAL_FAILURE(this->ask(first, second, pair, tf, tf));
  }
  EXPECT_EQ(0, this->touching_);
}

/// One mesh is much larger than the other, or much smaller.
TEST_F(NearDistance, OfBodiesOfUnequalSize) {
  using Mesh = Mesh;
  for (const double scale : {100., 0.01}) {
    TriangleMesh scaled = this->sheet_;
    for (auto& p : scaled.vertices) p = scale * (p - fcl::Vector3d(0.5, 0.5, 0));
    const Mesh first(this->hose_), second(scaled);
    for (int i = 0; i < 8; ++i) {
      const auto tf1 = randomPose(this->random_.engine(), 0.5),
                 tf2 = randomPose(this->random_.engine(), 0.5);
      fcl::DistanceResultd result;
      adaptive_bvh::distance(&first, tf1, &second, tf2, fcl::DistanceRequestd(), result);
      const double expected = BruteForce(first, tf1, second, tf2).distance();
      EXPECT_NEAR(expected, result.min_distance, std::max(1., scale) * this->tolerance());
    }
  }
}

}  // namespace near_distance_test
}  // namespace adaptive_bvh_test
