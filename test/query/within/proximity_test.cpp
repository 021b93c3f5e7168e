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
class Oracle {
 public:
  using Model = DeformableMesh;
  using Pair = std::pair<unsigned, unsigned>;

  /// The second model in the first's frame, by transforms in double as they stand.
  Oracle(const Model& first, const fcl::Transform3d& tf1, const Model& second,
         const fcl::Transform3d& tf2)
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

class Proximity : public testing::Test {
 protected:
  using Model = DeformableMesh;
  using Transform = fcl::Transform3d;
  using Pair = std::pair<unsigned, unsigned>;

  static Transform identity() { return Transform::Identity(); }

  TriangleMesh mesh(int triangles) {
    const int side = std::max(2, int(std::sqrt(triangles / 2.)));
    switch (random_.below(4)) {
      case 0: return plate(side, side);
      case 1: return tube(std::max(3, side), side);
      case 2: return dome(std::max(3, side), side);
      default: return soup(triangles, random_.engine());
    }
  }
  void deform(Model& model, double size) {
    std::vector<fcl::Vector3d> points = model.vertices();
    const double step = size * random_.size(-4, -0.7);
    for (fcl::Vector3d& p : points) p += random_.point() * step;
    if (random_.oneIn(4)) points[std::size_t(random_.below(numVertices(model)))] = points[0];
    if (random_.oneIn(3)) {
      const unsigned some[] = {unsigned(random_.below(numVertices(model)))};
      model.update(some, &points[some[0]], 1);
    } else {
      model.update(points);
    }
  }
  /// From nothing to the size of the body; now and then nothing at all.
  double anyDistance() { return random_.oneIn(6) ? 0. : random_.size(-4, 0.2); }
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

  RandomGeometry random_{20260};
  long compared_ = 0;
  static constexpr Real kFar = 1e30L;  // of a pair that does not count
};

TEST_F(Proximity, FindsTheTrianglesOfTwoMeshesWithinAnyDistance) {
  int queries = 0;
  for (int body = 0; body < 250; ++body) {
    const int size = body % 50 ? 20 : 100;
    Model a(this->mesh(2 + this->random_.below(size)));
    Model b(this->mesh(2 + this->random_.below(size)));
    for (int step = 0; step < 5; ++step, ++queries) {
      this->deform(a, 1);
      if (step % 2) this->deform(b, 1);
      const auto tf1 = this->random_.pose(1), tf2 = this->random_.pose(1);
      ProximityRequest request;
      request.distance = this->anyDistance();
      request.enable_distances = step % 2;
      request.enable_nearest_points = step % 3 == 0;
      TrianglePairs result;
      const std::size_t found = pairsWithin(a, tf1, b, tf2, request, result);
      EXPECT_EQ(found, result.size());
      const Oracle oracle(a, tf1, b, tf2);
      const Real rounding = oracle.rounding();
      this->expectPairs(
          result.triangles, unsigned(numTriangles(a)), unsigned(numTriangles(b)),
          [&](unsigned i, unsigned j) { return oracle.distance(int(i), int(j)); },
          Real(request.distance), rounding);
      const Real in_s = 8 * Real(std::numeric_limits<double>::epsilon());
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

TEST_F(Proximity, FindsTheTrianglesOfOneMeshWithinAnyDistance) {
  constexpr NeighbourFilter kFilters[] = {NeighbourFilter::SharedVertex,
                                          NeighbourFilter::SharedEdge, NeighbourFilter::None};
  for (int body = 0; body < 250; ++body) {
    Model a(this->mesh(2 + this->random_.below(body % 50 ? 30 : 120)));
    for (int step = 0; step < 5; ++step) {
      this->deform(a, 1);
      ProximityRequest request;
      request.distance = this->anyDistance();
      const NeighbourFilter filter = kFilters[this->random_.below(3)];
      const int least = filter == NeighbourFilter::None ? 10 : 1 + int(filter);
      request.ignored.neighbours = filter;
      TrianglePairs result;
      selfPairsWithin(a, request, result);
      const Oracle oracle(a, this->identity(), a, this->identity());
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

TEST_F(Proximity, FindsTheFeaturesOfTwoMeshes) {
  for (int body = 0; body < 200; ++body) {
    const int size = body % 50 ? 12 : 50;
    Model a(this->mesh(2 + this->random_.below(size)));
    Model b(this->mesh(2 + this->random_.below(size)));
    const auto edges_a = edgesOf(a), edges_b = edgesOf(b);
    for (int step = 0; step < 3; ++step) {
      this->deform(a, 1);
      const auto tf1 = this->random_.pose(1), tf2 = this->random_.pose(1);
      const double d = this->anyDistance();
      FeaturePairs result;
      featurePairsWithin(a, tf1, b, tf2, d, result);
      const Oracle oracle(a, tf1, b, tf2);
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

TEST_F(Proximity, FindsTheFeaturesOfOneMeshWithoutSharedVertices) {
  for (int body = 0; body < 200; ++body) {
    Model a(this->mesh(2 + this->random_.below(body % 50 ? 16 : 60)));
    const auto edges = edgesOf(a);
    for (int step = 0; step < 3; ++step) {
      this->deform(a, 1);
      const double d = this->anyDistance();
      FeaturePairs result;
      selfFeaturePairsWithin(a, d, result);
      EXPECT_TRUE(result.face_vertex.empty());
      const Oracle oracle(a, this->identity(), a, this->identity());
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

TEST_F(Proximity, CoherentAnswersAsTheDistanceDoesAndSkipsSearches) {
  std::size_t searches = 0, calls = 0;
  for (int body = 0; body < manySteps(4); ++body) {
    Model a(this->mesh(60));
    Model b(this->mesh(60));
    CoherentProximity pair(a, b);
    auto tf1 = this->random_.pose(1), tf2 = this->random_.pose(1);
    tf2.translation() += this->random_.direction() * 3.;
    const double step = this->random_.size(-3.5, -1);
    for (int i = 0; i < 25; ++i) {
      if (i == 12) a = Model(this->mesh(50));  // another tree
      this->deform(a, step);
      tf2.translation() += this->random_.point() * step;
      if (this->random_.oneIn(12)) tf1 = this->random_.pose(1);
      const Oracle oracle(a, tf1, b, tf2);
      const Real distance = oracle.distance(), rounding = oracle.rounding();
      const double d = this->random_.oneIn(3) ? double(distance) * this->random_.uniform(0, 2)
                                              : this->anyDistance();
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

TEST_F(Proximity, BodiesApartNeedOneSearchForManySteps) {
  Model a(plate(12, 12));
  Model b(tube(12, 12));
  CoherentProximity pair(a, b);
  auto tf2 = this->identity();
  tf2.translation() = fcl::Vector3d(0, 0, 2);
  for (int i = 0; i < 100; ++i) {
    moveVertices(a, [&](fcl::Vector3d& p) { p += this->random_.point() * 0.002; });
    EXPECT_FALSE(pair.isNearer(this->identity(), tf2, 0.5));
  }
  EXPECT_LE(pair.searches(), 12u);
}

/// Where two sheets cross moves on from step to step; now and then they part, or one becomes
/// another mesh.
TEST_F(Proximity, BodiesThatStayInTouchRarelyNeedASearch) {
  for (const double d : {0., 0.01}) {
    Model a(plate(5, 5));
    Model b(plate(4, 4));
    CoherentProximity pair(a, b);
    auto tf2 = this->identity();
    tf2.linear() = fcl::AngleAxis<double>(1.2, fcl::Vector3d(1, 0.3, 0).normalized()).matrix();
    int near = 0;
    constexpr int kSteps = 80;
    for (int i = 0; i < kSteps; ++i) {
      if (i == 40) a = Model(plate(4, 4));  // another tree
      moveVertices(
          a, [&](fcl::Vector3d& p) { p[2] += 0.004 * std::sin(9. * p[0] + 0.4 * double(i)); });
      tf2.translation() = fcl::Vector3d(0.3, 0.4 + 0.2 * std::sin(0.1 * double(i)),
                                        i % 40 > 35 ? 1.5 : 0.1 * std::cos(0.07 * double(i)));
      const Oracle oracle(a, this->identity(), b, tf2);
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
TEST_F(Proximity, AnswersWithoutBoundsWhereTheseDoNotLast) {
  Model a(plate(5, 5));
  Model b(plate(3, 3));
  CoherentProximity pair(a, b);
  std::size_t searches_before = 0;
  for (int i = 0; i < 150; ++i) {
    const bool rests = i >= 50;
    if (i == 25) a = Model(plate(4, 6));  // another tree
    moveVertices(a, [&](fcl::Vector3d& p) {
      if (!rests) p[2] = 0.03 * std::sin(7. * p[0] + 0.9 * double(i));
    });
    auto tf2 = this->identity();
    tf2.translation()[2] = 0.08;
    const Oracle oracle(a, this->identity(), b, tf2);
    const double d = double(oracle.distance()) * (i % 9 == 8 && !rests ? 1.1 : 0.8);
    EXPECT_EQ(i % 9 == 8 && !rests, pair.isNearer(this->identity(), tf2, d)) << i;
    if (i == 119) searches_before = pair.searches();
  }
  EXPECT_GT(searches_before, 35u);
  EXPECT_LT(pair.searches(), searches_before + 5) << "bounds last again";
}

/// What a bound had to cover while bodies moved fast is of no matter once they rest.
TEST_F(Proximity, BoundsLastAgainAfterAFastMotion) {
  Model a(plate(6, 6));
  Model b(plate(5, 5));
  CoherentProximity pair(a, b);
  std::size_t searches_before = 0;
  for (int i = 0; i < 60; ++i) {
    moveVertices(a, [&](fcl::Vector3d&) {});
    auto tf2 = this->identity();
    tf2.translation()[2] = i < 20 ? double(6 - 0.25 * i) : 0.55;
    EXPECT_FALSE(pair.isNearer(this->identity(), tf2, 0.5)) << i;
    if (i == 25) searches_before = pair.searches();
  }
  EXPECT_EQ(searches_before, pair.searches());
}

TEST_F(Proximity, ClearanceIsTheDistanceOfEveryVertexUpToTheLimit) {
  for (int body = 0; body < 30; ++body) {
    Model a(this->mesh(60));
    Model b(this->mesh(80));
    for (int step = 0; step < 3; ++step) {
      this->deform(a, 1);
      this->deform(b, 1);
      const auto tf1 = this->random_.pose(1), tf2 = this->random_.pose(1);
      const double limit = this->random_.oneIn(3) ? std::numeric_limits<double>::infinity()
                                                  : this->random_.size(-2, 0.5);
      std::vector<double> result;
      vertexDistances(a, tf1, b, tf2, limit, result);
      ASSERT_EQ(std::size_t(numVertices(a)), result.size());
      const Oracle oracle(b, tf2, a, tf1);
      const Real rounding = oracle.rounding();
      for (int v = 0; v < numVertices(a); ++v) {
        Real least = limit;
        for (int t = 0; t < numTriangles(b); ++t)
          least = std::min(least, exact::distance(oracle.triangle1(t), oracle.point2(unsigned(v))));
        EXPECT_NEAR(double(least), double(result[std::size_t(v)]),
                    double(rounding + 4 * std::numeric_limits<double>::epsilon() * least));
      }
    }
  }
}

TEST_F(Proximity, SignedClearanceIsNegativeInside) {
  for (int body = 0; body < 20; ++body) {
    Model a(this->mesh(80));
    Model b(gridBall(6 + this->random_.below(6), 3 + this->random_.below(5)));
    for (int step = 0; step < 3; ++step) {
      this->deform(b, 0.5);
      const auto tf = this->random_.pose(0.5);
      std::vector<double> distances, result;
      vertexDistances(a, tf, b, this->identity(), 10., distances);
      signedVertexDistances(a, tf, b, this->identity(), 10., result);
      int inside = 0;
      for (std::size_t v = 0; v < result.size(); ++v) {
        EXPECT_EQ(distances[v], std::abs(result[v]));
        if (distances[v] < 1e-5) continue;
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

TEST_F(Proximity, SignsAreRightForVerticesInLineWithEdges) {
  TriangleMesh box;
  for (int i = 0; i < 8; ++i) box.vertices.emplace_back(i & 1, i >> 1 & 1, i >> 2 & 1);
  const int faces[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                            {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  for (const auto& f : faces)
    box.triangles.emplace_back(std::size_t(f[0]), std::size_t(f[1]), std::size_t(f[2]));
  Model cube(box);
  // Points on the lines through its edges, corners and diagonals, in and out.
  TriangleMesh points;
  for (int i = -1; i <= 3; ++i)
    for (int j = -1; j <= 3; ++j)
      for (int k = -1; k <= 3; ++k)
        points.vertices.emplace_back(double(i) / 2, double(j) / 2, double(k) / 2);
  points.triangles.emplace_back(0, 1, 2);
  Model grid(points);
  std::vector<double> result;
  signedVertexDistances(grid, this->identity(), cube, this->identity(), 5., result);
  for (std::size_t v = 0; v < result.size(); ++v) {
    const fcl::Vector3d p = points.vertices[v];
    const bool inside = (p.array() > 0).all() && (p.array() < 1).all();
    EXPECT_EQ(inside, result[v] < 0) << p.transpose();
  }
}

TEST_F(Proximity, RefusesWhatItCannotAnswer) {
  Model a(plate(3, 3));
  Model b(plate(3, 3));
  const auto tf = this->identity();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  TrianglePairs pairs;
  FeaturePairs features;
  std::vector<double> numbers;
  for (const double bad : {nan, -1.}) {
    EXPECT_THROW(isNearer(a, tf, b, tf, bad), std::invalid_argument);
    EXPECT_THROW(selfFeaturePairsWithin(a, bad, features), std::invalid_argument);
    EXPECT_THROW(vertexDistances(a, tf, b, tf, bad, numbers), std::invalid_argument);
    EXPECT_THROW(CoherentProximity(a, b).isNearer(tf, tf, bad), std::invalid_argument);
    ProximityRequest request;
    request.distance = bad;
    EXPECT_THROW(pairsWithin(a, tf, b, tf, request, pairs), std::invalid_argument);
  }
  EXPECT_THROW(closestPoint(a, fcl::Vector3d(0, nan, 0)), std::invalid_argument);
  EXPECT_THROW(firstHit(a, fcl::Vector3d(0, 0, 0), fcl::Vector3d(0, 0, 0)), std::invalid_argument);
  // A plate encloses nothing.
  EXPECT_THROW(signedVertexDistances(a, tf, b, tf, 1., numbers), std::invalid_argument);
  // All is within infinity.
  ProximityRequest all;
  all.distance = std::numeric_limits<double>::infinity();
  EXPECT_EQ(std::size_t(numTriangles(a)) * std::size_t(numTriangles(b)),
            pairsWithin(a, tf, b, tf, all, pairs));
}

}  // namespace proximity_test
}  // namespace adaptive_bvh_test
