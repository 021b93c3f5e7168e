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

template <typename S>
class LatticeFeature : public testing::Test {
 protected:
  using Mesh = DeformableMesh<S>;
  using Points = std::vector<Vector3<S>>;

  static quad::Triangle triangle(const TriangleMesh<S>& mesh, std::size_t t) {
    const auto& v = mesh.triangles[t];
    return {quad::of(mesh.vertices[v[0]]), quad::of(mesh.vertices[v[1]]),
            quad::of(mesh.vertices[v[2]])};
  }
  /// The first of all triangles that are as near, up to what quadruple precision rounds.
  static int nearest(const TriangleMesh<S>& mesh, const Vector3<S>& x) {
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
  static TriangleMesh<S> octahedron() {
    TriangleMesh<S> mesh;
    mesh.vertices = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                      {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    return mesh;
  }
  /// Each triangle becomes four, with the new corners in the middles of its sides.
  static TriangleMesh<S> refined(const TriangleMesh<S>& mesh) {
    TriangleMesh<S> fine;
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
      const S step = S(1) / S(1 << random_.below(4));
      points.push_back(step * Vector3<S>(S(random_.below(33) - 16), S(random_.below(33) - 16),
                                         S(random_.below(33) - 16)));
    }
    return points;
  }
  /// In every order of the points, with and without a limit.
  void expectNearest(const TriangleMesh<S>& mesh, Points points) {
    const Mesh body(mesh);
    std::vector<adaptive_bvh::ClosestPoint<S>> closest;
    std::vector<adaptive_bvh::ClosestFeature<S>> features;
    for (int order = 0; order < 3; ++order) {
      std::shuffle(points.begin(), points.end(), random_.engine());
      closestPoints(body, points, closest);
      closestFeatures(body, points, S(1e6), features);
      for (std::size_t i = 0; i < points.size(); ++i) {
        const int expected = nearest(mesh, points[i]);
        ASSERT_EQ(expected, closest[i].triangle) << points[i].transpose();
        ASSERT_EQ(expected, features[i].triangle) << points[i].transpose();
        ASSERT_EQ(expected, closestPoint(body, points[i]).triangle) << points[i].transpose();
      }
    }
  }
  TriangleMesh<S> shuffled(TriangleMesh<S> mesh) {
    std::shuffle(mesh.triangles.begin(), mesh.triangles.end(), random_.engine());
    for (fcl::Triangle& t : mesh.triangles)
      for (int turns = random_.below(3); turns > 0; --turns) t = {t[1], t[2], t[0]};
    return mesh;
  }

  RandomGeometry<S> random_{92};
};

TYPED_TEST_SUITE(LatticeFeature, QueryScalars);

TYPED_TEST(LatticeFeature, NearestTriangleOfAnOctahedronHasTheSmallestIndex) {
  using S = TypeParam;
  const DeformableMesh<S> mesh(this->octahedron());
  EXPECT_EQ(4, closestPoint(mesh, Vector3<S>(S(0.1), S(0.4), S(-1.5))).triangle);
  EXPECT_EQ(0, closestPoint(mesh, Vector3<S>(0, 0, 0)).triangle);
}

TYPED_TEST(LatticeFeature, NearestTriangleHasTheSmallestIndex) {
  using S = TypeParam;
  for (int body = 0; body < manySteps(4); ++body) {
    TriangleMesh<S> mesh = this->octahedron();
    for (int level = this->random_.below(3); level > 0; --level) mesh = this->refined(mesh);
    for (Vector3<S>& p : mesh.vertices) p *= 8;
    this->expectNearest(this->shuffled(mesh), this->pointsOfLattice(60));
    this->expectNearest(this->shuffled(plate<S>(6, 5, 6, 5)), this->pointsOfLattice(60));
    // Vertices that coincide without being the same.
    TriangleMesh<S> soup;
    for (const fcl::Triangle& t : mesh.triangles)
      for (int k = 0; k < 3; ++k) soup.vertices.push_back(mesh.vertices[t[k]]);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
      soup.triangles.emplace_back(3 * t, 3 * t + 1, 3 * t + 2);
    this->expectNearest(this->shuffled(soup), this->pointsOfLattice(30));
  }
}

/// On a ball no coordinates are whole, but triangles around a vertex or beside an edge still are
/// exactly as near.
TYPED_TEST(LatticeFeature, NearestTriangleAroundAVertexHasTheSmallestIndex) {
  using S = TypeParam;
  for (int body = 0; body < manySteps(1); ++body) {
    TriangleMesh<S> mesh = this->refined(this->refined(this->octahedron()));
    for (Vector3<S>& p : mesh.vertices) p = (p + S(0.1) * this->random_.point()).normalized();
    std::vector<Vector3<S>> points;
    for (const Vector3<S>& p : mesh.vertices) {
      points.push_back(this->random_.uniform(1, 3) * p);
      points.push_back(p);
      points.push_back(3 * this->random_.point());
    }
    this->expectNearest(this->shuffled(mesh), points);
  }
}

TYPED_TEST(LatticeFeature, VertexContactsNameTheSmallestIndex) {
  using S = TypeParam;
  const fcl::Transform3<S> still = fcl::Transform3<S>::Identity();
  for (int body = 0; body < manySteps(10); ++body) {
    TriangleMesh<S> mesh = this->shuffled(this->refined(this->octahedron())), other = mesh;
    for (Vector3<S>& p : mesh.vertices)
      p = 8 * p + Vector3<S>(S(this->random_.below(9)), S(this->random_.below(9)), 3);
    for (Vector3<S>& p : other.vertices) p *= 8;
    adaptive_bvh::VertexContacts<S> contacts;
    vertexContacts(DeformableMesh<S>(mesh), still, DeformableMesh<S>(other), still, S(1e3),
                   contacts);
    ASSERT_EQ(mesh.vertices.size(), contacts.size());
    for (std::size_t i = 0; i < contacts.size(); ++i)
      EXPECT_EQ(this->nearest(other, mesh.vertices[contacts.vertices[i]]), contacts.triangles[i]);
  }
}

class LatticeTouch : public LatticeFeature<double> {
 protected:
  /// A few triangles that share vertices, or are segments or points; whole numbers below `size`.
  TriangleMesh<double> soupOf(int vertices, int triangles, int size) {
    TriangleMesh<double> mesh;
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
    featurePairsWithin(Mesh(first), double(limit), found);
    ASSERT_EQ(featurePairs(first, first, limit, true), featurePairs(found, first, first, true));
  }
  EXPECT_GT(touching, 300u);
}

/// A flat cloth is left out as a whole: that changes no result.
TEST_F(LatticeTouch, PairsOfAFlatClothAreThoseOfAllFeatures) {
  std::size_t near = 0;
  for (int round = 0; round < manySteps(20); ++round) {
    const int columns = 2 + random_.below(5), rows = 2 + random_.below(5), step = 6;
    auto cloth = plate<double>(columns, rows, columns * step, rows * step);
    for (fcl::Vector3d& p : cloth.vertices) {
      p = p.unaryExpr([](double x) { return std::round(x); });
      if (!random_.oneIn(3)) continue;
      p += fcl::Vector3d(random_.below(5) - 2, random_.below(5) - 2, random_.below(3) - 1);
    }
    const int limit = random_.below(5);
    FeaturePairs found;
    featurePairsWithin(Mesh(cloth), double(limit), found);
    const FeatureSet expected = featurePairs(cloth, cloth, limit, true);
    ASSERT_EQ(expected, featurePairs(found, cloth, cloth, true)) << limit;
    near += expected.size();
    adaptive_bvh::ProximityRequest<double> request;
    request.distance = limit;
    adaptive_bvh::TrianglePairs<double> pairs;
    pairsWithin(Mesh(cloth), request, pairs);
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
  adaptive_bvh::TrianglePairs<double> triangles;
  adaptive_bvh::FeatureProximityRequest<double> of_features;
  adaptive_bvh::ProximityRequest<double> of_triangles;
  fcl::CollisionResult<double> contacts;
  for (const bool is_right : {true, false}) {
    adaptive_bvh::IgnoredPairs ignored;
    ignored.list = is_right ? &right : &swapped;
    of_features.edge_edge = of_triangles.ignored = ignored;
    const auto expect = [&](const auto& call) {
      if (is_right)
        EXPECT_NO_THROW(call());
      else
        EXPECT_THROW(call(), std::invalid_argument);
    };
    expect([&] { featurePairsWithin(mesh, of_features, features); });
    expect([&] { pairsWithin(mesh, of_triangles, triangles); });
    expect([&] {
      selfCollide(mesh, fcl::CollisionRequest<double>(), contacts,
                  adaptive_bvh::NeighbourFilter::SharedVertex, ignored);
    });
  }
  // Of two meshes any order has a meaning.
  adaptive_bvh::IgnoredPairs ignored;
  ignored.list = &swapped;
  of_features.edge_edge = ignored;
  const fcl::Transform3d still = fcl::Transform3d::Identity();
  EXPECT_NO_THROW(featurePairsWithin(mesh, still, mesh, still, of_features, features));
}

}  // namespace lattice_feature_test
}  // namespace adaptive_bvh_test
