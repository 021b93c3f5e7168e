// The view of a model's primitives: triangles or points, in one frame or two.
#include "mesh/mesh_view.h"

#include <gtest/gtest.h>

#include "support/meshes.h"

namespace adaptive_bvh_test {
namespace mesh_view_test {

using adaptive_bvh::MeshView;
using adaptive_bvh::VertexIndices;
using adaptive_bvh::viewOf;
using P = fcl::Vector3d;

// 3---2
// | / |    two triangles, 0 1 2 and 0 2 3
// 0---1
class View : public testing::Test {
 protected:
  View() {
    view_.vertices = now_;
    view_.triangles = triangles_;
  }

  std::vector<P> positions(unsigned primitive) const {
    std::vector<P> found;
    view_.forEachPosition(primitive, [&](const P& p) { found.push_back(p); });
    return found;
  }

  const P now_[4] = {P(0, 0, 0), P(1, 0, 0), P(1, 1, 0), P(0, 1, 0)};
  const P before_[4] = {P(0, 0, 9), P(1, 0, 9), P(1, 1, 9), P(0, 1, 9)};
  const fcl::Triangle triangles_[2] = {fcl::Triangle(0, 1, 2), fcl::Triangle(0, 2, 3)};
  MeshView<double> view_;
};

TEST_F(View, OfTriangles) {
  EXPECT_EQ(3, view_.verticesPerPrimitive());
  EXPECT_EQ((VertexIndices{0, 1, 2}), view_.verticesOf(0));
  EXPECT_EQ((VertexIndices{0, 2, 3}), view_.verticesOf(1));
  for (int k = 0; k < 3; ++k) EXPECT_EQ(view_.verticesOf(1)[std::size_t(k)], view_.vertex(1, k));
  EXPECT_EQ((std::vector<P>{now_[0], now_[2], now_[3]}), positions(1));
}

/// A point is a primitive of its own, and a triangle with three equal corners.
TEST_F(View, OfPoints) {
  view_.triangles = nullptr;
  EXPECT_EQ(1, view_.verticesPerPrimitive());
  EXPECT_EQ((VertexIndices{3, 3, 3}), view_.verticesOf(3));
  EXPECT_EQ(3u, view_.vertex(3, 0));
  EXPECT_EQ((std::vector<P>{now_[3]}), positions(3));
}

/// Of two frames each corner has two positions.
TEST_F(View, OfTwoFrames) {
  view_.previous = before_;
  EXPECT_EQ((std::vector<P>{now_[0], before_[0], now_[1], before_[1], now_[2], before_[2]}),
            positions(0));
  view_.triangles = nullptr;
  EXPECT_EQ((std::vector<P>{now_[1], before_[1]}), positions(1));
}

/// A model's view shows its own arrays: triangles, also of large numbers; points where it has no
/// triangles; and the step before once there is one.
TEST_F(View, OfAModel) {
  fcl::BVHModel<fcl::RSSd> mesh, cloud;
  const auto sheet = plate(40, 40);
  ASSERT_EQ(fcl::BVH_OK, fillModel(sheet, mesh));
  const MeshView<double> view = viewOf(mesh);
  EXPECT_EQ(mesh.vertices, view.vertices);
  EXPECT_EQ(nullptr, view.previous);
  for (unsigned t = 0; t < sheet.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k)
      ASSERT_EQ(sheet.triangles[t][std::size_t(k)], view.verticesOf(t)[std::size_t(k)]);

  mesh.beginUpdateModel();
  mesh.updateSubModel(sheet.vertices);
  mesh.endUpdateModel();
  EXPECT_EQ(mesh.prev_vertices, viewOf(mesh).previous);
  EXPECT_NE(nullptr, viewOf(mesh).previous);

  cloud.beginModel();
  cloud.addSubModel(sheet.vertices);
  cloud.endModel();
  EXPECT_EQ(nullptr, viewOf(cloud).triangles);
  EXPECT_EQ(1, viewOf(cloud).verticesPerPrimitive());
}

}  // namespace mesh_view_test
}  // namespace adaptive_bvh_test
