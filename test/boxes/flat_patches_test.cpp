// Of a node that FlatPatches calls flat no two triangles touch that have no vertex in common,
// judged in quadruple precision; and surfaces that meet themselves are not called flat.
#include "boxes/flat_patches.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <utility>

#include "deformable/mesh_state.h"
#include "support/brute_force.h"
#include "support/long_mode.h"
#include "support/meshes.h"

namespace adaptive_bvh_test {
namespace flat_patches_test {

using adaptive_bvh::FlatPatches;
using adaptive_bvh::Patch;
using Mesh = adaptive_bvh::DeformableMesh;

/// The flat nodes of a mesh.
class FlatNodes {
 public:
  explicit FlatNodes(const Mesh& mesh)
      : mesh_(adaptive_bvh::detail::MeshAccess::state(mesh)),
        wide_(mesh_.tree),
        contours_(mesh_.topology->contours),
        flat_(wide_, contours_),
        touching_(BruteForce(mesh, fcl::Transform3d::Identity(), mesh, fcl::Transform3d::Identity())
                      .contacts()) {}

  bool hasFlatRoot() const { return flat_.contains(0); }
  /// How many triangles lie below flat nodes; expects that none of a node meet.
  unsigned check(int node = 0) const {
    if (wide_.nodes()[node].isLeaf()) return 0;
    const Patch& patch = contours_.patch(node);
    if (flat_.contains(node)) {
      expectApart(patch);
      return patch.count;
    }
    unsigned sum = 0;
    for (int k = 0; k < wide_.nodes()[node].count; ++k) sum += check(wide_.nodes()[node].below[k]);
    return sum;
  }

 private:
  void expectApart(const Patch& patch) const {
    int touching = 0;
    for (unsigned i = patch.first; i < patch.first + patch.count; ++i)
      for (unsigned j = patch.first; j < patch.first + patch.count; ++j) {
        const auto p = wide_.corners(i), q = wide_.corners(j);
        bool are_neighbours = false;
        for (int k = 0; k < 9; ++k) are_neighbours |= p[k / 3] == q[k % 3];
        touching += !are_neighbours && touching_.count({p[3], q[3]}) > 0;
      }
    EXPECT_EQ(touching, 0) << "pairs among " << patch.count << " triangles from " << patch.first;
  }

  const adaptive_bvh::MeshState& mesh_;
  const adaptive_bvh::WideTree& wide_;
  const adaptive_bvh::Contours& contours_;
  const FlatPatches flat_;
  /// All that do, the smaller index first.
  const std::set<std::pair<int, int>> touching_;
};

unsigned flatTriangles(const TriangleMesh& triangles) {
  const Mesh mesh(triangles);
  return FlatNodes(mesh).check();
}

bool isFlat(const TriangleMesh& triangles) {
  const Mesh mesh(triangles);
  return FlatNodes(mesh).hasFlatRoot();
}

constexpr int kColumns = 20, kRows = 24;
constexpr unsigned kAll = 2 * kColumns * kRows;

TEST(FlatPatches, HoldNoPairThatFclCallsTouching) {
  std::mt19937 random(testSeed(3));
  std::uniform_real_distribution<double> one(-1, 1);
  unsigned flat = 0, all = 0;
  for (int i = 0; i < manySteps(60); ++i) {
    // From smooth to crumpled; squeezed, so that triangles become slender.
    const double height = 0.4 * std::fabs(one(random)), noise = 0.06 * std::pow(one(random), 4),
                 squeeze = std::pow(10., -2.5 * std::fabs(one(random))), waves = 12 * one(random);
    auto mesh = plate(kColumns, kRows);
    const auto pose = randomPose(random, 2);
    for (auto& p : mesh.vertices) {
      p = {p[0] * squeeze, p[1], height * std::sin(waves * p[0] + 3 * p[1])};
      p = pose * fcl::Vector3d(p + noise * fcl::Vector3d(one(random), one(random), one(random)));
    }
    flat += flatTriangles(mesh);
    all += kAll;
  }
  EXPECT_GT(flat, all / 5);
  EXPECT_LT(flat, all);
}

TEST(FlatPatches, HoldASheetAndADome) {
  EXPECT_TRUE(isFlat(plate(kColumns, kRows)));
  const auto bowl = bent(kColumns, kRows, [](double u, double v) {
    const double x = 1.2 * u - 0.6, y = 1.2 * v - 0.6;
    return fcl::Vector3d(x, y, std::sqrt(1 - x * x - y * y));
  });
  EXPECT_TRUE(isFlat(bowl));
}

/// All of it faces up, and it goes around by `turns`, to above where it began.
TriangleMesh ramp(double turns) {
  return bent(6, 80, [turns](double u, double v) {
    const double around = 2 * M_PI * turns * v, radius = 1 + u;
    return fcl::Vector3d(radius * std::cos(around), radius * std::sin(around), 0.2 * v);
  });
}

TEST(FlatPatches, AreNotARampOfMoreThanOneTurn) {
  EXPECT_TRUE(isFlat(ramp(0.9)));
  EXPECT_FALSE(isFlat(ramp(1.1)));
  EXPECT_FALSE(isFlat(ramp(2.3)));
}

/// As seen along any direction it covers some point twice.
TEST(FlatPatches, AreNotAFoldedSheet) {
  const auto folded = bent(kColumns, kRows, [](double u, double v) {
    return v < 0.5 ? fcl::Vector3d(u, v, 0) : fcl::Vector3d(u, 1 - v, 0.01 * (v - 0.5));
  });
  EXPECT_FALSE(isFlat(folded));
}

}  // namespace flat_patches_test
}  // namespace adaptive_bvh_test
