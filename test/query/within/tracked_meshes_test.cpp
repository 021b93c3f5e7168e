// TrackedMeshes: how far two triangles can have moved, one relative to the other, against the
// motion of their corners in quadruple precision, from each time to each later one.
// docs/bounds.md, 21.
#include "query/within/tracked_meshes.h"

#include <gtest/gtest.h>

#include "support/long_mode.h"
#include "support/quad_geometry.h"
#include "support/random_geometry.h"
#include "support/test_mesh.h"

namespace adaptive_bvh_test {
namespace tracked_meshes_test {

using adaptive_bvh::DeformableMesh;
using adaptive_bvh::Float4;
using adaptive_bvh::KeptMeshes;
using adaptive_bvh::MotionUnit;
using adaptive_bvh::PlacedMesh;
using adaptive_bvh::stateOf;
using adaptive_bvh::TrackedMeshes;
using Points = std::vector<fcl::Vector3d>;

constexpr unsigned kTriangles = 4;  // of each mesh

/// What the tracking says of a time, and where the corners are, as it has read them.
struct Time {
  std::array<std::vector<Float4>, 2> motions;
  std::array<std::vector<quad::Triangle>, 2> corners;

  Time(const TrackedMeshes& tracked) {
    for (int side = 0; side < 2; ++side)
      for (unsigned id = 0; id < kTriangles; ++id) {
        const auto at = std::size_t(side);
        motions[at].push_back(tracked[side].motions()[id]);
        const auto points = tracked[side].points(id);
        corners[at].push_back({quad::of(points[0]), quad::of(points[1]), quad::of(points[2])});
      }
  }
};

/// How far two corners, one of each triangle, have moved at most relative to each other.
quad::Real largestMotion(const Time& from, const Time& to, unsigned first, unsigned second) {
  quad::Real most = 0;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) {
      const quad::Point change = (to.corners[0][first][i] - to.corners[1][second][j]) -
                                 (from.corners[0][first][i] - from.corners[1][second][j]);
      most = std::max(most, quad::dot(change, change));
    }
  return quad::root(most);
}
/// What CandidateTester takes for that motion, in the unit, without rounding of its own.
double trackedMotion(const Time& from, const Time& to, unsigned first, unsigned second) {
  const auto apart = [&](const Time& time) -> fcl::Vector3d {
    const Float4 &a = time.motions[0][first], &b = time.motions[1][second];
    return {double(b[0]) - double(a[0]), double(b[1]) - double(a[1]), double(b[2]) - double(a[2])};
  };
  const auto deformation = [&](const Time& time) {
    return double(time.motions[0][first][3]) + double(time.motions[1][second][3]);
  };
  return (apart(to) - apart(from)).norm() + deformation(to) - deformation(from);
}

class TrackedMeshesTest : public testing::Test {
 protected:
  TriangleMesh soupAt(const fcl::Vector3d& centre, double size, bool on_lattice) {
    TriangleMesh mesh;
    for (unsigned t = 0; t < kTriangles; ++t) {
      for (int k = 0; k < 3; ++k) mesh.vertices.push_back(centre + size * place(on_lattice));
      mesh.triangles.emplace_back(3 * t, 3 * t + 1, 3 * t + 2);
    }
    return mesh;
  }
  fcl::Vector3d place(bool on_lattice) {
    if (!on_lattice) return random_.point();
    return fcl::Vector3d(random_.below(5), random_.below(5), random_.below(5)) / 4;
  }
  /// Moves some vertices, or all together, by steps of any size.
  void move(Points& points, double size, bool on_lattice) {
    const double by = on_lattice ? size : size * random_.size(-9, -1);
    const fcl::Vector3d common = by * place(on_lattice);
    const bool is_common = random_.oneIn(3), are_all = random_.oneIn(2);
    for (fcl::Vector3d& p : points)
      if (is_common)
        p += common;
      else if (are_all || random_.oneIn(6))
        p += by * place(on_lattice);
  }

  RandomGeometry random_{5521};
};

TEST_F(TrackedMeshesTest, BoundTheMotionOfTwoTriangles) {
  double most = 0, tightest = 1e300;
  long compared = 0, restarts = 0;
  for (int history = 0; history < manySteps(60) && !HasFailure(); ++history) {
    const bool on_lattice = random_.oneIn(3);
    const double size = std::ldexp(1., random_.below(200) - 100);
    const fcl::Vector3d far = random_.oneIn(2) ? fcl::Vector3d(fcl::Vector3d::Zero())
                                               : fcl::Vector3d(100 * size * random_.point());
    DeformableMesh first(soupAt(far, size, on_lattice)), second(soupAt(far, size, on_lattice));
    Points at1 = first.vertices(), at2 = second.vertices();
    fcl::Transform3d tf = fcl::Transform3d::Identity();
    TrackedMeshes tracked;
    for (int side = 0; side < 2; ++side)
      for (unsigned t = 0; t < kTriangles; ++t) tracked[side].leaves().push_back(t);
    std::vector<Time> times;
    for (int step = 0; step < 25; ++step) {
      move(at1, size, on_lattice);
      move(at2, size, on_lattice);
      first.update(at1);
      second.update(at2);
      if (random_.oneIn(4)) {
        tf.translation() += size * place(on_lattice);
        if (!on_lattice) tf.rotate(Eigen::AngleAxisd(random_.uniform(-1, 1), random_.direction()));
      }
      const KeptMeshes meshes(PlacedMesh(stateOf(first), fcl::Transform3d::Identity()),
                              PlacedMesh(stateOf(second), tf));
      if (!tracked.update(meshes, size, step == 0)) {
        times.clear();  // motion is counted from now on
        ++restarts;
      }
      times.emplace_back(tracked);
      const double scale = tracked.unit().scale;
      for (const Time& before : times)
        for (unsigned i = 0; i < kTriangles; ++i)
          for (unsigned j = 0; j < kTriangles; ++j) {
            const double moved =
                             double(quad::Real(scale) * largestMotion(before, times.back(), i, j)),
                         bound = trackedMotion(before, times.back(), i, j);
            ASSERT_LE(moved, bound + double(MotionUnit::kMotionError))
                << "history " << history << ", step " << step;
            most = std::max(most, (moved - bound) / double(MotionUnit::kMotionError));
            if (moved > 0.01) tightest = std::min(tightest, bound / moved);
            ++compared;
          }
    }
  }
  std::printf("%ld motions, %ld restarts; up to %.2g of the rounding; least bound: %.4f motions\n",
              compared, restarts, most, tightest);
  EXPECT_GT(compared, 50000);
  EXPECT_GT(most, 0) << "rounding does count";
  EXPECT_LT(tightest, 1.01) << "or nothing was common";
}

}  // namespace tracked_meshes_test
}  // namespace adaptive_bvh_test
