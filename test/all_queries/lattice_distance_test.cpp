// Distances of meshes as CAD data has them, on lattices, with parallel edges, needles and slivers:
// all queries agree with each other and with every pair of triangles in quadruple precision.
#include <gtest/gtest.h>

#include <set>
#include <tuple>

#include "adaptive_bvh/coherent_distance.h"
#include "adaptive_bvh/point_query.h"
#include "adaptive_bvh/proximity.h"
#include "adaptive_bvh/query.h"
#include "adaptive_bvh/scene.h"
#include "support/degenerate_triangles.h"
#include "support/long_mode.h"
#include "support/quad_geometry.h"
#include "support/test_mesh.h"

namespace adaptive_bvh_test {
namespace lattice_distance_test {

using adaptive_bvh::CoherentDistance;
using adaptive_bvh::DeformableMesh;
using Triangle = DegenerateTriangles::Triangle;

class LatticeDistance : public testing::Test {
 protected:
  using Model = DeformableMesh;

  static void add(const Triangle& t, TriangleMesh& mesh) {
    const std::size_t first = mesh.vertices.size();
    for (const auto& p : t) mesh.vertices.push_back(p);
    mesh.triangles.emplace_back(first, first + 1, first + 2);
  }
  static quad::Triangle triangle(const Model& model, int t) {
    const fcl::Triangle& v = model.triangles()[t];
    return {quad::of(model.vertices()[v[0]]), quad::of(model.vertices()[v[1]]),
            quad::of(model.vertices()[v[2]])};
  }
  static double extentOf(const Model& a, const Model& b) {
    double extent = 0;
    for (const Model* model : {&a, &b})
      for (int i = 0; i < numVertices(*model); ++i)
        extent = std::max(extent, model->vertices()[i].template lpNorm<Eigen::Infinity>());
    return double(extent);
  }

  void check(const Model& a, const Model& b) {
    quad::Real least = 1e30;
    for (int i = 0; i < numTriangles(a); ++i)
      for (int j = 0; j < numTriangles(b); ++j)
        least = std::min(least, quad::distance(triangle(a, i), triangle(b, j)));
    const auto expected = static_cast<double>(least);
    const double tolerance = 64 * double(std::numeric_limits<double>::epsilon()) * extentOf(a, b);
    fcl::DistanceResultd recorded, coherent;
    adaptive_bvh::distance(&a, still_, &b, still_, fcl::DistanceRequestd(true), recorded);
    ASSERT_NEAR(expected, double(recorded.min_distance), tolerance);
    ASSERT_NEAR(expected, double((recorded.nearest_points[0] - recorded.nearest_points[1]).norm()),
                tolerance);
    CoherentDistance pair(a, b);
    pair.distance(still_, still_, fcl::DistanceRequestd(), coherent);
    ASSERT_NEAR(expected, double(coherent.min_distance), tolerance);
    ASSERT_TRUE(isNearer(a, still_, b, still_, double(expected + 2 * tolerance)));
    if (expected > 2 * tolerance) {
      ASSERT_FALSE(isNearer(a, still_, b, still_, double(expected - 2 * tolerance)));
    }
    adaptive_bvh::ProximityRequest request;
    request.distance = double(expected + 2 * tolerance);
    adaptive_bvh::TrianglePairs pairs;
    ASSERT_GT(pairsWithin(a, still_, b, still_, request, pairs), 0u);
    touching_ += expected == 0;
    checkAgreement(a, b);
  }

  using Pairs = std::set<std::pair<unsigned, unsigned>>;

  /// All queries agree about every pair of triangles, also where rounding decides that they touch.
  void checkAgreement(const Model& a, const Model& b) {
    fcl::Transform3d tf = still_;
    if (triangles_.random().oneIn(2)) tf = triangles_.random().pose(1);
    adaptive_bvh::ProximityRequest request;
    request.enable_distances = true;
    adaptive_bvh::TrianglePairs near;
    pairsWithin(a, tf, b, still_, request, near);
    Pairs within, contacts;
    for (std::size_t i = 0; i < near.size(); ++i) {
      ASSERT_EQ(0, near.distances[i]);
      within.emplace(near.triangles[i].first, near.triangles[i].second);
    }
    fcl::CollisionResultd result;
    adaptive_bvh::collide(&a, tf, &b, still_, fcl::CollisionRequestd(1000, false), result);
    for (std::size_t i = 0; i < result.numContacts(); ++i)
      contacts.emplace(unsigned(result.getContact(i).b1), unsigned(result.getContact(i).b2));
    ASSERT_EQ(within, contacts);
    fcl::DistanceResultd distance;
    ASSERT_EQ(!contacts.empty(),
              adaptive_bvh::distance(&a, tf, &b, still_, fcl::DistanceRequestd(), distance) == 0);
    ASSERT_EQ(!contacts.empty(), isNearer(a, tf, b, still_, 0.));
  }

  const fcl::Transform3d still_ = fcl::Transform3d::Identity();
  DegenerateTriangles triangles_{2024};
  int touching_ = 0;
};

TEST_F(LatticeDistance, AllQueriesAgreeWithQuadruplePrecision) {
  const int rounds = manySteps(2000);
  for (int round = 0; round < rounds && !testing::Test::HasFailure(); ++round) {
    TriangleMesh first, second;
    for (int i = round % 4; i >= 0; --i) {
      const auto pair = this->triangles_.pair();
      this->add(pair.first, first);
      this->add(pair.second, second);
    }
    const Model a(first), b(second);
    this->check(a, b);
  }
  EXPECT_GT(this->touching_, rounds / 50);
}

/// Two rectangles whose nearest points are on parallel edges.
TEST_F(LatticeDistance, OfTwoRectangles) {
  TriangleMesh first, second;
  first.vertices = {{0.6, -1.2, 1.9}, {3.3, -1.2, 1.9}, {3.3, -1.2, -0.6}, {0.6, -1.2, -0.6}};
  second.vertices = {{2.1, 1.8, -0.2}, {2.1, 0.1, -0.2}, {0.2, 0.1, -0.2}, {0.2, 1.8, -0.2}};
  first.triangles = second.triangles = {{0, 1, 2}, {0, 2, 3}};
  const Model a(first), b(second);
  this->check(a, b);
  fcl::DistanceResultd result;
  adaptive_bvh::distance(&a, this->still_, &b, this->still_, fcl::DistanceRequestd(), result);
  EXPECT_FLOAT_EQ(1.3f, float(result.min_distance));
}

/// Narrow triangles: a point that lies in one, and two that cross.
TEST(Needles, TouchWhereTheyTouch) {
  using Model = DeformableMesh;
  const double e = 0x1p-26;
  TriangleMesh needle, point, p, q;
  needle.vertices = {{0, 0, 0}, {6, 5, 4}, {6, 5 + e, 4 - e}};
  point.vertices.assign(3, {4.5 - e, 3.75 - e / 2, 3 - e});
  p.vertices = {{3722.8, -1630.09, -3376.6}, {-.59, -.06, .47}, {-.72, -.68, .96}};
  q.vertices = {{-.69, 1, -.68}, {3722.75, -1630.11, -3376.49}, {3722.47, -1629.96, -3376.53}};
  for (auto* mesh : {&needle, &point, &p, &q}) mesh->triangles = {{0, 1, 2}};
  const fcl::Transform3d still = fcl::Transform3d::Identity();
  for (const auto& [first, second, error] :
       {std::tuple{&needle, &point, 3e-14}, std::tuple{&p, &q, 0.}}) {
    const Model a(*first), b(*second);
    fcl::DistanceResultd distance;
    EXPECT_NEAR(0, adaptive_bvh::distance(&a, still, &b, still, fcl::DistanceRequestd(), distance),
                error);
    EXPECT_TRUE(isNearer(a, still, b, still, std::max(error, 1e-9)));
    adaptive_bvh::ProximityRequest request;
    request.distance = error;
    adaptive_bvh::TrianglePairs pairs;
    EXPECT_EQ(1u, pairsWithin(a, still, b, still, request, pairs));
  }
  const Model model(needle), at_point(point);
  EXPECT_NEAR(0, adaptive_bvh::closestPoint(model, point.vertices[0]).distance, 3e-14);
  std::vector<double> clearances;
  adaptive_bvh::vertexDistances(at_point, still, model, still, 1., clearances);
  EXPECT_NEAR(0, clearances.at(0), 3e-14);
}

/// A grid of squares in the plane z = 0.
TriangleMesh grid(int squares, double x, double y, double side) {
  TriangleMesh mesh;
  const auto at = [&](int i, int j) { return std::size_t(i * (squares + 1) + j); };
  for (int i = 0; i <= squares; ++i)
    for (int j = 0; j <= squares; ++j) mesh.vertices.emplace_back(x + j * side, y + i * side, 0);
  for (int i = 0; i < squares; ++i)
    for (int j = 0; j < squares; ++j) {
      mesh.triangles.emplace_back(at(i, j), at(i, j + 1), at(i + 1, j + 1));
      mesh.triangles.emplace_back(at(i, j), at(i + 1, j + 1), at(i + 1, j));
    }
  return mesh;
}

/// Sheets that overlap in a plane, which is turned: a pair of triangles has the rounded distance 0
/// without a common point before one that touches is found.
TEST(CoplanarSheets, HaveTheDistanceZeroWhereTheyTouch) {
  const double side = 0x1.74c9e9c34c5cep-2;
  const DeformableMesh a(grid(1, 0, 0, side)),
      b(grid(2, -0x1.00021a0858914p-3, -0x1.206e88d9ecfap-2, 0.5));
  fcl::Transform3d tf = fcl::Transform3d::Identity();
  tf.linear() << 0x1.d0ff5b715e4adp-1, -0x1.f60ab93ebff3ep-3, -0x1.5b61a264c92cdp-2,
      0x1.9483766b4fb7fp-2, 0x1.8a2c041fa3edap-1, 0x1.00a4231777448p-1, 0x1.1b39afd808944p-3,
      -0x1.2db1ce6076bc8p-1, 0x1.979126cfc7bf9p-1;
  tf.translation() << 0x1.37f8d450667ap-6, -0x1.56dadd131191ep-2, 0x1.b7b66fa1b5afep-2;
  ASSERT_TRUE(isNearer(a, tf, b, tf, 0.));
  for (const auto& [first, second] : {std::pair{&a, &b}, std::pair{&b, &a}}) {
    adaptive_bvh::Scene scene;
    const adaptive_bvh::BodyId body = scene.add(*first, tf);
    scene.add(*second, tf);
    scene.update();
    EXPECT_EQ(0, scene.nearest(body).distance);
  }
}

}  // namespace lattice_distance_test
}  // namespace adaptive_bvh_test
