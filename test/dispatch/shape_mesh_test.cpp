// The surfaces of shapes as meshes: closed, facing outward, with every vertex on the surface by the
// shape's formula, and nearly the shape's volume.
#include "adaptive_bvh/shape_mesh.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/geometry/octree/octree.h>
#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/cone.h>
#include <fcl/geometry/shape/convex.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/ellipsoid.h>
#include <fcl/geometry/shape/halfspace.h>
#include <fcl/geometry/shape/plane.h>
#include <fcl/geometry/shape/sphere.h>

#include "adaptive_bvh/deformable_mesh.h"
#include "adaptive_bvh/point_query.h"

namespace adaptive_bvh_test {
namespace shape_mesh_test {

using adaptive_bvh::shapeMesh;
using adaptive_bvh::TriangleMesh;

/// The volume that triangles enclose, which face outward.
double volumeOf(const TriangleMesh& mesh) {
  double volume = 0;
  for (const fcl::Triangle& t : mesh.triangles)
    volume += mesh.vertices[t[0]].dot(mesh.vertices[t[1]].cross(mesh.vertices[t[2]])) / 6;
  return volume;
}

fcl::Vector3d sizeOf(const TriangleMesh& mesh) {
  fcl::Vector3d low = mesh.vertices[0], high = low;
  for (const fcl::Vector3d& point : mesh.vertices) {
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  return high - low;
}

/// Each edge comes once in either direction.
bool isClosed(const TriangleMesh& mesh) {
  std::map<std::pair<std::size_t, std::size_t>, int> edges;
  for (const fcl::Triangle& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) ++edges[{t[k], t[(k + 1) % 3]}];
  for (const auto& [edge, count] : edges)
    if (count != 1 || !edges.count({edge.second, edge.first})) return false;
  return true;
}

struct Case {
  std::shared_ptr<fcl::CollisionGeometryd> shape;
  fcl::Vector3d size;
  double volume;
  std::function<double(const fcl::Vector3d& x)> off;  ///< 0 on the surface
};

std::vector<Case> cases() {
  const auto corners = std::make_shared<const std::vector<fcl::Vector3d>>(
      std::vector<fcl::Vector3d>{{0, 0, 0}, {2, 0, 0}, {0, 3, 0}, {0, 0, 4}});
  const auto faces = std::make_shared<const std::vector<int>>(
      std::vector<int>{3, 0, 2, 1, 3, 0, 1, 3, 3, 0, 3, 2, 3, 1, 2, 3});
  const double pi = std::acos(-1);
  const auto ofBox = [](const fcl::Vector3d& x, const fcl::Vector3d& half) {
    return (x.cwiseAbs() - half).maxCoeff();
  };
  const auto round = [](const fcl::Vector3d& x) { return std::hypot(x[0], x[1]); };
  return {
      {std::make_shared<fcl::Boxd>(1, 2, 3),
       {1, 2, 3},
       6,
       [=](const auto& x) {
         return ofBox(x, {0.5, 1, 1.5});
       }},
      {std::make_shared<fcl::Boxd>(1, 1e-9, 1),
       {1, 1e-9, 1},
       1e-9,
       [=](const auto& x) {
         return ofBox(x, {0.5, 5e-10, 0.5});
       }},
      {std::make_shared<fcl::Sphered>(2),
       {4, 4, 4},
       4. / 3 * pi * 8,
       [](const auto& x) { return x.norm() - 2; }},
      {std::make_shared<fcl::Capsuled>(1, 3),
       {2, 2, 5},
       4. / 3 * pi + 3 * pi,
       [=](const auto& x) { return std::hypot(round(x), std::max(std::abs(x[2]) - 1.5, 0.)) - 1; }},
      {std::make_shared<fcl::Cylinderd>(2, 5),
       {4, 4, 5},
       20 * pi,
       [=](const auto& x) { return std::max(round(x) - 2, std::abs(x[2]) - 2.5); }},
      {std::make_shared<fcl::Coned>(2, 3),
       {4, 4, 3},
       4 * pi,
       [=](const auto& x) { return std::max(round(x) - (1.5 - x[2]) * 2 / 3, -1.5 - x[2]); }},
      {std::make_shared<fcl::Ellipsoidd>(1, 2, 3),
       {2, 4, 6},
       8 * pi,
       [](const auto& x) { return x.cwiseQuotient(fcl::Vector3d(1, 2, 3)).norm() - 1; }},
      {std::make_shared<fcl::Convexd>(corners, 4, faces),
       {2, 3, 4},
       4,
       [](const auto& x) { return std::max(-x.minCoeff(), x[0] / 2 + x[1] / 3 + x[2] / 4 - 1); }},
  };
}

TEST(ShapeMesh, IsTheSurface) {
  for (const auto& [shape, size, volume, off] : cases())
    for (const int turn : {1, 8, 64, 65}) {
      const TriangleMesh mesh = shapeMesh(*shape, turn);
      const int name = shape->getNodeType();
      EXPECT_TRUE(isClosed(mesh)) << name << ' ' << turn;
      EXPECT_LE(volumeOf(mesh), volume * (1 + 1e-12)) << name;
      const double edges = std::max(8, turn);
      EXPECT_NEAR(volumeOf(mesh), volume, 30 / edges / edges * volume) << name << ' ' << turn;
      EXPECT_LT((sizeOf(mesh) - size).norm(), 1e-12) << name;
      for (const fcl::Vector3d& x : mesh.vertices) EXPECT_LT(std::abs(off(x)), 1e-14 * 8) << name;
    }
  // As often as asked, at least.
  EXPECT_EQ(shapeMesh(fcl::Sphered(1)).triangles.size(), 8u * 256);
  EXPECT_EQ(shapeMesh(fcl::Sphered(1), 8).triangles.size(), 8u * 4);
  EXPECT_EQ(shapeMesh(fcl::Boxd(1, 2, 3)).vertices.size(), 8u);
}

TEST(ShapeMesh, MakesMeshes) {
  for (const auto& test : cases()) {
    const adaptive_bvh::DeformableMesh mesh(shapeMesh(*test.shape));
    EXPECT_TRUE(adaptive_bvh::isWatertight(mesh));
  }
}

TEST(ShapeMesh, OfPlanesIsASquare) {
  const fcl::Vector3d up(0, 0.6, 0.8);
  for (const TriangleMesh& mesh :
       {shapeMesh(fcl::Planed(up, 2)), shapeMesh(fcl::Halfspaced(up, 2))}) {
    EXPECT_EQ(mesh.vertices.size(), 4u);
    for (const fcl::Vector3d& corner : mesh.vertices) {
      EXPECT_NEAR(up.dot(corner), 2, 1e-12);
      EXPECT_NEAR((corner - 2 * up).norm(), std::sqrt(2), 1e-12);
    }
    for (const fcl::Triangle& t : mesh.triangles)
      EXPECT_GT(up.dot((mesh.vertices[t[1]] - mesh.vertices[t[0]])
                           .cross(mesh.vertices[t[2]] - mesh.vertices[t[0]])),
                1);
  }
}

TEST(ShapeMesh, OfOctreesAreTheOccupiedCells) {
  const auto cells = std::make_shared<octomap::OcTree>(0.5);
  for (const float x : {0.1f, 0.6f, 3.1f}) cells->updateNode(octomap::point3d(x, 0.1f, 0.1f), true);
  cells->updateNode(octomap::point3d(1.1f, 0.1f, 0.1f), false);  // free
  const TriangleMesh mesh = shapeMesh(fcl::OcTreed(cells));
  EXPECT_EQ(mesh.vertices.size(), 3u * 8);
  EXPECT_TRUE(isClosed(mesh));
  EXPECT_NEAR(volumeOf(mesh), 3 * 0.125, 1e-12);
  EXPECT_LT((sizeOf(mesh) - fcl::Vector3d(3.5, 0.5, 0.5)).norm(), 1e-9);
}

TEST(ShapeMesh, RefusesWhatIsNoSurface) {
  EXPECT_THROW(shapeMesh(fcl::BVHModel<fcl::RSSd>()), std::invalid_argument);
  EXPECT_THROW(shapeMesh(fcl::Sphered(0)), std::invalid_argument);
  EXPECT_THROW(shapeMesh(fcl::Sphered(1), 0), std::invalid_argument);
  EXPECT_THROW(shapeMesh(fcl::Sphered(1), 1025), std::invalid_argument);
}

}  // namespace shape_mesh_test
}  // namespace adaptive_bvh_test
