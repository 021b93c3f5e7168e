// Neighbourhoods along a surface, and least distances of a mesh to itself, against all pairs.
#include "adaptive_bvh/surface_neighbourhood.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <ctime>

#include "adaptive_bvh/contact_set.h"
#include "adaptive_bvh/motion_clearance.h"
#include "adaptive_bvh/proximity.h"
#include "adaptive_bvh/self_collision.h"
#include "support/meshes.h"
#include "support/quad_geometry.h"
#include "support/random_geometry.h"

namespace adaptive_bvh_test {
namespace surface_neighbourhood_test {

using adaptive_bvh::DeformableMesh;
using adaptive_bvh::FeaturePair;
using adaptive_bvh::LabelRule;
using adaptive_bvh::Motion;
using adaptive_bvh::MotionClearance;
using adaptive_bvh::MotionInterval;
using adaptive_bvh::selfLeastDistance;
using adaptive_bvh::SurfaceNeighbourhood;
using P = fcl::Vector3d;
using Matrix = std::vector<std::vector<double>>;

TriangleMesh weldedTube(int around, int along) {
  TriangleMesh mesh = tube(around, along);
  adaptive_bvh::weldVertices(mesh, 1e-9);
  return mesh;
}

/// The lengths of the shortest paths between all vertices (Floyd and Warshall).
Matrix pathsOf(const TriangleMesh& mesh, bool count_steps) {
  const std::size_t n = mesh.vertices.size();
  Matrix paths(n, std::vector<double>(n, HUGE_VAL));
  for (std::size_t v = 0; v < n; ++v) paths[v][v] = 0;
  for (const fcl::Triangle& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) {
      const std::size_t a = t[k], b = t[(k + 1) % 3];
      paths[a][b] = paths[b][a] = count_steps ? 1 : (mesh.vertices[a] - mesh.vertices[b]).norm();
    }
  for (std::size_t m = 0; m < n; ++m)
    for (std::size_t a = 0; a < n; ++a)
      for (std::size_t b = 0; b < n; ++b)
        paths[a][b] = std::min(paths[a][b], paths[a][m] + paths[m][b]);
  return paths;
}
double pathBetween(const TriangleMesh& mesh, const Matrix& paths, unsigned i, unsigned j) {
  double least = HUGE_VAL;
  for (int k = 0; k < 3; ++k)
    for (int l = 0; l < 3; ++l)
      least = std::min(least, paths[mesh.triangles[i][k]][mesh.triangles[j][l]]);
  return least;
}

template <typename Expected>
void expectPairs(const TriangleMesh& mesh, const SurfaceNeighbourhood& found,
                 const Expected& expected) {
  for (unsigned i = 0; i < mesh.triangles.size(); ++i)
    for (unsigned j = 0; j < mesh.triangles.size(); ++j)
      ASSERT_EQ(found.contains(i, j), expected(i, j)) << i << " and " << j;
}

TEST(SurfaceNeighbourhood, HasTheTrianglesWithinAPath) {
  const TriangleMesh mesh = weldedTube(6, 12);
  const DeformableMesh tree(mesh.vertices, mesh.triangles);
  const Matrix lengths = pathsOf(mesh, false), steps = pathsOf(mesh, true);
  for (const double distance : {0., 0.17, 0.4, 10.})
    expectPairs(mesh, SurfaceNeighbourhood::byDistance(tree, distance),
                [&](auto i, auto j) { return pathBetween(mesh, lengths, i, j) <= distance; });
  for (const unsigned rings : {0u, 1u, 2u, 4u})
    expectPairs(mesh, SurfaceNeighbourhood::byRings(tree, rings), [&](auto i, auto j) {
      return pathBetween(mesh, steps, i, j) <= std::max(rings, 1u) - 1;
    });
  expectPairs(mesh, SurfaceNeighbourhood(tree),
              [&](auto i, auto j) { return pathBetween(mesh, steps, i, j) == 0; });
}

/// The least processor time of a triangle's neighbours, of three runs.
double timeOfTriangle(int side) {
  const DeformableMesh mesh(plate(side, side));
  double least = HUGE_VAL;
  for (int run = 0; run < 3; ++run) {
    const std::clock_t begin = std::clock();
    EXPECT_TRUE(SurfaceNeighbourhood(mesh).contains(0, 0));
    least = std::min(least, double(std::clock() - begin));
  }
  return least / double(mesh.triangles().size());
}

/// Nine times as many triangles take about nine times as long.
TEST(SurfaceNeighbourhood, TakesTimeByTheNeighboursOfEachTriangle) {
  EXPECT_LT(timeOfTriangle(300), 2.5 * timeOfTriangle(100));
}

TEST(SurfaceNeighbourhood, HasTheLabelsThatDoNotCount) {
  const TriangleMesh mesh = weldedTube(6, 12);
  const DeformableMesh tree(mesh.vertices, mesh.triangles);
  const Matrix steps = pathsOf(mesh, true);
  RandomGeometry random(1);
  for (const bool is_random : {false, true}) {
    std::vector<unsigned> labels;
    for (unsigned i = 0; i < mesh.triangles.size(); ++i)
      labels.push_back(is_random ? unsigned(random.below(3)) : i / 40);
    for (const LabelRule rule : {LabelRule::Within, LabelRule::Between})
      expectPairs(mesh, SurfaceNeighbourhood::byLabels(tree, labels, rule), [&](auto i, auto j) {
        return (labels[i] == labels[j]) == (rule == LabelRule::Between) ||
               pathBetween(mesh, steps, i, j) == 0;
      });
  }
}

/// A tube whose vertices are moved at random: it meets itself.
TriangleMesh crumpledTube(RandomGeometry& random) {
  TriangleMesh mesh = weldedTube(6, 12);
  for (P& x : mesh.vertices) x += 0.4 * random.point();
  return mesh;
}

/// The triangle of a vertex with the smallest index.
unsigned triangleOf(const TriangleMesh& mesh, unsigned vertex) {
  for (unsigned t = 0;; ++t)
    for (int k = 0; k < 3; ++k)
      if (mesh.triangles[t][k] == vertex) return t;
}

/// The pairs whose triangles, of(pair), the neighbourhood does not contain.
template <typename Of>
std::vector<FeaturePair> without(const std::vector<FeaturePair>& all,
                                 const SurfaceNeighbourhood& surface, const Of& of) {
  std::vector<FeaturePair> rest;
  for (const FeaturePair& pair : all) {
    const FeaturePair triangles = of(pair);
    if (!surface.contains(triangles.first, triangles.second)) rest.push_back(pair);
  }
  return rest;
}

std::vector<FeaturePair> sorted(std::vector<FeaturePair> pairs) {
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

/// All queries of a mesh with itself leave out the same pairs.
TEST(SurfaceNeighbourhood, IsLeftOutOfAllQueriesOfPairs) {
  RandomGeometry random(3);
  for (int round = 0; round < 12; ++round) {
    const TriangleMesh mesh = crumpledTube(random);
    const DeformableMesh tree(mesh.vertices, mesh.triangles);
    std::vector<unsigned> labels;
    for (unsigned i = 0; i < mesh.triangles.size(); ++i)
      labels.push_back(unsigned(random.below(3)));
    const SurfaceNeighbourhood surface =
        round % 3 == 0   ? SurfaceNeighbourhood::byRings(tree, 3)
        : round % 3 == 1 ? SurfaceNeighbourhood::byDistance(tree, 0.7)
                         : SurfaceNeighbourhood::byLabels(tree, labels, LabelRule(random.below(2)));
    const auto same = [](const FeaturePair& pair) { return pair; };
    adaptive_bvh::ProximityRequest request{0.15};
    adaptive_bvh::TrianglePairs all, found;
    selfPairsWithin(tree, request, all);
    request.ignored.surface = &surface;
    selfPairsWithin(tree, request, found);
    const std::vector<FeaturePair> rest = without(all.triangles, surface, same);
    EXPECT_EQ(rest, found.triangles);
    EXPECT_GT(rest.size(), 20u);
    EXPECT_LT(rest.size(), all.size());

    const adaptive_bvh::ContactSetRequest kept{0.15, {}, request.ignored};
    adaptive_bvh::ContactSet set(tree, kept);
    set.update();
    EXPECT_EQ(sorted(rest), sorted(set.triangles().pairs));

    fcl::CollisionResultd contacts;
    selfCollide(tree, request.ignored, fcl::CollisionRequestd(100000), contacts);
    EXPECT_GT(contacts.numContacts(), 5u);
    for (std::size_t i = 0; i < contacts.numContacts(); ++i)
      EXPECT_FALSE(surface.contains(unsigned(contacts.getContact(i).b1),
                                    unsigned(contacts.getContact(i).b2)));

    if (round % 3 == 2) continue;  // scene_test has labels of features
    adaptive_bvh::FeatureProximityRequest of_features{0.15, {}};
    adaptive_bvh::FeaturePairs every, some;
    selfFeaturePairsWithin(tree, of_features, every);
    of_features.ignored.surface = &surface;
    selfFeaturePairsWithin(tree, of_features, some);
    EXPECT_EQ(without(every.vertex_face, surface,
                      [&](const FeaturePair& pair) {
                        return FeaturePair{triangleOf(mesh, pair.first), pair.second};
                      }),
              some.vertex_face);
    EXPECT_EQ(without(every.edge_edge, surface,
                      [](const FeaturePair& pair) {
                        return FeaturePair{pair.first / 3, pair.second / 3};
                      }),
              some.edge_edge);
    EXPECT_LT(some.size(), every.size());
  }
}

/// The least distance of all pairs that count, at one time.
double distanceOfAll(const TriangleMesh& mesh, const std::vector<P>& positions,
                     const SurfaceNeighbourhood& left_out) {
  quad::Real least = 1e9;
  const auto triangle = [&](unsigned i) -> quad::Triangle {
    const fcl::Triangle& t = mesh.triangles[i];
    return {quad::of(positions[t[0]]), quad::of(positions[t[1]]), quad::of(positions[t[2]])};
  };
  const auto isFar = [&](unsigned i, unsigned j) {  // farther than the least distance so far
    const fcl::Triangle &a = mesh.triangles[i], &b = mesh.triangles[j];
    const P &x = positions[a[0]], &y = positions[b[0]];
    const auto radius = [&](const fcl::Triangle& t, const P& from) {
      return std::max((positions[t[1]] - from).norm(), (positions[t[2]] - from).norm());
    };
    return (x - y).norm() - radius(a, x) - radius(b, y) > static_cast<double>(least) * 1.0001;
  };
  for (unsigned i = 0; i < mesh.triangles.size(); ++i)
    for (unsigned j = i + 1; j < mesh.triangles.size(); ++j)
      if (!left_out.contains(i, j) && !isFar(i, j))
        least = std::min(least, quad::distance(triangle(i), triangle(j)));
  return static_cast<double>(least);
}

TEST(SelfClearance, IsThatOfAllPairs) {
  const TriangleMesh mesh = weldedTube(5, 14);
  const DeformableMesh tree(mesh.vertices, mesh.triangles);
  std::vector<P> end = mesh.vertices;  // bent to a loop
  for (P& x : end) {
    const double angle = 2.5 * x[0];
    x = P((0.5 + x[1]) * std::sin(angle), (0.5 + x[1]) * std::cos(angle), x[2] + 0.2 * angle);
  }
  for (const double distance : {0., 0.35, 0.8}) {
    const auto left_out = SurfaceNeighbourhood::byDistance(tree, distance);
    adaptive_bvh::Ignored ignored;
    ignored.surface = &left_out;
    const double tolerance = 1e-4;
    const MotionClearance still = selfLeastDistance(tree, ignored, tolerance);
    const double exact = distanceOfAll(mesh, mesh.vertices, left_out);
    EXPECT_LE(still.lower, exact + 1e-12);
    EXPECT_GE(still.upper, exact - 1e-12);
    EXPECT_FALSE(left_out.contains(unsigned(still.elements[0]), unsigned(still.elements[1])));
    const MotionClearance over =
        selfLeastDistance(Motion(tree, mesh.vertices, end), ignored, tolerance);
    EXPECT_LE(over.upper - over.lower, tolerance * 1.0001);
    for (int i = 0; i <= 6; ++i) {
      std::vector<P> now;
      for (std::size_t v = 0; v < end.size(); ++v)
        now.push_back((1 - i / 6.) * mesh.vertices[v] + i / 6. * end[v]);
      EXPECT_LE(over.lower, distanceOfAll(mesh, now, left_out) + 1e-12);
    }
    std::vector<P> then;
    for (std::size_t v = 0; v < end.size(); ++v)
      then.push_back((1 - over.time) * mesh.vertices[v] + over.time * end[v]);
    EXPECT_NEAR(over.upper, distanceOfAll(mesh, then, left_out), over.meet() ? 1e-9 : 1e-12);
    std::vector<MotionInterval> intervals;
    adaptive_bvh::selfIntervalsBelow(Motion(tree, mesh.vertices, end), ignored, over.lower, 1e-4,
                                     intervals);
    for (const MotionInterval& interval : intervals) EXPECT_LE(interval.begin, interval.end);
  }
}

TEST(SelfClearance, LeavesOutIgnoredPairsAndOtherMeshes) {
  const TriangleMesh mesh = weldedTube(5, 6);
  const DeformableMesh tree(mesh.vertices, mesh.triangles);
  const SurfaceNeighbourhood left_out(tree);
  adaptive_bvh::Ignored ignored;
  const MotionClearance by_vertices = selfLeastDistance(tree, ignored, 1e-4);
  ignored.surface = &left_out;
  const MotionClearance first = selfLeastDistance(tree, ignored, 1e-4);
  EXPECT_EQ(first.upper, by_vertices.upper);
  ASSERT_TRUE(first.exists());
  const std::vector<adaptive_bvh::FeaturePair> list = {
      {unsigned(first.elements[0]), unsigned(first.elements[1])}};
  ignored.triangles.list = &list;
  const MotionClearance next = selfLeastDistance(tree, ignored, 1e-4);
  EXPECT_NE(first.elements, next.elements);
  ignored.triangles = {};
  ignored.triangles.test = [](unsigned, unsigned) { return true; };
  EXPECT_FALSE(selfLeastDistance(tree, ignored, 1e-4).exists());
  ignored.triangles = {};
  const DeformableMesh copy(tree), other(mesh.vertices, mesh.triangles);
  EXPECT_EQ(selfLeastDistance(copy, ignored, 1e-4).upper, first.upper);
  EXPECT_THROW(selfLeastDistance(other, ignored, 1e-4), std::invalid_argument);
  fcl::CollisionResultd contacts;
  EXPECT_THROW(selfCollide(other, ignored, fcl::CollisionRequestd(), contacts),
               std::invalid_argument);
  ignored.neighbours = adaptive_bvh::NeighbourFilter::None;
  EXPECT_THROW(selfLeastDistance(tree, ignored, 1e-4), std::invalid_argument);
  EXPECT_THROW(SurfaceNeighbourhood::byDistance(tree, -1), std::invalid_argument);
  EXPECT_THROW(SurfaceNeighbourhood::byLabels(tree, {1, 2}, LabelRule::Within),
               std::invalid_argument);
  EXPECT_THROW(left_out.contains(0, 1000), std::invalid_argument);
  EXPECT_GT(left_out.bytes(), 0u);
}

}  // namespace surface_neighbourhood_test
}  // namespace adaptive_bvh_test
