// The curve around the triangles below a node, against the edges that these triangles do not share.
#include "boxes/contours.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <set>
#include <utility>

#include "deformable/mesh_state.h"
#include "support/meshes.h"

namespace adaptive_bvh_test {
namespace contours_test {

using adaptive_bvh::Contours;
using adaptive_bvh::Patch;
using adaptive_bvh::WideTree;
using adaptive_bvh::detail::MeshAccess;
using Edges = std::set<std::pair<unsigned, unsigned>>;

class ContoursTest : public testing::Test {
 protected:
  void adopt(const TriangleMesh& mesh) { mesh_.emplace(mesh); }
  const WideTree& tree() const { return MeshAccess::state(*mesh_).tree; }
  const Contours& contours() const { return MeshAccess::state(*mesh_).topology->contours; }
  Edges edgesAround(const Patch& patch) const {
    Edges edges;
    for (unsigned t = patch.first; t < patch.first + patch.count; ++t)
      for (int k = 0; k < 3; ++k) {
        const auto a = unsigned(tree().corners(t)[k]), b = unsigned(tree().corners(t)[(k + 1) % 3]);
        if (edges.erase({b, a}) == 0) edges.insert({a, b});
      }
    return edges;
  }
  Edges contour(const Patch& patch) const {
    Edges edges;
    const unsigned* const slots = contours().slots(patch);
    const std::vector<unsigned>& vertices = tree().slots().vertices();
    for (unsigned i = 0; i < patch.length; ++i)
      edges.insert({vertices[slots[i]], vertices[slots[(i + 1) % patch.length]]});
    return edges;
  }

  std::optional<adaptive_bvh::DeformableMesh> mesh_;
};

TEST_F(ContoursTest, AreTheEdgesAroundEachNode) {
  adopt(plate(40, 30));
  EXPECT_EQ(contours().patch(0).count, 2400u);
  EXPECT_EQ(contours().patch(0).length, 140u);
  int found = 0;
  for (int i = 0; i < tree().size(); ++i) {
    const Patch& patch = contours().patch(i);
    if (patch.length == 0) continue;
    ++found;
    EXPECT_EQ(contour(patch), edgesAround(patch)) << "node " << i;
  }
  EXPECT_GT(found, 20);
}

TEST_F(ContoursTest, OfNoSingleCurveAreNone) {
  TriangleMesh ring = plate(20, 6);
  for (fcl::Triangle& t : ring.triangles) {
    const auto joined = [](std::size_t v) { return v % 21 == 20 ? v - 20 : v; };
    t.set(joined(t[0]), joined(t[1]), joined(t[2]));
  }
  for (fcl::Vector3d& p : ring.vertices)
    p = {std::cos(2 * M_PI * p[0]), std::sin(2 * M_PI * p[0]), p[1]};
  adopt(ring);
  EXPECT_EQ(contours().patch(0).length, 0u) << "it has two ends";
}

TEST_F(ContoursTest, OfASurfaceWithTwoOrientationsAreNone) {
  TriangleMesh one_side_turned = plate(10, 10);
  for (std::size_t t = 0; t < 60; ++t) {
    fcl::Triangle& triangle = one_side_turned.triangles[t];
    triangle.set(triangle[0], triangle[2], triangle[1]);
  }
  adopt(one_side_turned);
  EXPECT_EQ(contours().patch(0).length, 0u) << "edges along the seam go the same way twice";
}

TEST_F(ContoursTest, ThatComeToAVertexTwiceAreNone) {
  TriangleMesh two = plate(5, 5);  // and another that meets it in a corner
  const std::size_t corner = two.vertices.size() - 1;
  const auto other = plate(5, 5);
  for (const fcl::Triangle& t : other.triangles) {
    const auto moved = [&](std::size_t v) { return v == 0 ? corner : corner + v; };
    two.triangles.emplace_back(moved(t[0]), moved(t[1]), moved(t[2]));
  }
  for (std::size_t v = 1; v < other.vertices.size(); ++v)
    two.vertices.push_back(other.vertices[v] + two.vertices[corner]);
  adopt(two);
  EXPECT_EQ(contours().patch(0).length, 0u);
}

}  // namespace contours_test
}  // namespace adaptive_bvh_test
