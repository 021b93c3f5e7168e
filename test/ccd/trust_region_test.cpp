// TrustRegion against all pairs of features: what they sweep from iterate to iterate stays apart.
#include "adaptive_bvh/trust_region.h"

#include <gtest/gtest.h>

#include <map>

#include "support/falling_cloth.h"
#include "support/long_mode.h"
#include "support/step_data.h"
#include "support/swept_surface_test.h"

namespace adaptive_bvh_test {
namespace trust_region_test {

using adaptive_bvh::DeformableMesh;
using adaptive_bvh::TrustRegion;
using adaptive_bvh::TrustRegionReport;
using adaptive_bvh::TrustRegionRequest;
using P = Eigen::Vector3d;

class TrustRegionTest : public SweptSurfaceTest {
 protected:
  using SweptSurfaceTest::random_;
  using typename SweptSurfaceTest::World;

  TrustRegionTest() : SweptSurfaceTest(71) {}

  TriangleMesh crumpled(int kind) {
    TriangleMesh mesh = kind == 0   ? plate(7, 6)
                        : kind == 1 ? tube(6, 6)
                                    : soup(40, random_.engine());
    if (kind < 2)
      for (auto& x : mesh.vertices) x += random_.point() * 0.08;
    return mesh;
  }
  /// All pairs but those within the obstacle, whose vertices begin at `obstacle`.
  void expectApart(const World& world, std::size_t obstacle) {
    SweptSurfaceTest::expectApart(world, [&](const SweptFeatures::Pair& pair) {
      return pair.corners[0] >= obstacle && pair.corners[3] >= obstacle;
    });
  }
};

TEST_F(TrustRegionTest, IteratesStayApart) {
  std::size_t held = 0, held_by_radius = 0, searches = 0;
  for (int round = 0; round < manySteps(30); ++round) {
    const TriangleMesh mesh = this->crumpled(round % 3), fixed = this->crumpled(round / 3 % 3);
    const DeformableMesh model(mesh), obstacle(fixed);
    const auto tf =
        round % 2 ? this->random_.pose(0.5) : fcl::Transform3d(fcl::Transform3d::Identity());
    TrustRegionRequest request;
    request.radius = double(this->random_.size(-2, -0.5));
    request.most_held = this->random_.oneIn(2) ? 1 : 0.05;
    TrustRegion region(model, request);
    const bool has_obstacle = this->random_.oneIn(2);
    if (has_obstacle) region.addObstacle(obstacle, tf);
    auto accepted = mesh.vertices, reference = accepted;
    region.begin(accepted);
    for (int iteration = 0; iteration < 6; ++iteration) {
      const auto before = accepted;
      const auto proposed =
          this->moved(accepted, request.radius * double(this->random_.uniform(0, 3)));
      const TrustRegionReport report = region.truncate(proposed, accepted);
      if (report.has_searched) reference = before;
      std::size_t differ = 0;
      for (std::size_t v = 0; v < accepted.size(); ++v) {
        differ += accepted[v] != proposed[v];
        ASSERT_LE(double((accepted[v] - reference[v]).norm()), double(request.radius) * (1 + 1e-5));
      }
      EXPECT_LE(differ, report.held_back);
      EXPECT_LE(report.held_by_radius, report.held_back);
      held += report.held_back;
      held_by_radius += report.held_by_radius;
      searches += report.has_searched;
      World world;
      world.add(mesh, before, accepted, fcl::Transform3d::Identity());
      if (has_obstacle) world.add(fixed, fixed.vertices, fixed.vertices, tf);
      this->expectApart(world, mesh.vertices.size());
    }
  }
  EXPECT_GT(this->near_, 3000);
  EXPECT_GT(held_by_radius, 200u);
  EXPECT_GT(held - held_by_radius, 200u);
  EXPECT_GT(searches, 10u);
}

/// Proposals beyond all bounds end at the radius, and never drift out of it.
TEST_F(TrustRegionTest, StaysWithinTheRadius) {
  const TriangleMesh mesh = plate(5, 5);
  const DeformableMesh model(mesh);
  TrustRegionRequest request;
  request.radius = 0.05;
  request.most_held = 1;
  TrustRegion region(model, request);
  auto accepted = mesh.vertices;
  region.begin(accepted);
  for (int iteration = 0; iteration < 100; ++iteration) {
    const auto proposed = this->moved(accepted, double(this->random_.size(-3, 7)));
    region.truncate(proposed, accepted);
    for (std::size_t v = 0; v < accepted.size(); ++v)
      ASSERT_LE(double((accepted[v] - mesh.vertices[v]).norm()),
                0.05 + 64 * double(std::numeric_limits<double>::epsilon()));
  }
}

TEST_F(TrustRegionTest, FeaturesKeepTheSeparation) {
  for (int round = 0; round < manySteps(6); ++round) {
    const TriangleMesh mesh = this->crumpled(round % 2);
    const DeformableMesh model(mesh);
    TrustRegionRequest request;
    request.radius = 0.1;
    request.distance = double(this->random_.size(-3, -1.5));
    TrustRegion region(model, request);
    auto accepted = mesh.vertices;
    region.begin(accepted);
    const auto distancesFrom = [&](const auto& pairs_of, const auto& act) {
      std::vector<P> world;
      for (const auto& x : pairs_of) world.push_back(x);
      const SweptFeatures features(world, world, mesh.triangles);
      features.forEachPair(double(request.distance), [&](const SweptFeatures::Pair& pair) {
        act(pair, double(distance(pair.firsts, features.corners(pair, 0))));
      });
    };
    std::map<std::array<std::size_t, 4>, double> before;
    distancesFrom(accepted, [&](const auto& pair, double d) { before[pair.corners] = d; });
    for (int iteration = 0; iteration < 5; ++iteration)
      region.truncate(this->moved(accepted, 0.1), accepted);
    distancesFrom(accepted, [&](const auto& pair, double d) {
      const auto was = before.find(pair.corners);
      const double least = was == before.end() ? double(request.distance)
                                               : std::min(was->second, double(request.distance));
      ASSERT_GT(d, least * (1 - 1e-7) - 2 * double(std::numeric_limits<double>::epsilon()));
    });
  }
}

TEST_F(TrustRegionTest, SearchesAgainWhenTooManyAreHeld) {
  const TriangleMesh mesh = plate(10, 10);
  const DeformableMesh model(mesh);
  for (const double most_held : {0.5, 1.}) {
    TrustRegionRequest request;
    request.radius = 0.02;
    request.most_held = most_held;
    TrustRegion region(model, request);
    auto accepted = mesh.vertices;
    region.begin(accepted);
    const std::size_t pairs = region.numPairs();
    auto proposed = accepted;
    for (auto& x : proposed) x[2] += 0.05;
    const auto first = region.truncate(proposed, accepted);
    EXPECT_EQ(mesh.vertices.size(), first.held_back);
    EXPECT_EQ(mesh.vertices.size(), first.held_by_radius);
    EXPECT_FALSE(first.has_searched);
    const auto second = region.truncate(proposed, accepted);
    EXPECT_EQ(most_held < 1, second.has_searched);
    EXPECT_NEAR(most_held < 1 ? 0.04 : 0.02, double(accepted[0][2]), 1e-6);
    EXPECT_EQ(pairs, region.numPairs());
    region.truncate(proposed, accepted);
    EXPECT_EQ(most_held < 1, accepted == proposed);
  }
}

TEST_F(TrustRegionTest, RefusesAndThenIsUnchanged) {
  const TriangleMesh mesh = plate(4, 4);
  const DeformableMesh model(mesh);
  const double nan = std::numeric_limits<double>::quiet_NaN(),
               infinity = std::numeric_limits<double>::infinity();
  for (const double bad : {0., -1., nan, infinity}) {
    TrustRegionRequest request;
    request.radius = bad;
    EXPECT_THROW(TrustRegion(model, request), std::invalid_argument);
    request.radius = 1;
    request.distance = bad == 0 ? -2. : bad;
    EXPECT_THROW(TrustRegion(model, request), std::invalid_argument);
    request.distance = 0;
    request.most_held = bad == 0 || bad == infinity ? -1 : double(bad);
    EXPECT_THROW(TrustRegion(model, request), std::invalid_argument);
  }
  TrustRegionRequest request;
  request.radius = 0.1;
  TrustRegion region(model, request);
  auto accepted = mesh.vertices;
  EXPECT_THROW(region.truncate(accepted, accepted), std::invalid_argument) << "before begin";
  region.begin(accepted);
  auto wrong = accepted;
  for (const double bad : {nan, infinity, std::numeric_limits<double>::max()}) {
    wrong[7][1] = bad;
    EXPECT_THROW(region.truncate(wrong, accepted), std::invalid_argument) << bad;
    EXPECT_THROW(region.begin(wrong), std::invalid_argument);
  }
  wrong.pop_back();
  EXPECT_THROW(region.truncate(wrong, accepted), std::invalid_argument);
  EXPECT_THROW(region.begin(wrong), std::invalid_argument);
  EXPECT_THROW(region.setTransform(0, fcl::Transform3d::Identity()), std::out_of_range);
  auto sheared = fcl::Transform3d(fcl::Transform3d::Identity());
  sheared.linear()(0, 1) = 1;
  EXPECT_THROW(region.addObstacle(model, sheared), std::invalid_argument);
  EXPECT_EQ(mesh.vertices, accepted);
  TrustRegion other = std::move(region);
  auto proposed = accepted;
  for (auto& x : proposed) x[2] += 0.01;
  EXPECT_EQ(0u, other.truncate(proposed, accepted).held_back);
  EXPECT_EQ(proposed, accepted);
}

/// An obstacle that is placed anew counts there from the next `begin` on.
TEST_F(TrustRegionTest, PlacesObstacles) {
  const TriangleMesh mesh = plate(4, 4);
  const DeformableMesh model(mesh);
  auto below = fcl::Transform3d(fcl::Transform3d::Identity());
  below.translation()[2] = -0.05;
  TrustRegionRequest request;
  request.radius = 0.2;
  TrustRegion region(model, request);
  region.addObstacle(model, below);
  auto proposed = mesh.vertices;
  for (auto& x : proposed) x[2] -= 0.1;
  auto accepted = mesh.vertices;
  region.begin(accepted);
  EXPECT_EQ(25u, region.truncate(proposed, accepted).held_back);
  for (const auto& x : accepted) EXPECT_GT(x[2], -0.05);
  below.translation()[2] = -0.5;
  region.setTransform(0, below);
  region.begin(mesh.vertices);
  EXPECT_EQ(0u, region.truncate(proposed, accepted).held_back);
}

/// So does one that moves, deforms or gets other triangles, although a search comes before.
TEST_F(TrustRegionTest, SearchesAmongTheObstaclesOfTheLastBegin) {
  const TriangleMesh mesh = plate(4, 4);
  const DeformableMesh model(mesh);
  DeformableMesh obstacle(mesh);
  auto below = fcl::Transform3d(fcl::Transform3d::Identity());
  below.translation()[2] = -0.05;
  TrustRegionRequest request;
  request.radius = 0.02;
  for (int change = 0; change < 4; ++change) {
    SCOPED_TRACE(change);
    obstacle = DeformableMesh(mesh);
    TrustRegion region(model, request);
    region.addObstacle(obstacle, below);
    auto accepted = mesh.vertices, proposed = accepted;
    region.begin(accepted);
    for (auto& x : proposed) x[2] -= 0.2;
    EXPECT_EQ(25u, region.truncate(proposed, accepted).held_by_radius);
    auto away = below;
    away.translation()[2] = -9;
    if (change == 0) region.setTransform(0, away);
    if (change == 1) obstacle.update(proposed);
    if (change == 2) obstacle = DeformableMesh(obstacle);
    if (change == 3) {
      obstacle = DeformableMesh(plate(3, 3));
      const auto before = region.accepted();
      EXPECT_THROW(region.truncate(proposed, accepted), std::invalid_argument);
      EXPECT_EQ(before, region.accepted());
      region.begin(before);
    }
    bool has_searched = false;
    for (int i = 0; i < 8; ++i) has_searched |= region.truncate(proposed, accepted).has_searched;
    EXPECT_TRUE(has_searched);
    for (const auto& x : accepted) {
      EXPECT_GT(x[2], -0.05);
      EXPECT_LT(x[2], -0.045);
    }
  }
}

/// Ten iterations of a step of a simulation; all pairs, without a tree.
TEST(TrustRegionStep, StaysApart) {
  const TriangleMesh mesh = loadStep("cloth_funnel_227");
  if (mesh.triangles.empty()) GTEST_SKIP() << "no data in " << dataFolder();
  const auto end = loadStep("cloth_funnel_228").vertices;
  const DeformableMesh model(mesh);
  TrustRegionRequest request;
  request.radius = 0.004;
  TrustRegion region(model, request);
  auto accepted = mesh.vertices;
  region.begin(accepted);
  for (int iteration = 1; iteration <= 2; ++iteration) {
    const auto before = accepted;
    auto proposed = accepted;
    for (std::size_t v = 0; v < end.size(); ++v) proposed[v] += 0.4 * (end[v] - accepted[v]);
    region.truncate(proposed, accepted);
    const SweptFeatures features(before, accepted, mesh.triangles);
    features.forEachPair(
        0, [&](const SweptFeatures::Pair& pair) { ASSERT_TRUE(features.areApartAllTheWay(pair)); });
  }
}

/// A cloth falls on a ball, and lies on it: nothing ever crosses anything, by all pairs.
TEST(TrustRegionCloth, NeverCrossesTheBall) {
  FallingCloth cloth(8, 0.4);
  const TriangleMesh ball = bent(9, 9, [](double x, double y) -> P {
    const double a = 2 * M_PI * x, b = M_PI * (0.02 + 0.96 * y);
    return 0.25 * P(std::sin(b) * std::cos(a), std::sin(b) * std::sin(a), std::cos(b));
  });
  const DeformableMesh model(cloth.mesh()), obstacle(ball);
  TrustRegionRequest request;
  request.radius = 0.05;
  request.distance = 1e-4;
  TrustRegion region(model, request);
  region.addObstacle(obstacle);
  std::size_t held = 0;
  long near = 0;
  for (int step = 0; step < manySteps(40); ++step) {
    region.begin(cloth.positions());
    cloth.step([&](const std::vector<P>& proposed, std::vector<P>& positions) {
      const std::vector<P> before = positions;
      held += region.truncate(proposed, positions).held_back;
      std::vector<P> start = before, end = positions;
      std::vector<fcl::Triangle> triangles = cloth.mesh().triangles;
      for (const fcl::Triangle& t : ball.triangles)
        triangles.emplace_back(before.size() + t[0], before.size() + t[1], before.size() + t[2]);
      start.insert(start.end(), ball.vertices.begin(), ball.vertices.end());
      end.insert(end.end(), ball.vertices.begin(), ball.vertices.end());
      const SweptFeatures features(start, end, triangles);
      features.forEachPair(0, [&](const SweptFeatures::Pair& pair) {
        if (pair.corners[0] >= before.size() && pair.corners[3] >= before.size()) return;
        ++near;
        ASSERT_TRUE(features.areApartAllTheWay(pair)) << step;
      });
    });
  }
  EXPECT_GT(held, 500u);
  EXPECT_GT(near, 1000);
}

}  // namespace trust_region_test
}  // namespace adaptive_bvh_test
