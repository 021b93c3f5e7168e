// Ties and touches on a lattice, where both are exact: which triangle is nearest of several that
// are as near, and which features have a common point. Judged in quadruple precision.
#include <gtest/gtest.h>

#include "adaptive_bvh/penetration.h"
#include "adaptive_bvh/point_query.h"
#include "adaptive_bvh/proximity.h"
#include "adaptive_bvh/self_collision.h"
#include "support/lattice_features.h"
#include "support/random_geometry.h"
#include "support/test_mesh.h"

namespace adaptive_bvh_test {
namespace lattice_feature_test {

using adaptive_bvh::DeformableMesh;
using adaptive_bvh::FeaturePair;
using adaptive_bvh::FeaturePairs;

class LatticeFeature : public testing::Test {
 protected:
  using Mesh = DeformableMesh;
  using Points = std::vector<fcl::Vector3d>;

  static quad::Triangle triangle(const TriangleMesh& mesh, std::size_t t) {
    const auto& v = mesh.triangles[t];
    return {quad::of(mesh.vertices[v[0]]), quad::of(mesh.vertices[v[1]]),
            quad::of(mesh.vertices[v[2]])};
  }
  /// The first of all triangles that are as near, up to what quadruple precision rounds.
  static int nearest(const TriangleMesh& mesh, const fcl::Vector3d& x) {
    int best = -1;
    quad::Real least = 0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      const quad::Real square = quad::squaredDistance(quad::of(x), triangle(mesh, t));
      if (best >= 0 && square >= least * (1 - quad::Real(1e-28)) - quad::Real(1e-50)) continue;
      least = square;
      best = int(t);
    }
    return best;
  }
  static TriangleMesh octahedron() {
    TriangleMesh mesh;
    mesh.vertices = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                      {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    return mesh;
  }
  /// Each triangle becomes four, with the new corners in the middles of its sides.
  static TriangleMesh refined(const TriangleMesh& mesh) {
    TriangleMesh fine;
    std::map<std::pair<std::size_t, std::size_t>, std::size_t> middles;
    fine.vertices = mesh.vertices;
    const auto middle = [&](std::size_t a, std::size_t b) {
      const auto [at, is_new] = middles.insert({std::minmax(a, b), fine.vertices.size()});
      if (is_new) fine.vertices.push_back((mesh.vertices[a] + mesh.vertices[b]) / 2);
      return at->second;
    };
    for (const fcl::Triangle& t : mesh.triangles) {
      const std::size_t a = middle(t[0], t[1]), b = middle(t[1], t[2]), c = middle(t[2], t[0]);
      for (const fcl::Triangle& part :
           {fcl::Triangle(t[0], a, c), {a, t[1], b}, {c, b, t[2]}, {a, b, c}})
        fine.triangles.push_back(part);
    }
    return fine;
  }
  /// Points of the lattice, and of finer ones.
  Points pointsOfLattice(int count) {
    Points points;
    for (int i = 0; i < count; ++i) {
      const double step = 1. / double(1 << random_.below(4));
      points.push_back(step * fcl::Vector3d(double(random_.below(33) - 16),
                                            double(random_.below(33) - 16),
                                            double(random_.below(33) - 16)));
    }
    return points;
  }
  /// In every order of the points, with and without a limit.
  void expectNearest(const TriangleMesh& mesh, Points points) {
    const Mesh body(mesh);
    std::vector<adaptive_bvh::ClosestPoint> closest;
    std::vector<adaptive_bvh::ClosestFeature> features;
    for (int order = 0; order < 3; ++order) {
      std::shuffle(points.begin(), points.end(), random_.engine());
      closestPoints(body, points, closest);
      closestFeatures(body, points, 1e6, features);
      for (std::size_t i = 0; i < points.size(); ++i) {
        const int expected = nearest(mesh, points[i]);
        ASSERT_EQ(expected, closest[i].triangle) << points[i].transpose();
        ASSERT_EQ(expected, features[i].triangle) << points[i].transpose();
        ASSERT_EQ(expected, closestPoint(body, points[i]).triangle) << points[i].transpose();
      }
    }
  }
  TriangleMesh shuffled(TriangleMesh mesh) {
    std::shuffle(mesh.triangles.begin(), mesh.triangles.end(), random_.engine());
    for (fcl::Triangle& t : mesh.triangles)
      for (int turns = random_.below(3); turns > 0; --turns) t = {t[1], t[2], t[0]};
    return mesh;
  }

  RandomGeometry random_{92};
};

TEST_F(LatticeFeature, NearestTriangleOfAnOctahedronHasTheSmallestIndex) {
  const DeformableMesh mesh(this->octahedron());
  EXPECT_EQ(4, closestPoint(mesh, fcl::Vector3d(0.1, 0.4, -1.5)).triangle);
  EXPECT_EQ(0, closestPoint(mesh, fcl::Vector3d(0, 0, 0)).triangle);
}

TEST_F(LatticeFeature, NearestTriangleHasTheSmallestIndex) {
  for (int body = 0; body < manySteps(4); ++body) {
    TriangleMesh mesh = this->octahedron();
    for (int level = this->random_.below(3); level > 0; --level) mesh = this->refined(mesh);
    for (fcl::Vector3d& p : mesh.vertices) p *= 8;
    this->expectNearest(this->shuffled(mesh), this->pointsOfLattice(60));
    this->expectNearest(this->shuffled(plate(6, 5, 6, 5)), this->pointsOfLattice(60));
    // Vertices that coincide without being the same.
    TriangleMesh soup;
    for (const fcl::Triangle& t : mesh.triangles)
      for (int k = 0; k < 3; ++k) soup.vertices.push_back(mesh.vertices[t[k]]);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
      soup.triangles.emplace_back(3 * t, 3 * t + 1, 3 * t + 2);
    this->expectNearest(this->shuffled(soup), this->pointsOfLattice(30));
  }
}

/// On a ball no coordinates are whole, but triangles around a vertex or beside an edge still are
/// exactly as near.
TEST_F(LatticeFeature, NearestTriangleAroundAVertexHasTheSmallestIndex) {
  for (int body = 0; body < manySteps(1); ++body) {
    TriangleMesh mesh = this->refined(this->refined(this->octahedron()));
    for (fcl::Vector3d& p : mesh.vertices) p = (p + 0.1 * this->random_.point()).normalized();
    std::vector<fcl::Vector3d> points;
    for (const fcl::Vector3d& p : mesh.vertices) {
      points.push_back(this->random_.uniform(1, 3) * p);
      points.push_back(p);
      points.push_back(3 * this->random_.point());
    }
    this->expectNearest(this->shuffled(mesh), points);
  }
}

TEST_F(LatticeFeature, VertexContactsNameTheSmallestIndex) {
  const fcl::Transform3d still = fcl::Transform3d::Identity();
  for (int body = 0; body < manySteps(10); ++body) {
    TriangleMesh mesh = this->shuffled(this->refined(this->octahedron())), other = mesh;
    for (fcl::Vector3d& p : mesh.vertices)
      p = 8 * p + fcl::Vector3d(double(this->random_.below(9)), double(this->random_.below(9)), 3);
    for (fcl::Vector3d& p : other.vertices) p *= 8;
    adaptive_bvh::VertexContacts contacts;
    vertexContacts(DeformableMesh(mesh), still, DeformableMesh(other), still, 1e3, contacts);
    ASSERT_EQ(mesh.vertices.size(), contacts.size());
    for (std::size_t i = 0; i < contacts.size(); ++i)
      EXPECT_EQ(this->nearest(other, mesh.vertices[contacts.vertices[i]]), contacts.triangles[i]);
  }
}

class LatticeTouch : public LatticeFeature {
 protected:
  /// A few triangles that share vertices, or are segments or points; whole numbers below `size`.
  TriangleMesh soupOf(int vertices, int triangles, int size) {
    TriangleMesh mesh;
    for (int v = 0; v < vertices; ++v)
      mesh.vertices.emplace_back(random_.below(size), random_.below(size), random_.below(size));
    const auto corner = [&] { return std::size_t(random_.below(vertices)); };
    while (int(mesh.triangles.size()) < triangles) {
      const std::size_t a = corner(), b = corner(), c = corner();
      if (a != b && b != c && c != a) mesh.triangles.emplace_back(a, b, c);
    }
    return mesh;
  }
};

TEST_F(LatticeTouch, FeaturePairsWithinZeroAreExact) {
  const fcl::Transform3d still = fcl::Transform3d::Identity();
  std::size_t touching = 0;
  for (int round = 0; round < manySteps(400); ++round) {
    const int size = 2 + random_.below(30), limit = random_.oneIn(2) ? 0 : random_.below(3);
    const auto first = soupOf(5, 3, size), second = soupOf(5, 3, size);
    FeaturePairs found;
    const std::size_t count =
        featurePairsWithin(Mesh(first), still, Mesh(second), still, double(limit), found);
    const FeatureSet expected = featurePairs(first, second, limit);
    ASSERT_EQ(expected, featurePairs(found, first, second));
    ASSERT_EQ(count, found.size());
    touching += limit == 0 ? expected.size() : 0;
    selfFeaturePairsWithin(Mesh(first), double(limit), found);
    ASSERT_EQ(featurePairs(first, first, limit, true), featurePairs(found, first, first, true));
  }
  EXPECT_GT(touching, 300u);
}

/// A flat cloth is left out as a whole: that changes no result.
TEST_F(LatticeTouch, PairsOfAFlatClothAreThoseOfAllFeatures) {
  std::size_t near = 0;
  for (int round = 0; round < manySteps(20); ++round) {
    const int columns = 2 + random_.below(5), rows = 2 + random_.below(5), step = 6;
    auto cloth = plate(columns, rows, columns * step, rows * step);
    for (fcl::Vector3d& p : cloth.vertices) {
      p = p.unaryExpr([](double x) { return std::round(x); });
      if (!random_.oneIn(3)) continue;
      p += fcl::Vector3d(random_.below(5) - 2, random_.below(5) - 2, random_.below(3) - 1);
    }
    const int limit = random_.below(5);
    FeaturePairs found;
    selfFeaturePairsWithin(Mesh(cloth), double(limit), found);
    const FeatureSet expected = featurePairs(cloth, cloth, limit, true);
    ASSERT_EQ(expected, featurePairs(found, cloth, cloth, true)) << limit;
    near += expected.size();
    adaptive_bvh::ProximityRequest request;
    request.distance = limit;
    adaptive_bvh::TrianglePairs pairs;
    selfPairsWithin(Mesh(cloth), request, pairs);
    std::size_t count = 0;
    for (std::size_t s = 0; s < cloth.triangles.size(); ++s)
      for (std::size_t t = s + 1; t < cloth.triangles.size(); ++t) {
        bool are_neighbours = false;
        for (int i = 0; i < 9; ++i)
          are_neighbours |= cloth.triangles[s][i / 3] == cloth.triangles[t][i % 3];
        count += !are_neighbours && quad::distance(triangle(cloth, s), triangle(cloth, t)) <=
                                        quad::Real(limit) + quad::Real(1e-12);
      }
    ASSERT_EQ(count, pairs.size()) << limit;
  }
  EXPECT_GT(near, 100u);
}

TEST_F(LatticeTouch, IgnoredPairsOfOneMeshHaveTheSmallerNumberFirst) {
  const Mesh mesh(octahedron());
  const std::vector<FeaturePair> swapped = {{7, 2}}, right = {{2, 7}};
  FeaturePairs features;
  adaptive_bvh::TrianglePairs triangles;
  adaptive_bvh::FeatureProximityRequest of_features;
  adaptive_bvh::ProximityRequest of_triangles;
  fcl::CollisionResultd contacts;
  for (const bool is_right : {true, false}) {
    adaptive_bvh::Ignored ignored;
    ignored.edge_edge.list = ignored.triangles.list = is_right ? &right : &swapped;
    of_features.ignored = of_triangles.ignored = ignored;
    const auto expect = [&](const auto& call) {
      if (is_right)
        EXPECT_NO_THROW(call());
      else
        EXPECT_THROW(call(), std::invalid_argument);
    };
    expect([&] { selfFeaturePairsWithin(mesh, of_features, features); });
    expect([&] { selfPairsWithin(mesh, of_triangles, triangles); });
    expect([&] { selfCollide(mesh, ignored, fcl::CollisionRequestd(), contacts); });
  }
  // Of two meshes any order has a meaning.
  of_features.ignored.edge_edge.list = &swapped;
  const fcl::Transform3d still = fcl::Transform3d::Identity();
  EXPECT_NO_THROW(featurePairsWithin(mesh, still, mesh, still, of_features, features));
}

}  // namespace lattice_feature_test
}  // namespace adaptive_bvh_test
