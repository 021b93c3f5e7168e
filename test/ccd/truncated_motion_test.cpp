// truncateMotion against all pairs of features, in quadruple precision: what either may sweep stays
// apart.
#include <gtest/gtest.h>

#include "adaptive_bvh/continuous_collision.h"
#include "support/long_mode.h"
#include "support/step_data.h"
#include "support/swept_surface_test.h"

namespace adaptive_bvh_test {
namespace truncated_motion_test {

using adaptive_bvh::DeformableMesh;
using adaptive_bvh::Motion;
using P = Eigen::Vector3d;

/// The positions that a caller computes, in the number type of the mesh.
std::vector<fcl::Vector3d> truncated(const std::vector<fcl::Vector3d>& start,
                                     const std::vector<fcl::Vector3d>& end,
                                     const std::vector<double>& shares) {
  std::vector<fcl::Vector3d> at(start.size());
  for (std::size_t v = 0; v < start.size(); ++v)
    at[v] = start[v] + double(shares[v]) * (end[v] - start[v]);
  return at;
}

/// The share of the motion that is kept.
double kept(const std::vector<fcl::Vector3d>& start, const std::vector<fcl::Vector3d>& end,
            const std::vector<double>& shares) {
  double all = 0, some = 0;
  for (std::size_t v = 0; v < start.size(); ++v) {
    const double length = double((end[v] - start[v]).norm());
    all += length;
    some += shares[v] * length;
  }
  return some / all;
}

class TruncatedMotion : public SweptSurfaceTest {
 protected:
  using SweptSurfaceTest::random_;
  using typename SweptSurfaceTest::World;

  TruncatedMotion() : SweptSurfaceTest(61) {}

  /// A crumpled sheet, a tube, or triangles that share nothing.
  TriangleMesh mesh(int kind) {
    if (kind == 2) return soup(40, random_.engine());
    TriangleMesh mesh = kind == 0 ? plate(6, 5) : tube(6, 6);
    for (auto& x : mesh.vertices) x += random_.point() * 0.1;
    return mesh;
  }
  /// Some whole numbers, among them vertices on vertices and parallel edges.
  TriangleMesh latticeSoup() {
    TriangleMesh mesh;
    for (int v = 0; v < 24; ++v)
      mesh.vertices.emplace_back(double(random_.below(8)), double(random_.below(8)),
                                 double(random_.below(8)));
    for (int t = 0; t < 12; ++t) {
      const auto v = std::size_t(random_.below(22));
      mesh.triangles.emplace_back(v, v + 1, v + 2);
    }
    return mesh;
  }
  /// All pairs of one mesh.
  void expectApart(const World& world) {
    SweptSurfaceTest::expectApart(world, [](const SweptFeatures::Pair&) { return false; });
  }
  /// Pairs of two meshes, of which the first has so many vertices.
  void expectApart(const World& world, std::size_t of_first) {
    SweptSurfaceTest::expectApart(world, [&](const SweptFeatures::Pair& pair) {
      return (pair.corners[0] < of_first) == (pair.corners[3] < of_first);
    });
  }
};

TEST_F(TruncatedMotion, OfOneMeshStaysApart) {
  const auto still = fcl::Transform3d::Identity();
  for (int round = 0; round < manySteps(60); ++round) {
    const bool lattice = round % 4 == 3;
    const TriangleMesh mesh = lattice ? this->latticeSoup() : this->mesh(round % 3);
    auto end = this->moved(mesh.vertices, lattice ? 4. : double(this->random_.size(-2, 0.5)));
    if (lattice)
      for (auto& x : end) x = x.array().round().matrix().eval();
    const DeformableMesh model(mesh);
    std::vector<double> shares;
    selfTruncateMotion(Motion(model, mesh.vertices, end), 0, shares);
    ASSERT_EQ(end.size(), shares.size());
    for (const double share : shares) ASSERT_TRUE(share >= 0 && share <= 1);
    World world;
    world.add(mesh, mesh.vertices, truncated(mesh.vertices, end, shares), still);
    this->expectApart(world);
  }
  EXPECT_GT(this->near_, 2000);
}

TEST_F(TruncatedMotion, OfTwoMeshesStaysApart) {
  for (int round = 0; round < manySteps(60); ++round) {
    const TriangleMesh a = this->mesh(round % 3), b = this->mesh(round / 3 % 3);
    const double size = double(this->random_.size(-2, 0.5));
    const auto a_end = this->moved(a.vertices, size), b_end = this->moved(b.vertices, size);
    const auto tf =
        round % 2 ? this->random_.pose(0.6) : fcl::Transform3d(fcl::Transform3d::Identity());
    const DeformableMesh first(a), second(b);
    std::vector<double> of_a, of_b;
    truncateMotion(Motion(first, a.vertices, a_end, tf, tf), Motion(second, b.vertices, b_end), 0,
                   of_a, of_b);
    World world;
    world.add(a, a.vertices, truncated(a.vertices, a_end, of_a), tf);
    world.add(b, b.vertices, truncated(b.vertices, b_end, of_b), fcl::Transform3d::Identity());
    this->expectApart(world, a.vertices.size());
  }
  EXPECT_GT(this->near_, 2000);
}

/// Vertices move one after the other, there and back, each somewhere on its way: the surfaces never
/// come nearer than the separation, or than they were.
TEST_F(TruncatedMotion, KeepsTheSeparationInEveryOrder) {
  long measured = 0;
  for (int round = 0; round < manySteps(12); ++round) {
    TriangleMesh mesh = this->mesh(round % 2);
    const double separation = this->random_.size(-3, -1.5);
    const auto end = this->moved(mesh.vertices, 0.3);
    const DeformableMesh model(mesh);
    std::vector<double> shares;
    selfTruncateMotion(Motion(model, mesh.vertices, end), separation, shares);
    const auto farthest = truncated(mesh.vertices, end, shares);
    std::vector<P> start, last;
    this->append(mesh.vertices, fcl::Transform3d::Identity(), start);
    this->append(farthest, fcl::Transform3d::Identity(), last);
    const SweptFeatures features(start, last, mesh.triangles);
    features.forEachPair(separation, [&](const SweptFeatures::Pair& pair) {
      const auto from = features.corners(pair, 0), to = features.corners(pair, 1);
      const double before = double(distance(pair.firsts, from));
      if (!(before > 1e-5)) return;
      for (int state = 0; state < 4; ++state) {
        std::array<quad::Point, 4> now;
        for (std::size_t i = 0; i < 4; ++i) {
          const double t =
              this->random_.oneIn(2) ? this->random_.below(2) : double(this->random_.uniform(0, 1));
          now[i] = from[i] + quad::Real(t) * (to[i] - from[i]);
        }
        ++measured;
        ASSERT_GT(double(distance(pair.firsts, now)),
                  std::min(separation, before * (1 - 1e-8)) - 1e-7 * (sizeof(double) == 4));
      }
    });
  }
  EXPECT_GT(measured, 1000);
}

TEST_F(TruncatedMotion, PlatesSlideAlongEachOther) {
  TriangleMesh mesh = plate(20, 20);
  const DeformableMesh model(mesh);
  auto above = mesh.vertices, end = mesh.vertices;
  for (auto& x : above) x[2] += 1e-3;
  for (std::size_t v = 0; v < end.size(); ++v) end[v] = above[v] + fcl::Vector3d(0.23, 0.11, 0);
  std::vector<double> of_upper, of_lower;
  truncateMotion(Motion(model, above, end), Motion(model, mesh.vertices, mesh.vertices), 0,
                 of_upper, of_lower);
  EXPECT_GE(kept(above, end, of_upper), 0.99);
  for (const double share : of_lower) EXPECT_EQ(1, share) << "does not move";
}

TEST_F(TruncatedMotion, DoesNotDependOnThreadsAndRefusesWhatMotionsRefuse) {
  const TriangleMesh mesh = this->mesh(0);
  const auto end = this->moved(mesh.vertices, 0.3);
  DeformableMesh model(mesh);
  const Motion motion(model, mesh.vertices, end);
  std::vector<double> one, two;
  selfTruncateMotion(motion, 1e-3, one);
  model.setThreads(2);
  selfTruncateMotion(motion, 1e-3, two);
  EXPECT_EQ(one, two);
  const std::vector<double> before = two;
  EXPECT_THROW(selfTruncateMotion(motion, -1, two), std::invalid_argument);
  auto broken = end;
  broken[3][1] = std::numeric_limits<double>::infinity();
  EXPECT_THROW(selfTruncateMotion(Motion(model, mesh.vertices, broken), 0, two),
               std::invalid_argument);
  EXPECT_EQ(before, two);
}

/// Steps of simulations: no pair of features meets, and how much of the motion is kept.
struct Step {
  const char *start, *end;
  double part, least_kept;
};
class TruncatedStep : public testing::TestWithParam<Step> {};

TEST_P(TruncatedStep, StaysApartAndKeepsMost) {
  const TriangleMesh mesh = loadStep(GetParam().start);
  if (mesh.triangles.empty()) GTEST_SKIP() << "no data in " << dataFolder();
  const std::vector<double> part(mesh.vertices.size(), GetParam().part);
  const auto end = truncated(mesh.vertices, loadStep(GetParam().end).vertices, part);
  const DeformableMesh model(mesh);
  std::vector<double> shares;
  selfTruncateMotion(Motion(model, mesh.vertices, end), 0, shares);
  const double share = kept(mesh.vertices, end, shares);
  EXPECT_GE(share, GetParam().least_kept);
  RecordProperty("kept", std::to_string(share));
  const auto at = truncated(mesh.vertices, end, shares);
  const SweptFeatures features(mesh.vertices, at, mesh.triangles);
  long near = 0;
  features.forEachPair(0, [&](const SweptFeatures::Pair& pair) {
    ++near;
    ASSERT_TRUE(features.areApartAllTheWay(pair));
  });
  EXPECT_GT(near, 1000);
}

INSTANTIATE_TEST_SUITE_P(
    Steps, TruncatedStep,
    testing::Values(Step{"cloth_funnel_227", "cloth_funnel_228", 1, 0.961},
                    Step{"cloth_funnel_227", "cloth_funnel_228", 1. / 3, 0.990},
                    Step{"cloth_funnel_227", "cloth_funnel_228", 0.1, 0.992},
                    Step{"armadillo_rollers_326", "armadillo_rollers_327", 1, 0},
                    Step{"armadillo_rollers_326", "armadillo_rollers_327", 0.03, 0.682}),
    [](const auto& info) {
      return std::string(info.param.start) + "_" + std::to_string(int(1000 * info.param.part));
    });

}  // namespace truncated_motion_test
}  // namespace adaptive_bvh_test
