// Displacements: pairs of nodes that are left out of a search, against the motion of all vertices
// below them in quadruple precision. docs/bounds.md, 21.
#include "query/within/displacements.h"

#include <gtest/gtest.h>

#include "support/long_mode.h"
#include "support/quad_geometry.h"
#include "support/random_geometry.h"
#include "support/test_mesh.h"

namespace adaptive_bvh_test {
namespace displacements_test {

using adaptive_bvh::DeformableMesh;
using adaptive_bvh::Displacements;
using adaptive_bvh::KeptMeshes;
using adaptive_bvh::PlacedMesh;
using adaptive_bvh::stateOf;
using adaptive_bvh::WideNode;
using adaptive_bvh::WideTree;
using Points = std::vector<fcl::Vector3d>;

/// The vertices below each node.
std::vector<std::vector<unsigned>> verticesBelow(const WideTree& tree) {
  std::vector<std::vector<unsigned>> below(std::size_t(tree.size()));
  for (int n = tree.size(); n-- > 0;) {
    const WideNode& node = tree.nodes()[n];
    std::vector<unsigned>& vertices = below[std::size_t(n)];
    for (int i = 0; i < int(node.count); ++i)
      if (node.isLeaf()) {
        const auto& v = tree.corners(unsigned(node.first + i));
        for (int k = 0; k < 3; ++k) vertices.push_back(unsigned(v[k]));
      } else {
        const auto& of_child = below[std::size_t(node.below[i])];
        vertices.insert(vertices.end(), of_child.begin(), of_child.end());
      }
    std::sort(vertices.begin(), vertices.end());
    vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
  }
  return below;
}

class DisplacementsTest : public testing::Test {
 protected:
  /// A sheet somewhere, whose coordinates are exact in double precision.
  static TriangleMesh sheetAt(const fcl::Vector3d& at, double size) {
    TriangleMesh mesh = plate(5, 6);
    for (fcl::Vector3d& p : mesh.vertices) p = size * (at + p);
    return mesh;
  }
  /// Moves all vertices together, some more, or each a little; on the lattice by whole steps.
  void move(Points& points, double limit, bool on_lattice) {
    const auto step = [&]() -> fcl::Vector3d {
      if (on_lattice)
        return limit * fcl::Vector3d(random_.below(3) - 1, random_.below(3) - 1, 0) / 2;
      return limit * random_.point() * random_.size(-6, 0);
    };
    const fcl::Vector3d common = random_.oneIn(2) ? fcl::Vector3d(50 * step()) : step();
    const int some = 1 + random_.below(8);
    for (fcl::Vector3d& p : points) {
      p += common;
      if (random_.oneIn(some)) p += step();
    }
  }
  /// How far each vertex has moved, in the first mesh's frame as a query computes it.
  static std::vector<quad::Point> motions(const KeptMeshes& meshes, int side, const Points& from) {
    std::vector<quad::Point> all;
    meshes.withMap(side, [&](const auto& map) {
      const Points& now = meshes.mesh(side).vertices;
      for (std::size_t v = 0; v < now.size(); ++v)
        all.push_back(quad::of(map(now[v])) - quad::of(from[v]));
    });
    return all;
  }

  RandomGeometry random_{5522};
};

TEST_F(DisplacementsTest, LeaveOutNoPairThatHasMovedFar) {
  long left_out = 0, wanted = 0, far = 0;
  double tightest = 0;
  for (int history = 0; history < manySteps(40) && !HasFailure(); ++history) {
    const bool is_self = random_.oneIn(2), on_lattice = random_.oneIn(2);
    const double size = std::ldexp(1., random_.below(120) - 60), limit = size / 8;
    const fcl::Vector3d at = random_.oneIn(2) ? fcl::Vector3d(fcl::Vector3d::Zero())
                                              : fcl::Vector3d(1 << 20, 3, -(1 << 18));
    DeformableMesh first(sheetAt(at, size)), second(sheetAt(at, size));
    fcl::Transform3d tf = fcl::Transform3d::Identity();
    if (!on_lattice) tf.translation() = size * random_.point();
    const auto now = [&]() -> KeptMeshes {
      if (is_self) return KeptMeshes(stateOf(first));
      return {PlacedMesh(stateOf(first), fcl::Transform3d::Identity()),
              PlacedMesh(stateOf(second), tf)};
    };
    Displacements displacements;
    EXPECT_TRUE(displacements.isEmpty());
    displacements.restart(now());
    std::array<Points, 2> from;
    for (int side = 0; side < 2; ++side) {
      const KeptMeshes meshes = now();
      meshes.withMap(side, [&](const auto& map) {
        for (const fcl::Vector3d& x : meshes.mesh(side).vertices)
          from[std::size_t(side)].push_back(map(x));
      });
    }
    const auto below1 = verticesBelow(stateOf(first).tree),
               below2 = verticesBelow(stateOf(second).tree);
    Points at1 = first.vertices(), at2 = second.vertices();
    for (int step = 0; step < 6; ++step) {
      move(at1, limit, on_lattice);
      move(at2, limit, on_lattice);
      first.update(at1);
      second.update(at2);
      if (!is_self && random_.oneIn(2)) tf.translation() += limit * random_.point();
      const KeptMeshes meshes = now();
      displacements.measure(meshes, limit);
      if (displacements.moved() == 1) continue;  // as a whole: everything is searched
      const auto motions1 = motions(meshes, 0, from[0]),
                 motions2 = is_self ? motions1 : motions(meshes, 1, from[1]);
      const auto& second_below = is_self ? below1 : below2;
      const adaptive_bvh::MovedNodes nodes = displacements.nodes();
      const bool has_nodes = displacements.largest() > limit;  // else all pairs are left out
      for (int a = 0; a < int(below1.size()); ++a)
        for (int b = 0; b < int(second_below.size()); ++b) {
          quad::Real most = 0;
          for (const unsigned v : below1[std::size_t(a)])
            for (const unsigned w : second_below[std::size_t(b)]) {
              const quad::Point apart = motions1[v] - motions2[w];
              most = std::max(most, quad::dot(apart, apart));
            }
          const double moved = double(quad::root(most)) / limit;
          ASSERT_LE(moved * limit, displacements.largest() * (1 + 1e-6) + 1e-300);
          if (has_nodes && nodes.contain({a, b})) {
            ++wanted;
            far += moved > 1;
          } else {
            ASSERT_LE(moved, 1 + 0x1p-20) << "history " << history << ", step " << step;
            tightest = std::max(tightest, moved);
            ++left_out;
          }
        }
    }
  }
  std::printf("%ld pairs of nodes are left out, of %ld others %ld have moved far; most %.6f\n",
              left_out, wanted, far, tightest);
  EXPECT_GT(left_out, 10000);
  EXPECT_GT(far, 1000);
  EXPECT_GT(tightest, 0.99);
}

}  // namespace displacements_test
}  // namespace adaptive_bvh_test
