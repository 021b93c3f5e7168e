// The data for clearance checks: parts are closed, the harness obeys its clamps and keeps its
// lengths, files hold what was written, and nothing is touched.
#include "harness.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "adaptive_bvh/deformable_mesh.h"
#include "adaptive_bvh/mesh_io.h"
#include "adaptive_bvh/query.h"
#include "bay.h"
#include "mesh_files.h"
#include "support/temporary_file.h"

namespace adaptive_bvh_test {
namespace harness_test {

using harness::ElasticRods;
using harness::Harness;
using harness::Part;
using harness::Point;
using harness::Surface;

double volume(const Surface& surface) {
  double sum = 0;
  for (const auto& [a, b, c] : surface.triangles)
    sum += surface.vertices[a].cross(surface.vertices[b]).dot(surface.vertices[c]) / 6;
  return sum;
}

/// Every edge is passed once in each direction.
bool isClosed(const Surface& surface) {
  std::map<std::pair<unsigned, unsigned>, int> passed;
  for (const auto& t : surface.triangles)
    for (std::size_t k = 0; k < 3; ++k) ++passed[{t[k], t[(k + 1) % 3]}];
  for (const auto& [edge, count] : passed)
    if (count != 1 || passed.count({edge.second, edge.first}) == 0) return false;
  return true;
}

adaptive_bvh::DeformableMesh meshOf(const Surface& surface) {
  std::vector<fcl::Triangle> triangles;
  for (const auto& [a, b, c] : surface.triangles) triangles.emplace_back(a, b, c);
  return adaptive_bvh::DeformableMesh(surface.vertices, triangles);
}

TEST(EngineBay, HasSomeSixtyClosedPartsInItsBox) {
  const harness::Parts parts = harness::engineBay();
  EXPECT_NEAR(60., double(parts.size()), 8.);
  std::set<std::string> names;
  for (const Part& part : parts) {
    EXPECT_TRUE(names.insert(part.name).second) << part.name;
    EXPECT_TRUE(isClosed(part.surface)) << part.name;
    EXPECT_GT(volume(part.surface), 0) << part.name;
    for (const Point& p : part.surface.vertices) {
      ASSERT_TRUE((p.array() >= 0).all()) << part.name;
      ASSERT_TRUE((p.array() <= Point(900, 600, 500).array()).all()) << part.name;
    }
  }
}

// A straight rod that is clamped at both ends sags by g l^4 / (384 b^2), b^2 its bending stiffness
// by mass per length.
TEST(ElasticRods, SagAsABeamDoes) {
  const int edges = 32;
  const double length = 320, gravity = 1000;
  const harness::RodMaterial material;
  ElasticRods rods(material);
  const auto along_x = harness::shortestTurn(Point::UnitZ(), Point::UnitX());
  rods.addNode(Point(0, 0, 0));
  for (int i = 0; i < edges; ++i) {
    rods.addNode(Point(length * (i + 1) / edges, 0, 0));
    rods.addEdge(std::size_t(i), std::size_t(i) + 1, i - 1, 5, along_x);
  }
  rods.clamp(0);
  rods.clamp(edges - 1);
  for (int i = 0; i < 10000; ++i) rods.step(5e-5, {0, 0, -gravity}, 80);
  const double span = length * (edges - 1) / edges;  // between the middles of the held edges
  const double sag = gravity * std::pow(span, 4) / (384 * material.bending * material.bending);
  EXPECT_NEAR(-sag, rods.positions()[edges / 2][2], 0.04 * sag);
}

TEST(Harness, KeepsItsLengthsAndTouchesNothing) {
  Harness harness(6000);
  std::vector<adaptive_bvh::DeformableMesh> parts;
  for (const Part& part : harness::engineBay()) parts.push_back(meshOf(part.surface));
  const Surface first = harness.surface();
  EXPECT_NEAR(6000., double(first.triangles.size()), 300.);
  EXPECT_TRUE(isClosed(first));
  adaptive_bvh::DeformableMesh mesh = meshOf(first);
  const auto at_rest = fcl::Transform3d::Identity();
  double largest_way = 0, least = 1e9;
  for (int frame = 0; frame < 60; ++frame) {
    harness.advance();
    ASSERT_EQ(first.triangles, harness.surface().triangles);
    EXPECT_LT(harness.rods().largestStrain(), 0.02);
    mesh.update(harness.surface().vertices);
    std::size_t still = 0;
    for (std::size_t v = 0; v < first.vertices.size(); ++v) {
      const double way = (harness.surface().vertices[v] - first.vertices[v]).norm();
      ASSERT_TRUE(std::isfinite(way));
      largest_way = std::max(largest_way, way);
      if (way == 0) ++still;
    }
    EXPECT_GT(still, 400u);  // connectors
    for (const auto& part : parts) {
      fcl::DistanceResultd result;
      least = std::min(least, adaptive_bvh::distance(&mesh, at_rest, &part, at_rest,
                                                     fcl::DistanceRequestd(), result));
    }
  }
  EXPECT_GT(largest_way, 3);
  EXPECT_LT(largest_way, 100);
  EXPECT_GT(least, 0.1);
}

TEST(Harness, MovesTheSameWayEachTime) {
  Harness one(4000), other(4000);
  for (int frame = 0; frame < 3; ++frame) {
    one.advance();
    other.advance();
  }
  EXPECT_EQ(one.surface().vertices, other.surface().vertices);
  EXPECT_THROW(Harness(3999), std::invalid_argument);
}

TEST(Harness, IsInItsFiles) {
  const Surface surface = Harness(4000).surface();
  const TemporaryFile ply("harness.ply"), stl("harness.stl");
  harness::writePly(surface, ply.path());
  harness::writeStl(surface, stl.path());
  adaptive_bvh::MeshLoadOptions as_written;
  as_written.weld = false;
  const auto mesh = adaptive_bvh::loadMesh(ply.path(), as_written);
  ASSERT_EQ(surface.vertices.size(), mesh.vertices.size());
  ASSERT_EQ(surface.triangles.size(), mesh.triangles.size());
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    ASSERT_EQ(surface.vertices[v].cast<float>().cast<double>(), mesh.vertices[v]);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k)
      ASSERT_EQ(surface.triangles[t][k], mesh.triangles[t][int(k)]);
  const auto welded = adaptive_bvh::loadMesh(stl.path());
  // The trunk and its last two branches share the middle of a cap.
  EXPECT_EQ(surface.vertices.size() - 2, welded.vertices.size());
  EXPECT_EQ(surface.triangles.size(), welded.triangles.size());
  EXPECT_THROW(harness::writePly(surface, testing::TempDir() + "no/such/folder.ply"),
               std::runtime_error);
}

}  // namespace harness_test
}  // namespace adaptive_bvh_test
