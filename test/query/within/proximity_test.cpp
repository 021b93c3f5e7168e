// Proximity of deforming meshes against tests of all pairs of features in long double: no pair
// missed, none too many, but for those whose distance is the limit within rounding.
#include <gtest/gtest.h>

#include <map>
#include <set>

#include "adaptive_bvh/point_query.h"
#include "adaptive_bvh/proximity.h"
#include "support/closed_bodies.h"
#include "support/exact_geometry.h"
#include "support/long_mode.h"
#include "support/random_geometry.h"
#include "support/test_mesh.h"

namespace adaptive_bvh_test {
namespace proximity_test {

using adaptive_bvh::CoherentProximity;
using adaptive_bvh::DeformableMesh;
using adaptive_bvh::FeaturePair;
using adaptive_bvh::FeaturePairs;
using adaptive_bvh::NeighbourFilter;
using adaptive_bvh::ProximityRequest;
using adaptive_bvh::TrianglePairs;
using exact::Real;

/// Counts pairs of features in long double.
template <typename S>
class Oracle {
 public:
  using Model = DeformableMesh<S>;
  using Pair = std::pair<unsigned, unsigned>;

  /// The second model in the first's frame, by transforms in double as they stand.
  Oracle(const Model& first, const fcl::Transform3<S>& tf1, const Model& second,
         const fcl::Transform3<S>& tf2)
      : first_(first), second_(second) {
    const exact::Matrix R1 = exact::of(tf1.linear());
    placement_.R = R1.transpose() * exact::of(tf2.linear());
    placement_.T = R1.transpose() * (exact::of(tf2.translation()) - exact::of(tf1.translation()));
  }

  exact::Point point1(unsigned v) const { return exact::of(first_.vertices()[v]); }
  exact::Point point2(unsigned v) const { return placement_(exact::of(second_.vertices()[v])); }
  exact::Triangle triangle1(int t) const {
    const fcl::Triangle& v = first_.triangles()[t];
    return {point1(unsigned(v[0])), point1(unsigned(v[1])), point1(unsigned(v[2]))};
  }
  exact::Triangle triangle2(int t) const {
    const fcl::Triangle& v = second_.triangles()[t];
    return {point2(unsigned(v[0])), point2(unsigned(v[1])), point2(unsigned(v[2]))};
  }
  Real distance(int a, int b) const { return exact::distance(triangle1(a), triangle2(b)); }
  Real distance() const {
    Real least = std::numeric_limits<Real>::max();
    for (int a = 0; a < numTriangles(first_); ++a)
      for (int b = 0; b < numTriangles(second_); ++b) least = std::min(least, distance(a, b));
    return least;
  }

  /// What rounding may change of a distance.
  Real rounding() const {
    Real size = 0;
    for (int v = 0; v < numVertices(first_); ++v)
      size = std::max(size, point1(unsigned(v)).cwiseAbs().maxCoeff());
    for (int v = 0; v < numVertices(second_); ++v)
      size = std::max(size, point2(unsigned(v)).cwiseAbs().maxCoeff());
    return size / Real(1ll << 46) + size * 1e-14L;
  }

 private:
  const Model &first_, &second_;
  exact::Placement placement_;
};

template <typename S>
class Proximity : public testing::Test {
 protected:
  using Model = DeformableMesh<S>;
  using Transform = fcl::Transform3<S>;
  using Pair = std::pair<unsigned, unsigned>;

  static Transform identity() { return Transform::Identity(); }

  TriangleMesh<S> mesh(int triangles) {
    const int side = std::max(2, int(std::sqrt(triangles / 2.)));
    switch (random_.below(4)) {
      case 0: return plate<S>(side, side);
      case 1: return tube<S>(std::max(3, side), side);
      case 2: return dome<S>(std::max(3, side), side);
      default: return soup<S>(triangles, random_.engine());
    }
  }
  void deform(Model& model, S size) {
    std::vector<Vector3<S>> points = model.vertices();
    const S step = size * random_.size(-4, -0.7);
    for (Vector3<S>& p : points) p += random_.point() * step;
    if (random_.oneIn(4)) points[std::size_t(random_.below(numVertices(model)))] = points[0];
    if (random_.oneIn(3)) {
      const unsigned some[] = {unsigned(random_.below(numVertices(model)))};
      model.update(some, &points[some[0]], 1);
    } else {
      model.update(points);
    }
  }
  /// From nothing to the size of the body; now and then nothing at all.
  S anyDistance() { return random_.oneIn(6) ? S(0) : random_.size(-4, 0.2); }
  static int shared(const Model& model, int a, int b) {
    int count = 0;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) count += model.triangles()[a][i] == model.triangles()[b][j];
    return count;
  }

  /// Expects each pair that is surely nearer once, and none that is surely farther.
  template <typename Distance>
  void expectPairs(const std::vector<FeaturePair>& found, unsigned size1, unsigned size2,
                   const Distance& distance, Real limit, Real rounding) {
    std::map<Pair, int> counts;
    for (const FeaturePair& pair : found)
      EXPECT_EQ(1, ++counts[Pair(pair.first, pair.second)]) << "twice";
    for (unsigned a = 0; a < size1; ++a)
      for (unsigned b = 0; b < size2; ++b) {
        const Real d = distance(a, b);
        const bool is_found = counts.count(Pair(a, b)) > 0;
        if (d <= limit - rounding) {
          EXPECT_TRUE(is_found) << a << " " << b << " " << double(d);
        }
        if (d > limit + rounding) {
          EXPECT_FALSE(is_found) << a << " " << b << " " << double(d);
        }
      }
    compared_ += long(size1) * size2;
  }

  RandomGeometry<S> random_{20260};
  long compared_ = 0;
  static constexpr Real kFar = 1e30L;  // of a pair that does not count
};

TYPED_TEST_SUITE(Proximity, QueryScalars);

TYPED_TEST(Proximity, FindsTheTrianglesOfTwoMeshesWithinAnyDistance) {
  using S = TypeParam;
  int queries = 0;
  for (int body = 0; body < 250; ++body) {
    const int size = body % 50 ? 20 : 100;
    typename TestFixture::Model a(this->mesh(2 + this->random_.below(size)));
    typename TestFixture::Model b(this->mesh(2 + this->random_.below(size)));
    for (int step = 0; step < 5; ++step, ++queries) {
      this->deform(a, 1);
      if (step % 2) this->deform(b, 1);
      const auto tf1 = this->random_.pose(1), tf2 = this->random_.pose(1);
      ProximityRequest<S> request;
      request.distance = this->anyDistance();
      request.enable_distances = step % 2;
      request.enable_nearest_points = step % 3 == 0;
      TrianglePairs<S> result;
      const std::size_t found = pairsWithin(a, tf1, b, tf2, request, result);
      EXPECT_EQ(found, result.size());
      const Oracle<S> oracle(a, tf1, b, tf2);
      const Real rounding = oracle.rounding();
      this->expectPairs(
          result.triangles, unsigned(numTriangles(a)), unsigned(numTriangles(b)),
          [&](unsigned i, unsigned j) { return oracle.distance(int(i), int(j)); },
          Real(request.distance), rounding);
      const Real in_s = 8 * Real(std::numeric_limits<S>::epsilon());
      ASSERT_EQ(request.enable_distances ? result.size() : 0, result.distances.size());
      for (std::size_t i = 0; i < result.distances.size(); ++i) {
        const Real d =
            oracle.distance(int(result.triangles[i].first), int(result.triangles[i].second));
        EXPECT_NEAR(double(d), double(result.distances[i]), double(rounding + in_s * d));
      }
      ASSERT_EQ(request.enable_nearest_points ? result.size() : 0, result.nearest_points.size());
      for (std::size_t i = 0; i < result.nearest_points.size(); ++i) {
        const auto& points = result.nearest_points[i];
        const auto d =
            oracle.distance(int(result.triangles[i].first), int(result.triangles[i].second));
        EXPECT_NEAR(double(d), double((points[0] - points[1]).norm()), double(rounding + 8 * in_s));
        const exact::Point on_first = exact::of(tf1.inverse(Eigen::Isometry) * points[0]);
        EXPECT_LE(exact::distance(oracle.triangle1(int(result.triangles[i].first)), on_first),
                  rounding + 8 * in_s);
      }
      EXPECT_EQ(result.size() > 0, isNearer(a, tf1, b, tf2, request.distance));
    }
  }
  EXPECT_EQ(queries, 1250);
}

TYPED_TEST(Proximity, FindsTheTrianglesOfOneMeshWithinAnyDistance) {
  using S = TypeParam;
  constexpr NeighbourFilter kFilters[] = {NeighbourFilter::SharedVertex,
                                          NeighbourFilter::SharedEdge, NeighbourFilter::None};
  for (int body = 0; body < 250; ++body) {
    typename TestFixture::Model a(this->mesh(2 + this->random_.below(body % 50 ? 30 : 120)));
    for (int step = 0; step < 5; ++step) {
      this->deform(a, 1);
      ProximityRequest<S> request;
      request.distance = this->anyDistance();
      const NeighbourFilter filter = kFilters[this->random_.below(3)];
      const int least = filter == NeighbourFilter::None ? 10 : 1 + int(filter);
      TrianglePairs<S> result;
      pairsWithin(a, request, result, filter);
      const Oracle<S> oracle(a, this->identity(), a, this->identity());
      this->expectPairs(
          result.triangles, unsigned(numTriangles(a)), unsigned(numTriangles(a)),
          [&](unsigned i, unsigned j) {
            return i < j && this->shared(a, int(i), int(j)) < least
                       ? oracle.distance(int(i), int(j))
                       : this->kFar;
          },
          Real(request.distance), oracle.rounding());
    }
  }
}

/// The number of an edge: the smallest of those of all triangles that have it.
template <typename Model>
std::map<std::pair<unsigned, unsigned>, unsigned> edgesOf(const Model& model) {
  std::map<std::pair<unsigned, unsigned>, unsigned> edges;
  for (int t = 0; t < numTriangles(model); ++t)
    for (unsigned k = 0; k < 3; ++k) {
      const auto a = unsigned(model.triangles()[t][k]),
                 b = unsigned(model.triangles()[t][(k + 1) % 3]);
      if (a != b) edges.emplace(std::minmax(a, b), 3 * unsigned(t) + k);
    }
  return edges;
}

TYPED_TEST(Proximity, FindsTheFeaturesOfTwoMeshes) {
  using S = TypeParam;
  for (int body = 0; body < 200; ++body) {
    const int size = body % 50 ? 12 : 50;
    typename TestFixture::Model a(this->mesh(2 + this->random_.below(size)));
    typename TestFixture::Model b(this->mesh(2 + this->random_.below(size)));
    const auto edges_a = edgesOf(a), edges_b = edgesOf(b);
    for (int step = 0; step < 3; ++step) {
      this->deform(a, 1);
      const auto tf1 = this->random_.pose(1), tf2 = this->random_.pose(1);
      const S d = this->anyDistance();
      FeaturePairs result;
      featurePairsWithin(a, tf1, b, tf2, d, result);
      const Oracle<S> oracle(a, tf1, b, tf2);
      const Real rounding = 4 * oracle.rounding();
      this->expectPairs(
          result.vertex_face, unsigned(numVertices(a)), unsigned(numTriangles(b)),
          [&](unsigned v, unsigned t) {
            return exact::distance(oracle.triangle2(int(t)), oracle.point1(v));
          },
          d, rounding);
      this->expectPairs(
          result.face_vertex, unsigned(numTriangles(a)), unsigned(numVertices(b)),
          [&](unsigned t, unsigned v) {
            return exact::distance(oracle.triangle1(int(t)), oracle.point2(v));
          },
          d, rounding);
      std::set<FeaturePair> found(result.edge_edge.begin(), result.edge_edge.end());
      EXPECT_EQ(found.size(), result.edge_edge.size()) << "an edge pair twice";
      std::size_t sure = 0, possible = 0;
      for (const auto& e : edges_a)
        for (const auto& f : edges_b) {
          const Real distance =
              exact::distance(oracle.point1(e.first.first), oracle.point1(e.first.second),
                              oracle.point2(f.first.first), oracle.point2(f.first.second));
          sure += distance <= d - rounding;
          possible += distance <= d + rounding;
          if (distance <= d - rounding) {
            EXPECT_TRUE(found.count({e.second, f.second}));
          }
        }
      EXPECT_GE(found.size(), sure);
      EXPECT_LE(found.size(), possible);
    }
  }
}

TYPED_TEST(Proximity, FindsTheFeaturesOfOneMeshWithoutSharedVertices) {
  using S = TypeParam;
  for (int body = 0; body < 200; ++body) {
    typename TestFixture::Model a(this->mesh(2 + this->random_.below(body % 50 ? 16 : 60)));
    const auto edges = edgesOf(a);
    for (int step = 0; step < 3; ++step) {
      this->deform(a, 1);
      const S d = this->anyDistance();
      FeaturePairs result;
      featurePairsWithin(a, d, result);
      EXPECT_TRUE(result.face_vertex.empty());
      const Oracle<S> oracle(a, this->identity(), a, this->identity());
      const Real rounding = 4 * oracle.rounding();
      this->expectPairs(
          result.vertex_face, unsigned(numVertices(a)), unsigned(numTriangles(a)),
          [&](unsigned v, unsigned t) {
            const fcl::Triangle& corners = a.triangles()[t];
            bool used = false;  // a vertex without a triangle is no feature
            for (int i = 0; i < numTriangles(a); ++i)
              for (int k = 0; k < 3; ++k) used = used || a.triangles()[i][k] == v;
            if (!used || corners[0] == v || corners[1] == v || corners[2] == v) return this->kFar;
            return exact::distance(oracle.triangle1(int(t)), oracle.point1(v));
          },
          d, rounding);
      std::set<FeaturePair> found(result.edge_edge.begin(), result.edge_edge.end());
      EXPECT_EQ(found.size(), result.edge_edge.size()) << "an edge pair twice";
      for (const auto& e : edges)
        for (const auto& f : edges) {
          if (e.second >= f.second) continue;
          const std::set<unsigned> ends{e.first.first, e.first.second, f.first.first,
                                        f.first.second};
          const Real distance =
              exact::distance(oracle.point1(e.first.first), oracle.point1(e.first.second),
                              oracle.point1(f.first.first), oracle.point1(f.first.second));
          const bool is_found = found.count({e.second, f.second}) > 0;
          if (ends.size() < 4 || distance > d + rounding) {
            EXPECT_FALSE(is_found);
          }
          if (ends.size() == 4 && distance <= d - rounding) {
            EXPECT_TRUE(is_found);
          }
        }
    }
  }
}

TYPED_TEST(Proximity, CoherentAnswersAsTheDistanceDoesAndSkipsSearches) {
  using S = TypeParam;
  std::size_t searches = 0, calls = 0;
  for (int body = 0; body < manySteps(4); ++body) {
    typename TestFixture::Model a(this->mesh(60));
    typename TestFixture::Model b(this->mesh(60));
    CoherentProximity<S> pair(a, b);
    auto tf1 = this->random_.pose(1), tf2 = this->random_.pose(1);
    tf2.translation() += this->random_.direction() * S(3);
    const S step = this->random_.size(-3.5, -1);
    for (int i = 0; i < 25; ++i) {
      if (i == 12) a = typename TestFixture::Model(this->mesh(50));  // another tree
      this->deform(a, step);
      tf2.translation() += this->random_.point() * step;
      if (this->random_.oneIn(12)) tf1 = this->random_.pose(1);
      const Oracle<S> oracle(a, tf1, b, tf2);
      const Real distance = oracle.distance(), rounding = oracle.rounding();
      const S d =
          this->random_.oneIn(3) ? S(distance) * this->random_.uniform(0, 2) : this->anyDistance();
      const bool answer = pair.isNearer(tf1, tf2, d);
      if (distance <= d - rounding) {
        EXPECT_TRUE(answer) << double(distance) << " " << d;
      }
      if (distance > d + rounding) {
        EXPECT_FALSE(answer) << double(distance) << " " << d;
      }
      ++calls;
    }
    searches += pair.searches();
  }
  EXPECT_GT(searches, 0u);
  EXPECT_LT(searches, calls);
}

TYPED_TEST(Proximity, BodiesApartNeedOneSearchForManySteps) {
  using S = TypeParam;
  typename TestFixture::Model a(plate<S>(12, 12));
  typename TestFixture::Model b(tube<S>(12, 12));
  CoherentProximity<S> pair(a, b);
  auto tf2 = this->identity();
  tf2.translation() = Vector3<S>(0, 0, 2);
  for (int i = 0; i < 100; ++i) {
    moveVertices(a, [&](Vector3<S>& p) { p += this->random_.point() * S(0.002); });
    EXPECT_FALSE(pair.isNearer(this->identity(), tf2, S(0.5)));
  }
  EXPECT_LE(pair.searches(), 12u);
}

/// Where two sheets cross moves on from step to step; now and then they part, or one becomes
/// another mesh.
TYPED_TEST(Proximity, BodiesThatStayInTouchRarelyNeedASearch) {
  using S = TypeParam;
  for (const S d : {S(0), S(0.01)}) {
    typename TestFixture::Model a(plate<S>(5, 5));
    typename TestFixture::Model b(plate<S>(4, 4));
    CoherentProximity<S> pair(a, b);
    auto tf2 = this->identity();
    tf2.linear() = fcl::AngleAxis<S>(S(1.2), Vector3<S>(1, S(0.3), 0).normalized()).matrix();
    int near = 0;
    constexpr int kSteps = 80;
    for (int i = 0; i < kSteps; ++i) {
      if (i == 40) a = typename TestFixture::Model(plate<S>(4, 4));  // another tree
      moveVertices(
          a, [&](Vector3<S>& p) { p[2] += S(0.004) * std::sin(S(9) * p[0] + S(0.4) * S(i)); });
      tf2.translation() = Vector3<S>(S(0.3), S(0.4) + S(0.2) * std::sin(S(0.1) * S(i)),
                                     i % 40 > 35 ? S(1.5) : S(0.1) * std::cos(S(0.07) * S(i)));
      const Oracle<S> oracle(a, this->identity(), b, tf2);
      const Real distance = oracle.distance(), rounding = oracle.rounding();
      const bool answer = pair.isNearer(this->identity(), tf2, d);
      if (distance <= d - rounding || distance == 0) {
        EXPECT_TRUE(answer) << i;
      }
      if (distance > d + rounding) {
        EXPECT_FALSE(answer) << i;
      }
      near += answer;
    }
    EXPECT_GT(near, kSteps / 2);
    EXPECT_LT(near, kSteps);
    EXPECT_LT(pair.searches(), std::size_t(kSteps / 3));
  }
}

/// So near, for how far they move, that no bound lasts; then they rest.
TYPED_TEST(Proximity, AnswersWithoutBoundsWhereTheseDoNotLast) {
  using S = TypeParam;
  typename TestFixture::Model a(plate<S>(5, 5));
  typename TestFixture::Model b(plate<S>(3, 3));
  CoherentProximity<S> pair(a, b);
  std::size_t searches_before = 0;
  for (int i = 0; i < 150; ++i) {
    const bool rests = i >= 50;
    if (i == 25) a = typename TestFixture::Model(plate<S>(4, 6));  // another tree
    moveVertices(a, [&](Vector3<S>& p) {
      if (!rests) p[2] = S(0.03) * std::sin(S(7) * p[0] + S(0.9) * S(i));
    });
    auto tf2 = this->identity();
    tf2.translation()[2] = S(0.08);
    const Oracle<S> oracle(a, this->identity(), b, tf2);
    const S d = S(oracle.distance()) * (i % 9 == 8 && !rests ? S(1.1) : S(0.8));
    EXPECT_EQ(i % 9 == 8 && !rests, pair.isNearer(this->identity(), tf2, d)) << i;
    if (i == 119) searches_before = pair.searches();
  }
  EXPECT_GT(searches_before, 35u);
  EXPECT_LT(pair.searches(), searches_before + 5) << "bounds last again";
}

/// What a bound had to cover while bodies moved fast is of no matter once they rest.
TYPED_TEST(Proximity, BoundsLastAgainAfterAFastMotion) {
  using S = TypeParam;
  typename TestFixture::Model a(plate<S>(6, 6));
  typename TestFixture::Model b(plate<S>(5, 5));
  CoherentProximity<S> pair(a, b);
  std::size_t searches_before = 0;
  for (int i = 0; i < 60; ++i) {
    moveVertices(a, [&](Vector3<S>&) {});
    auto tf2 = this->identity();
    tf2.translation()[2] = i < 20 ? S(6 - 0.25 * i) : S(0.55);
    EXPECT_FALSE(pair.isNearer(this->identity(), tf2, S(0.5))) << i;
    if (i == 25) searches_before = pair.searches();
  }
  EXPECT_EQ(searches_before, pair.searches());
}

TYPED_TEST(Proximity, ClearanceIsTheDistanceOfEveryVertexUpToTheLimit) {
  using S = TypeParam;
  for (int body = 0; body < 30; ++body) {
    typename TestFixture::Model a(this->mesh(60));
    typename TestFixture::Model b(this->mesh(80));
    for (int step = 0; step < 3; ++step) {
      this->deform(a, 1);
      this->deform(b, 1);
      const auto tf1 = this->random_.pose(1), tf2 = this->random_.pose(1);
      const S limit =
          this->random_.oneIn(3) ? std::numeric_limits<S>::infinity() : this->random_.size(-2, 0.5);
      std::vector<S> result;
      clearance(a, tf1, b, tf2, limit, result);
      ASSERT_EQ(std::size_t(numVertices(a)), result.size());
      const Oracle<S> oracle(b, tf2, a, tf1);
      const Real rounding = oracle.rounding();
      for (int v = 0; v < numVertices(a); ++v) {
        Real least = limit;
        for (int t = 0; t < numTriangles(b); ++t)
          least = std::min(least, exact::distance(oracle.triangle1(t), oracle.point2(unsigned(v))));
        EXPECT_NEAR(double(least), double(result[std::size_t(v)]),
                    double(rounding + 4 * std::numeric_limits<S>::epsilon() * least));
      }
    }
  }
}

TYPED_TEST(Proximity, SignedClearanceIsNegativeInside) {
  using S = TypeParam;
  for (int body = 0; body < 20; ++body) {
    typename TestFixture::Model a(this->mesh(80));
    typename TestFixture::Model b(
        gridBall<S>(6 + this->random_.below(6), 3 + this->random_.below(5)));
    for (int step = 0; step < 3; ++step) {
      this->deform(b, S(0.5));
      const auto tf = this->random_.pose(S(0.5));
      std::vector<S> distances, result;
      clearance(a, tf, b, this->identity(), S(10), distances);
      signedClearance(a, tf, b, this->identity(), S(10), result);
      int inside = 0;
      for (std::size_t v = 0; v < result.size(); ++v) {
        EXPECT_EQ(distances[v], std::abs(result[v]));
        if (distances[v] < S(1e-5)) continue;
        const exact::Point x =
            exact::of(tf.linear()) * exact::of(a.vertices()[v]) + exact::of(tf.translation());
        const Real number = windingNumberOf(b, x);
        EXPECT_EQ(std::abs(number) > 0.5L, result[v] < 0) << double(number);
        inside += result[v] < 0;
      }
      (void)inside;
    }
  }
}

TYPED_TEST(Proximity, SignsAreRightForVerticesInLineWithEdges) {
  using S = TypeParam;
  TriangleMesh<S> box;
  for (int i = 0; i < 8; ++i) box.vertices.emplace_back(i & 1, i >> 1 & 1, i >> 2 & 1);
  const int faces[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                            {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  for (const auto& f : faces)
    box.triangles.emplace_back(std::size_t(f[0]), std::size_t(f[1]), std::size_t(f[2]));
  typename TestFixture::Model cube(box);
  // Points on the lines through its edges, corners and diagonals, in and out.
  TriangleMesh<S> points;
  for (int i = -1; i <= 3; ++i)
    for (int j = -1; j <= 3; ++j)
      for (int k = -1; k <= 3; ++k) points.vertices.emplace_back(S(i) / 2, S(j) / 2, S(k) / 2);
  points.triangles.emplace_back(0, 1, 2);
  typename TestFixture::Model grid(points);
  std::vector<S> result;
  signedClearance(grid, this->identity(), cube, this->identity(), S(5), result);
  for (std::size_t v = 0; v < result.size(); ++v) {
    const Vector3<S> p = points.vertices[v];
    const bool inside = (p.array() > 0).all() && (p.array() < 1).all();
    EXPECT_EQ(inside, result[v] < 0) << p.transpose();
  }
}

TYPED_TEST(Proximity, RefusesWhatItCannotAnswer) {
  using S = TypeParam;
  typename TestFixture::Model a(plate<S>(3, 3));
  typename TestFixture::Model b(plate<S>(3, 3));
  const auto tf = this->identity();
  const S nan = std::numeric_limits<S>::quiet_NaN();
  TrianglePairs<S> pairs;
  FeaturePairs features;
  std::vector<S> numbers;
  for (const S bad : {nan, S(-1)}) {
    EXPECT_THROW(isNearer(a, tf, b, tf, bad), std::invalid_argument);
    EXPECT_THROW(featurePairsWithin(a, bad, features), std::invalid_argument);
    EXPECT_THROW(clearance(a, tf, b, tf, bad, numbers), std::invalid_argument);
    EXPECT_THROW(CoherentProximity<S>(a, b).isNearer(tf, tf, bad), std::invalid_argument);
    ProximityRequest<S> request;
    request.distance = bad;
    EXPECT_THROW(pairsWithin(a, tf, b, tf, request, pairs), std::invalid_argument);
  }
  EXPECT_THROW(closestPoint(a, Vector3<S>(0, nan, 0)), std::invalid_argument);
  EXPECT_THROW(firstHit(a, Vector3<S>(0, 0, 0), Vector3<S>(0, 0, 0)), std::invalid_argument);
  // A plate encloses nothing.
  EXPECT_THROW(signedClearance(a, tf, b, tf, S(1), numbers), std::invalid_argument);
  // All is within infinity.
  ProximityRequest<S> all;
  all.distance = std::numeric_limits<S>::infinity();
  EXPECT_EQ(std::size_t(numTriangles(a)) * std::size_t(numTriangles(b)),
            pairsWithin(a, tf, b, tf, all, pairs));
}

}  // namespace proximity_test
}  // namespace adaptive_bvh_test
