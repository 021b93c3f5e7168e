// Derivatives of distances, against differences of distances in quadruple precision: the bound that
// holds for all motions, slopes where the distance is smooth, one-sided slopes at ties and touches.
#include <gtest/gtest.h>

#include "adaptive_bvh/coherent_distance.h"
#include "adaptive_bvh/distance_derivatives.h"
#include "adaptive_bvh/query.h"
#include "support/closed_bodies.h"
#include "support/lattice_features.h"
#include "support/random_geometry.h"
#include "support/test_mesh.h"

namespace adaptive_bvh_test {
namespace distance_derivatives_test {

using adaptive_bvh::DeformableMesh;
using adaptive_bvh::DistanceDerivatives;
using adaptive_bvh::FeatureDetails;
using adaptive_bvh::FeatureKind;
using adaptive_bvh::FeaturePair;
using adaptive_bvh::FeaturePairDerivatives;
using adaptive_bvh::FeaturePairDetails;
using adaptive_bvh::FeaturePairs;
using adaptive_bvh::VertexContacts;
using adaptive_bvh::VertexGradients;
using quad::Point;
using quad::Real;
using Points = std::vector<Point>;

template <typename S>
Points pointsOf(const std::vector<Vector3<S>>& vertices) {
  Points points;
  for (const Vector3<S>& x : vertices) points.push_back(quad::of<S>(x));
  return points;
}

/// The motion from the second mesh's frame to the first's.
struct ToFirst {
  template <typename S>
  ToFirst(const fcl::Transform3<S>& tf1, const fcl::Transform3<S>& tf2) {
    Point columns[3];
    for (int k = 0; k < 3; ++k) columns[k] = quad::of<S>(tf1.linear().col(k));
    const Point apart = quad::of<S>(tf2.translation()) - quad::of<S>(tf1.translation());
    T = {quad::dot(columns[0], apart), quad::dot(columns[1], apart), quad::dot(columns[2], apart)};
    for (int k = 0; k < 3; ++k) {
      const Point axis = quad::of<S>(tf2.linear().col(k));
      R[k] = {quad::dot(columns[0], axis), quad::dot(columns[1], axis),
              quad::dot(columns[2], axis)};
    }
  }
  Point turned(const Point& x) const { return x.x * R[0] + x.y * R[1] + x.z * R[2]; }
  Point operator()(const Point& x) const { return turned(x) + T; }

  Point R[3], T;  ///< R by columns
};

/// The positions of the vertices of two meshes, in the first's frame.
struct Positions {
  Points first, second;
};

/// Displacements of all vertices, each in the frame of its mesh.
struct Displacements {
  Points first, second;
};

Real largest(const Positions& positions) {
  Real size = 0;
  for (const Points* points : {&positions.first, &positions.second})
    for (const Point& x : *points) size = std::max(size, quad::size(x));
  return size;
}

Positions moved(const Positions& from, const Displacements& by, const ToFirst& to_first, Real t) {
  Positions to = from;
  for (std::size_t i = 0; i < to.first.size(); ++i) to.first[i] = to.first[i] + t * by.first[i];
  for (std::size_t i = 0; i < to.second.size(); ++i)
    to.second[i] = to.second[i] + t * to_first.turned(by.second[i]);
  return to;
}

/// By how much the entries of a row change the distance.
template <typename S>
Real changeOf(const VertexGradients<S>& gradients, std::size_t row, const Points& displacements) {
  Real sum = 0;
  const std::size_t count = gradients.per_distance;
  for (std::size_t i = row * count; i < (row + 1) * count; ++i)
    sum += quad::dot(quad::of<S>(gradients.gradients[i]), displacements[gradients.vertices[i]]);
  return sum;
}
template <typename S>
Real changeOf(const DistanceDerivatives<S>& g, std::size_t row, const Displacements& by) {
  return changeOf(g.first, row, by.first) + changeOf(g.second, row, by.second);
}

/// The length of a face's height over its longest side.
Real heightOf(const quad::Triangle& t) {
  Real longest = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const Point side = t[(k + 1) % 3] - t[k];
    longest = std::max(longest, quad::dot(side, side));
  }
  const Point area = quad::cross(t[1] - t[0], t[2] - t[0]);
  return longest > 0 ? quad::root(quad::dot(area, area) / longest) : Real(0);
}

/// Two meshes in their places, or one with itself, and distances of their features.
template <typename S>
class Bodies {
 public:
  Bodies(const DeformableMesh<S>& a, const fcl::Transform3<S>& tf1, const DeformableMesh<S>& b,
         const fcl::Transform3<S>& tf2)
      : first(a), second(b), to_first(tf1, tf2) {
    at.first = pointsOf(a.vertices());
    for (const Point& x : pointsOf(b.vertices())) at.second.push_back(to_first(x));
    size = std::max({largest(at), quad::size(to_first.T), Real(1e-300)});
    for (const Point& x : pointsOf(b.vertices())) size = std::max(size, quad::size(x));
    for (const Point& x : at.first) size = std::max(size, quad::size(x - to_first.T));
  }

  static quad::Triangle face(const DeformableMesh<S>& mesh, const Points& at, unsigned t) {
    const fcl::Triangle& v = mesh.triangles()[t];
    return {at[v[0]], at[v[1]], at[v[2]]};
  }
  Real distance(FeatureKind kind, const FeaturePair& p, const Positions& at) const {
    if (kind == FeatureKind::VertexFace)
      return quad::distance(at.first[p.first], face(second, at.second, p.second));
    if (kind == FeatureKind::FaceVertex)
      return quad::distance(at.second[p.second], face(first, at.first, p.first));
    const auto e = adaptive_bvh::edgeVertices(first.triangles().data(), p.first),
               f = adaptive_bvh::edgeVertices(second.triangles().data(), p.second);
    return adaptive_bvh_test::distance(at.first[e[0]], at.first[e[1]], at.second[f[0]],
                                       at.second[f[1]]);
  }
  Real distance(const Positions& at) const {
    Real least = 1e300;
    for (unsigned i = 0; i < unsigned(numTriangles(first)); ++i)
      for (unsigned j = 0; j < unsigned(numTriangles(second)); ++j)
        least =
            std::min(least, quad::distance(face(first, at.first, i), face(second, at.second, j)));
    return least;
  }
  Real distanceOfVertex(unsigned v, const Positions& at) const {
    Real least = 1e300;
    for (unsigned j = 0; j < unsigned(numTriangles(second)); ++j)
      least = std::min(least, quad::distance(at.first[v], face(second, at.second, j)));
    return least;
  }

  const DeformableMesh<S>&first, &second;
  const ToFirst to_first;
  Positions at;
  Real size;  ///< X of the bound
};

template <typename S>
class DistanceDerivativesTest : public testing::Test {
 protected:
  using Model = DeformableMesh<S>;
  using Transform = fcl::Transform3<S>;
  static constexpr bool kIsFloat = sizeof(S) == sizeof(float);
  static Transform still() { return Transform::Identity(); }

  /// Triangles with corners of their own. On a lattice many are thin, have parallel edges, or
  /// corners in common; else some are needles, segments and points.
  TriangleMesh<S> soupOf(int triangles, bool is_lattice, bool are_general) {
    TriangleMesh<S> mesh;
    for (std::size_t t = 0; t < std::size_t(triangles); ++t) {
      std::array<Vector3<S>, 3> corners = random_.triangleAt(random_.point(), S(0.7));
      for (Vector3<S>& p : corners) {
        if (are_general) p = random_.point();
        if (is_lattice)
          p = Vector3<S>(S(random_.below(4)), S(random_.below(4)), S(random_.below(3)));
        mesh.vertices.push_back(p);
      }
      mesh.triangles.emplace_back(3 * t, 3 * t + 1, 3 * t + 2);
    }
    return mesh;
  }
  static FeaturePairs allPairs(const Model& a, const Model& b) {
    FeaturePairs pairs;
    const auto fill = [&](int count1, int count2, std::vector<FeaturePair>& list) {
      for (int i = 0; i < count1; ++i)
        for (int j = 0; j < count2; ++j) list.push_back({unsigned(i), unsigned(j)});
    };
    fill(numVertices(a), numTriangles(b), pairs.vertex_face);
    fill(numTriangles(a), numVertices(b), pairs.face_vertex);
    fill(3 * numTriangles(a), 3 * numTriangles(b), pairs.edge_edge);
    return pairs;
  }

  /// Of length at most 1 each.
  Displacements anyDisplacements(const Bodies<S>& bodies) {
    const auto fill = [&](std::size_t count, Points& points) {
      for (std::size_t i = 0; i < count; ++i)
        points.push_back(quad::of<S>(Vector3<S>(random_.direction() * random_.uniform(0, 1))));
    };
    Displacements by;
    fill(bodies.at.first.size(), by.first);
    fill(bodies.at.second.size(), by.second);
    if (&bodies.first == &bodies.second) by.second = by.first;
    return by;
  }

  /// Of features nearer than that the normal is that of the surfaces.
  static bool isApart(Real d, Real size) { return d > Real(1e-8) * size; }

  /// For each kind of pairs: check(kind, pair, details, derivatives, row).
  template <typename Check>
  static void forEachPair(const FeaturePairs& pairs, const FeaturePairDetails<S>& details,
                          const FeaturePairDerivatives<S>& derivatives, const Check& check) {
    const auto run = [&](FeatureKind kind, const std::vector<FeaturePair>& list,
                         const FeatureDetails<S>& of_list, const DistanceDerivatives<S>& g) {
      ASSERT_EQ(list.size(), g.first.rows());
      ASSERT_EQ(list.size(), g.second.rows());
      for (std::size_t i = 0; i < list.size(); ++i) check(kind, list[i], of_list, g, i);
    };
    run(FeatureKind::VertexFace, pairs.vertex_face, details.vertex_face, derivatives.vertex_face);
    run(FeatureKind::FaceVertex, pairs.face_vertex, details.face_vertex, derivatives.face_vertex);
    run(FeatureKind::EdgeEdge, pairs.edge_edge, details.edge_edge, derivatives.edge_edge);
  }

  /// The bound of the distance after a motion by at most m.
  void expectBelow(Real after, Real d, Real m, Real change, Real size, Real more = 0) {
    const Real excess = after - d - change - Real(2.01) * m * m / d;
    const Real rounding = Real(0x1p-42) * (size + m * size / d) + more +
                          (kIsFloat ? Real(0x1p-20) * (d + m) : Real(0));
    EXPECT_LE(double(excess / rounding), 1) << "motion " << double(m / size);
    excess_ = std::max(excess_, double(excess / rounding));
    ++bounds_;
  }

  /// The bound, for motions from tiny to as large as the bodies.
  void expectBound(const Bodies<S>& bodies, const FeaturePairs& pairs,
                   const FeaturePairDetails<S>& details,
                   const FeaturePairDerivatives<S>& derivatives) {
    for (const double share : {1e-12, 1e-9, 1e-6, 1e-3, 0.1, 1.}) {
      const Displacements by = anyDisplacements(bodies);
      const Real m = Real(share) * bodies.size;
      const Positions to = moved(bodies.at, by, bodies.to_first, m);
      forEachPair(pairs, details, derivatives,
                  [&](FeatureKind kind, const FeaturePair& pair, const FeatureDetails<S>& of_list,
                      const DistanceDerivatives<S>& g, std::size_t i) {
                    const Real d = of_list.distances[i];
                    if (!isApart(d, bodies.size)) return;
                    expectBelow(bodies.distance(kind, pair, to), d, m, m * changeOf(g, i, by),
                                bodies.size);
                  });
    }
  }

  /// Slopes of both sides: the derivative where they agree, else it lies between both.
  void expectSlopes(const Bodies<S>& bodies, const FeaturePairs& pairs,
                    const FeaturePairDetails<S>& details,
                    const FeaturePairDerivatives<S>& derivatives) {
    const Displacements by = anyDisplacements(bodies);
    const Real t = Real(1e-12) * bodies.size;
    const Positions after = moved(bodies.at, by, bodies.to_first, t),
                    before = moved(bodies.at, by, bodies.to_first, -t);
    forEachPair(pairs, details, derivatives,
                [&](FeatureKind kind, const FeaturePair& pair, const FeatureDetails<S>& of_list,
                    const DistanceDerivatives<S>& g, std::size_t i) {
                  if (of_list.distances[i] < 1e-3 * double(bodies.size)) return;
                  expectSlope(
                      bodies.distance(kind, pair, before), bodies.distance(kind, pair, bodies.at),
                      bodies.distance(kind, pair, after), t, changeOf(g, i, by), bodies.size);
                });
  }
  void expectSlope(Real before, Real now, Real after, Real t, Real change, Real size) {
    const Real left = (now - before) / t, right = (after - now) / t;
    const Real error = (kIsFloat ? Real(4e-6) : Real(1e-12)) * (1 + size / now) + Real(1e-8);
    EXPECT_LE(double(right - change), double(error));
    EXPECT_GE(double(left - change), -double(error));
    if (left - right > Real(1e-4)) ++ties_;
    if (quad::absolute(left - right) > Real(1e-8)) return;
    ++smooth_;
    const Real off = quad::absolute((left + right) / 2 - change) * now / size;
    worst_ = std::max(worst_, double(off));
  }

  /// Turned to the world, gradients add up to zero, and so do their moments.
  void expectBalance(const Bodies<S>& bodies, const VertexGradients<S>& first,
                     const VertexGradients<S>& second, std::size_t row) {
    Point force = {0, 0, 0}, moment = {0, 0, 0};
    const auto add = [&](const VertexGradients<S>& g, const Points& at, bool is_turned) {
      for (std::size_t i = row * g.per_distance; i < (row + 1) * g.per_distance; ++i) {
        Point f = quad::of<S>(g.gradients[i]);
        if (is_turned) f = bodies.to_first.turned(f);
        force = force + f;
        moment = moment + quad::cross(at[g.vertices[i]], f);
      }
    };
    add(first, bodies.at.first, false);
    add(second, bodies.at.second, true);
    const Real unit = kIsFloat ? Real(0x1p-20) : Real(0x1p-48);
    EXPECT_LE(double(quad::size(force)), double(unit));
    EXPECT_LE(double(quad::size(moment) / bodies.size), double(4 * unit));
  }

  RandomGeometry<S> random_{5501};
  long bounds_ = 0, ties_ = 0, smooth_ = 0;
  double excess_ = 0;  ///< largest part of the bound's rounding that was needed
  double worst_ = 0;   ///< largest error of a derivative where it is smooth, times d / X
};

TYPED_TEST_SUITE(DistanceDerivativesTest, MeshScalars);

TYPED_TEST(DistanceDerivativesTest, NeverPromiseTooLittle) {
  using S = TypeParam;
  using Test = DistanceDerivativesTest<S>;
  FeaturePairDetails<S> details;
  FeaturePairDerivatives<S> derivatives;
  for (int body = 0; body < manySteps(60) && !testing::Test::HasFailure(); ++body) {
    const bool is_lattice = this->random_.oneIn(2);
    TriangleMesh<S> one = this->soupOf(1 + this->random_.below(5), is_lattice, false),
                    other = this->soupOf(1 + this->random_.below(5), is_lattice, false);
    fcl::Transform3<S> tf1 = Test::still(), tf2 = tf1;
    if (this->random_.oneIn(2)) {
      tf1 = this->random_.pose(1);
      tf2 = this->random_.pose(1);
    }
    const S scale = this->random_.oneIn(3) ? std::ldexp(S(1), this->random_.below(40) - 20) : S(1);
    for (TriangleMesh<S>* mesh : {&one, &other})
      for (Vector3<S>& p : mesh->vertices) p *= scale;
    tf1.translation() *= scale;
    tf2.translation() *= scale;
    typename Test::Model a(one), b(other);
    a.setQueryThreads(1 + this->random_.below(3));
    const FeaturePairs pairs = Test::allPairs(a, b);
    featurePairDetails(a, tf1, b, tf2, pairs, details);
    distanceDerivatives(a, tf1, b, tf2, pairs, details, derivatives);
    this->expectBound(Bodies<S>(a, tf1, b, tf2), pairs, details, derivatives);
  }
  std::printf("%ld motions, up to %.2g of the rounding\n", this->bounds_, this->excess_);
}

TYPED_TEST(DistanceDerivativesTest, AreSlopesWhereDistancesAreSmooth) {
  using S = TypeParam;
  using Test = DistanceDerivativesTest<S>;
  FeaturePairDetails<S> details;
  FeaturePairDerivatives<S> derivatives;
  for (int body = 0; body < manySteps(100) && !testing::Test::HasFailure(); ++body) {
    const bool is_lattice = this->random_.oneIn(2);
    typename Test::Model a(this->soupOf(1 + this->random_.below(5), is_lattice, true)),
        b(this->soupOf(1 + this->random_.below(5), is_lattice, true));
    fcl::Transform3<S> tf1 = Test::still(), tf2 = tf1;
    if (!is_lattice && this->random_.oneIn(2)) {
      tf1 = this->random_.pose(1);
      tf2 = this->random_.pose(1);
    }
    const FeaturePairs pairs = Test::allPairs(a, b);
    featurePairDetails(a, tf1, b, tf2, pairs, details);
    distanceDerivatives(a, tf1, b, tf2, pairs, details, derivatives);
    this->expectSlopes(Bodies<S>(a, tf1, b, tf2), pairs, details, derivatives);
  }
  std::printf("%ld smooth, %ld ties; largest error of a derivative, times d / X: %.2g\n",
              this->smooth_, this->ties_, this->worst_);
  EXPECT_GT(this->smooth_, 10 * this->ties_);
  EXPECT_GT(this->ties_, 100);
  EXPECT_LT(this->worst_, Test::kIsFloat ? 1e-4 : 1e-9);
}

TYPED_TEST(DistanceDerivativesTest, AddUpToNoForceAndNoMoment) {
  using S = TypeParam;
  using Test = DistanceDerivativesTest<S>;
  FeaturePairDetails<S> details;
  FeaturePairDerivatives<S> derivatives;
  for (int body = 0; body < manySteps(40) && !testing::Test::HasFailure(); ++body) {
    const bool is_lattice = this->random_.oneIn(2);
    typename Test::Model a(this->soupOf(3, is_lattice, false)),
        b(this->soupOf(3, is_lattice, false));
    const fcl::Transform3<S> tf1 = this->random_.pose(1), tf2 = this->random_.pose(1);
    const Bodies<S> bodies(a, tf1, b, tf2);
    const FeaturePairs pairs = Test::allPairs(a, b);
    featurePairDetails(a, tf1, b, tf2, pairs, details);
    distanceDerivatives(a, tf1, b, tf2, pairs, details, derivatives);
    Test::forEachPair(pairs, details, derivatives,
                      [&](FeatureKind, const FeaturePair&, const FeatureDetails<S>&,
                          const DistanceDerivatives<S>& g,
                          std::size_t i) { this->expectBalance(bodies, g.first, g.second, i); });
  }
}

// The plane of a face with its sides and corners, and two edges, in numbers that S has exactly.
TYPED_TEST(DistanceDerivativesTest, AreThoseOfFormulasInEachRegion) {
  using S = TypeParam;
  using V = Vector3<S>;
  const auto still = fcl::Transform3<S>(fcl::Transform3<S>::Identity());
  const std::vector<fcl::Triangle> one = {{0, 1, 2}};
  const DeformableMesh<S> face({{0, 0, 0}, {4, 0, 0}, {0, 4, 0}}, one);
  struct Case {
    V x, normal;  ///< of the face's corners: the weights times the normal, from x to the face
    V weights;
  };
  const S r = std::sqrt(S(0.5));
  const Case cases[] = {{{1, 1, 2}, {0, 0, -1}, {S(0.5), S(0.25), S(0.25)}},
                        {{1, 1, -2}, {0, 0, 1}, {S(0.5), S(0.25), S(0.25)}},
                        {{2, -3, 0}, {0, 1, 0}, {S(0.5), S(0.5), 0}},
                        {{-3, 1, 4}, {S(0.6), 0, S(-0.8)}, {S(0.75), 0, S(0.25)}},
                        {{3, 3, 0}, {-r, -r, 0}, {0, S(0.5), S(0.5)}},
                        {{-3, -4, 0}, {S(0.6), S(0.8), 0}, {1, 0, 0}},
                        {{7, 0, -4}, {S(-0.6), 0, S(0.8)}, {0, 1, 0}},
                        {{0, 4, 5}, {0, 0, -1}, {0, 0, 1}}};
  fcl::Transform3<S> turned = still;  // the face's frame is turned by a quarter about z
  turned.linear() << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  FeaturePairs pairs;
  pairs.vertex_face = {{0, 0}};
  FeaturePairDetails<S> details;
  FeaturePairDerivatives<S> g;
  for (const Case& c : cases)
    for (const fcl::Transform3<S>& tf : {still, turned}) {
      const DeformableMesh<S> vertex({tf * c.x, {9, 9, 9}, {9, 8, 9}}, one);
      featurePairDetails(vertex, still, face, tf, pairs, details);
      distanceDerivatives(vertex, still, face, tf, pairs, details, g);
      const auto &first = g.vertex_face.first, &second = g.vertex_face.second;
      ASSERT_EQ(1u, first.per_distance);
      ASSERT_EQ(3u, second.per_distance);
      EXPECT_EQ(std::vector<unsigned>({0}), first.vertices);
      EXPECT_EQ(std::vector<unsigned>({0, 1, 2}), second.vertices);
      EXPECT_LE((first.gradients[0] + tf.linear() * c.normal).norm(), S(1e-6));
      for (int k = 0; k < 3; ++k)
        EXPECT_LE((second.gradients[std::size_t(k)] - c.weights[k] * c.normal).norm(), S(1e-6));
      EXPECT_EQ(0u, g.edge_edge.first.rows());
      EXPECT_EQ(2u, g.edge_edge.first.per_distance);
    }
}

// Along parallel edges many pairs of points are nearest: it is one of them.
TYPED_TEST(DistanceDerivativesTest, OfParallelEdgesAreThoseOfOnePairOfPoints) {
  using S = TypeParam;
  const auto still = fcl::Transform3<S>(fcl::Transform3<S>::Identity());
  const std::vector<fcl::Triangle> one = {{0, 1, 2}};
  FeaturePairs pairs;
  pairs.edge_edge = {{0, 0}};
  FeaturePairDetails<S> details;
  FeaturePairDerivatives<S> g;
  for (const S begin : {S(-3), S(0), S(1), S(4)})  // they share a part, or the end of one
    for (const bool is_opposite : {false, true}) {
      Vector3<S> from(begin, 0, 2), to(begin + 4, 0, 2);
      if (is_opposite) std::swap(from, to);
      const DeformableMesh<S> a({{0, 0, 0}, {4, 0, 0}, {0, -9, 0}}, one),
          b({from, to, {0, -9, 9}}, one);
      featurePairDetails(a, still, b, still, pairs, details);
      distanceDerivatives(a, still, b, still, pairs, details, g);
      const auto &p = g.edge_edge.first.gradients, &q = g.edge_edge.second.gradients;
      ASSERT_EQ(2u, p.size());
      ASSERT_EQ(2u, q.size());
      for (std::size_t k = 0; k < 2; ++k) {
        EXPECT_TRUE(p[k][0] == 0 && p[k][1] == 0 && p[k][2] <= 0 && p[k][2] >= -1) << p[k];
        EXPECT_TRUE(q[k][0] == 0 && q[k][1] == 0 && q[k][2] >= 0 && q[k][2] <= 1) << q[k];
      }
      EXPECT_NEAR(-1, double(p[0][2] + p[1][2]), 1e-6);
      EXPECT_NEAR(1, double(q[0][2] + q[1][2]), 1e-6);
      EXPECT_NEAR(double(-4 * p[1][2]), double(q[0][2] * from[0] + q[1][2] * to[0]), 1e-5);
    }
}

// On a lattice: slopes to the side of the motion.
TYPED_TEST(DistanceDerivativesTest, OfTouchingFeaturesAreThoseOfTheGap) {
  using S = TypeParam;
  using Test = DistanceDerivativesTest<S>;
  FeaturePairDetails<S> details;
  FeaturePairDerivatives<S> derivatives;
  long crossing = 0, touching = 0;
  for (int body = 0; body < manySteps(400) && !testing::Test::HasFailure(); ++body) {
    typename Test::Model a(this->soupOf(6, true, false)), b(this->soupOf(6, true, false));
    const Bodies<S> bodies(a, Test::still(), b, Test::still());
    const Displacements by = this->anyDisplacements(bodies);
    const FeaturePairs pairs = Test::allPairs(a, b);
    featurePairDetails(a, Test::still(), b, Test::still(), pairs, details);
    distanceDerivatives(a, Test::still(), b, Test::still(), pairs, details, derivatives);
    const Real t = 1e-12, error = Test::kIsFloat ? Real(1e-5) : Real(1e-7);
    const Positions to = moved(bodies.at, by, bodies.to_first, t);
    Test::forEachPair(
        pairs, details, derivatives,
        [&](FeatureKind kind, const FeaturePair& pair, const FeatureDetails<S>& of_list,
            const DistanceDerivatives<S>& g, std::size_t i) {
          if (bodies.distance(kind, pair, bodies.at) > Real(1e-20)) return;
          const Vector3<S> at = of_list.coordinates[i];
          bool is_inside = at.minCoeff() > S(1e-3);
          if (kind == FeatureKind::EdgeEdge) {
            const auto e = adaptive_bvh::edgeVertices(a.triangles().data(), pair.first),
                       f = adaptive_bvh::edgeVertices(b.triangles().data(), pair.second);
            const Vector3<S> u = a.vertices()[e[1]] - a.vertices()[e[0]],
                             v = b.vertices()[f[1]] - b.vertices()[f[0]];
            const bool are_parallel = u.cross(v).norm() < S(1e-3);
            if (are_parallel) return;  // many points touch, or one has many weights
            is_inside = at.head(2).minCoeff() > S(1e-3) && at.head(2).maxCoeff() < S(1 - 1e-3);
          }
          const Real slope = bodies.distance(kind, pair, to) / t, change = changeOf(g, i, by);
          EXPECT_GE(double(slope - change), -double(error)) << "kind " << int(kind);
          ++touching;
          if (!is_inside || of_list.normals[i].isZero(0)) return;
          EXPECT_NEAR(double(quad::absolute(change)), double(slope), double(error));
          ++crossing;
        });
  }
  std::printf("%ld pairs touch, %ld cross\n", touching, crossing);
  EXPECT_GT(crossing, 50);
}

TYPED_TEST(DistanceDerivativesTest, OfOneMeshAreByItsOwnVertices) {
  using S = TypeParam;
  using Test = DistanceDerivativesTest<S>;
  TriangleMesh<S> sheet = plate<S>(6, 6);
  for (Vector3<S>& p : sheet.vertices) {  // rolled up, and uneven: no edges are parallel
    p = Vector3<S>(S(0.16) * std::sin(6 * p[0]), p[1], S(0.16 + 0.05 * p[0]) * std::cos(6 * p[0]));
    p += this->random_.point() * S(0.02);
  }
  const typename Test::Model mesh(sheet);
  FeaturePairs pairs;
  featurePairsWithin(mesh, S(0.2), pairs);
  FeaturePairDetails<S> details;
  featurePairDetails(mesh, pairs, details);
  FeaturePairDerivatives<S> g;
  distanceDerivatives(mesh, pairs, details, g);
  EXPECT_GT(g.vertex_face.first.rows(), 20u);
  EXPECT_GT(g.edge_edge.first.rows(), 20u);
  EXPECT_EQ(0u, g.face_vertex.first.rows());
  const Bodies<S> bodies(mesh, Test::still(), mesh, Test::still());
  this->expectBound(bodies, pairs, details, g);
  this->expectSlopes(bodies, pairs, details, g);
  EXPECT_GT(this->smooth_, 40);
}

TYPED_TEST(DistanceDerivativesTest, OfTwoMeshesAreThoseOfTheirNearestTriangles) {
  using S = TypeParam;
  using Test = DistanceDerivativesTest<S>;
  long touching = 0;
  DistanceDerivatives<S> g, again;
  for (int body = 0; body < manySteps(40) && !testing::Test::HasFailure(); ++body) {
    const bool is_lattice = this->random_.oneIn(2);
    TriangleMesh<S> one = this->soupOf(4, is_lattice, true),
                    other = this->soupOf(4, is_lattice, true);
    typename Test::Model a(one), b(other);
    adaptive_bvh::CoherentDistance<S> pair(a, b);
    for (int step = 0; step < 3; ++step) {
      for (Vector3<S>& p : one.vertices)
        p += is_lattice ? Vector3<S>(S(step), 0, 0) : Vector3<S>(this->random_.point() * S(0.1));
      a.update(one.vertices);
      fcl::Transform3<S> tf1 = Test::still(), tf2 = tf1;
      tf2.translation() = Vector3<S>(0, 0, S(this->random_.below(5)));
      if (!is_lattice && !Test::kIsFloat) tf1 = this->random_.pose(1);
      fcl::DistanceResult<S> result, plain;
      pair.distance(tf1, tf2, fcl::DistanceRequest<S>(), result);
      distanceDerivatives(a, tf1, b, tf2, result, g);
      adaptive_bvh::distance<S>(&a, tf1, &b, tf2, fcl::DistanceRequest<S>(true), plain);
      distanceDerivatives(a, tf1, b, tf2, plain, again);
      EXPECT_EQ(1u, g.first.rows());
      EXPECT_EQ(3u, g.second.per_distance);
      if (plain.b1 == result.b1 && plain.b2 == result.b2) {
        EXPECT_EQ(again.first.gradients, g.first.gradients);
        EXPECT_EQ(again.second.gradients, g.second.gradients);
      }
      const Bodies<S> bodies(a, tf1, b, tf2);
      const Real d = result.min_distance;
      if (d == 0) {
        for (const auto* of : {&g.first, &g.second})
          for (const Vector3<S>& gradient : of->gradients) EXPECT_TRUE(gradient.isZero(0));
        ++touching;
      }
      if (!Test::isApart(d, bodies.size)) continue;
      this->expectBalance(bodies, g.first, g.second, 0);
      const Displacements by = this->anyDisplacements(bodies);
      for (const double share : {1e-12, 1e-9, 1e-6, 1e-3, 0.1}) {
        const Real m = Real(share) * bodies.size;
        this->expectBelow(bodies.distance(moved(bodies.at, by, bodies.to_first, m)), d, m,
                          m * changeOf(g, 0, by), bodies.size);
      }
      const Real t = Real(1e-12) * bodies.size;
      if (d < 1e-3 * double(bodies.size)) continue;
      this->expectSlope(bodies.distance(moved(bodies.at, by, bodies.to_first, -t)),
                        bodies.distance(bodies.at),
                        bodies.distance(moved(bodies.at, by, bodies.to_first, t)), t,
                        changeOf(g, 0, by), bodies.size);
    }
  }
  std::printf("%ld smooth, %ld ties, %ld touch; largest error %.2g\n", this->smooth_, this->ties_,
              touching, this->worst_);
  EXPECT_GT(this->smooth_, 20);
  EXPECT_GT(this->ties_, 0);
  EXPECT_GT(touching, 5);
}

TYPED_TEST(DistanceDerivativesTest, OfContactsAreThoseOfSignedDistances) {
  using S = TypeParam;
  using Test = DistanceDerivativesTest<S>;
  VertexContacts<S> contacts;
  DistanceDerivatives<S> g;
  long inside = 0;
  for (int body = 0; body < manySteps(12) && !testing::Test::HasFailure(); ++body) {
    typename Test::Model a(body % 2 ? latticeBox<S>(2) : gridBall<S>(7, 4)),
        b(body % 3 ? gridBall<S>(8, 5) : latticeBox<S>(1));
    fcl::Transform3<S> tf = Test::still(), other_tf = tf;
    if (!Test::kIsFloat) {
      tf = this->random_.pose(1);
      other_tf = this->random_.pose(1);
    }
    tf.translation() = this->random_.point() * S(0.7);
    vertexContacts(a, tf, b, other_tf, std::numeric_limits<S>::infinity(), contacts);
    distanceDerivatives(a, tf, b, other_tf, contacts, g);
    ASSERT_EQ(contacts.size(), g.first.rows());
    const Bodies<S> bodies(a, tf, b, other_tf);
    const Displacements by = this->anyDisplacements(bodies);
    const Real t = Real(1e-12) * bodies.size;
    const Positions after = moved(bodies.at, by, bodies.to_first, t),
                    before = moved(bodies.at, by, bodies.to_first, -t);
    for (std::size_t i = 0; i < contacts.size(); ++i) {
      EXPECT_EQ(contacts.vertices[i], g.first.vertices[i]);
      this->expectBalance(bodies, g.first, g.second, i);
      const Real sign = contacts.distances[i] < 0 ? -1 : 1, d = sign * contacts.distances[i];
      if (!Test::isApart(d, bodies.size)) continue;
      inside += sign < 0;
      const unsigned v = contacts.vertices[i];
      const quad::Triangle face =
          Bodies<S>::face(b, bodies.at.second, unsigned(contacts.triangles[i]));
      const Real change = sign * changeOf(g, i, by);
      for (const double share : {1e-12, 1e-6, 1e-2}) {
        const Real m = Real(share) * bodies.size;
        const Positions to = moved(bodies.at, by, bodies.to_first, m);
        this->expectBelow(bodies.distanceOfVertex(v, to), d, m, m * change, bodies.size,
                          Real(0x1p-46) * m * bodies.size / heightOf(face));
      }
      if (d < 1e-3 * double(bodies.size)) continue;
      this->expectSlope(bodies.distanceOfVertex(v, before), bodies.distanceOfVertex(v, bodies.at),
                        bodies.distanceOfVertex(v, after), t, change, bodies.size);
    }
  }
  std::printf("%ld smooth, %ld ties, %ld inside; largest error %.2g\n", this->smooth_, this->ties_,
              inside, this->worst_);
  EXPECT_GT(inside, 20);
  EXPECT_GT(this->smooth_, 100);
}

TYPED_TEST(DistanceDerivativesTest, OfContactsOnTheSurfaceAndWithShapes) {
  using S = TypeParam;
  using Test = DistanceDerivativesTest<S>;
  const typename Test::Model box(latticeBox<S>(2));
  fcl::Transform3<S> tf = Test::still(), turned = tf;
  tf.translation() = Vector3<S>(S(0.5), S(0.25), 2);  // stands on the other box
  turned.linear() << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  turned.translation() = Vector3<S>(2, 0, 0);
  VertexContacts<S> contacts;
  DistanceDerivatives<S> g, same;
  vertexContacts(box, tf, box, turned, S(0), contacts);
  EXPECT_GT(contacts.size(), 3u);
  distanceDerivatives(box, tf, box, turned, contacts, g);
  distanceDerivatives(box, tf, static_cast<const fcl::CollisionGeometry<S>&>(box), turned, contacts,
                      same);
  EXPECT_EQ(g.second.gradients, same.second.gradients);
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    EXPECT_EQ(0, contacts.distances[i]);
    if (contacts.barycentric[i].minCoeff() < S(0.01)) continue;  // on a side
    const Vector3<S> up = Vector3<S>::UnitZ();
    EXPECT_LE((g.first.gradients[i] - up).norm(), S(1e-6));
    for (std::size_t k = 0; k < 3; ++k) {
      const S weight = contacts.barycentric[i][int(k)];
      EXPECT_LE((g.second.gradients[3 * i + k] + weight * up).norm(), S(1e-6));
    }
  }
  const fcl::Sphere<S> ball(S(1));
  const fcl::Transform3<S> pose = this->random_.pose(1);
  vertexContacts(box, tf, ball, pose, S(9), contacts);
  distanceDerivatives(box, tf, ball, pose, contacts, g);
  ASSERT_EQ(box.vertices().size(), g.first.rows());
  EXPECT_EQ(0u, g.second.rows());
  EXPECT_EQ(0u, g.second.gradients.size());
  for (std::size_t i = 0; i < contacts.size(); ++i)
    EXPECT_LE(
        (g.first.gradients[i] - (contacts.positions[i] - pose.translation()).normalized()).norm(),
        S(1e-5));
}

TYPED_TEST(DistanceDerivativesTest, RefuseWhatDoesNotFit) {
  using S = TypeParam;
  using Test = DistanceDerivativesTest<S>;
  const auto still = Test::still();
  const typename Test::Model mesh(latticeBox<S>(1));
  fcl::Transform3<S> scaled = still;
  scaled.linear() *= S(2);
  FeaturePairs pairs;
  pairs.vertex_face = {{0, 0}};
  pairs.edge_edge = {{0, 5}};
  FeaturePairDetails<S> details;
  featurePairDetails(mesh, pairs, details);
  FeaturePairDerivatives<S> g;
  g.edge_edge.first.resize(7, 2);
  const auto refuses = [&](const auto& call) {
    EXPECT_THROW(call(), std::invalid_argument);
    EXPECT_EQ(7u, g.edge_edge.first.rows());
  };
  refuses([&] { distanceDerivatives(mesh, scaled, mesh, still, pairs, details, g); });
  refuses([&] { distanceDerivatives(mesh, still, mesh, scaled, pairs, details, g); });
  FeaturePairs wrong = pairs;
  wrong.edge_edge[0].second = 36;
  refuses([&] { distanceDerivatives(mesh, wrong, details, g); });
  wrong.edge_edge.clear();
  refuses([&] { distanceDerivatives(mesh, wrong, details, g); });
  FeaturePairDetails<S> shorter = details;
  shorter.vertex_face.coordinates.clear();
  refuses([&] { distanceDerivatives(mesh, pairs, shorter, g); });

  VertexContacts<S> contacts;
  vertexContacts(mesh, still, mesh, still, S(0), contacts);
  DistanceDerivatives<S> of_contacts;
  of_contacts.first.resize(5, 1);
  const auto refusesContacts = [&](const VertexContacts<S>& bad) {
    EXPECT_THROW(distanceDerivatives(mesh, still, mesh, still, bad, of_contacts),
                 std::invalid_argument);
    EXPECT_EQ(5u, of_contacts.first.rows());
  };
  VertexContacts<S> bad = contacts;
  bad.vertices[1] = 8;
  refusesContacts(bad);
  bad = contacts;
  bad.triangles[1] = -1;
  refusesContacts(bad);
  bad = contacts;
  bad.normals.pop_back();
  refusesContacts(bad);
  const fcl::Box<S> shape(1, 1, 1);
  EXPECT_THROW(distanceDerivatives(mesh, still, shape, still, bad, of_contacts),
               std::invalid_argument);

  fcl::DistanceResult<S> nearest;  // which names no triangles
  EXPECT_THROW(distanceDerivatives(mesh, still, mesh, still, nearest, of_contacts),
               std::invalid_argument);
  nearest.b1 = 3;
  nearest.b2 = 12;
  EXPECT_THROW(distanceDerivatives(mesh, still, mesh, still, nearest, of_contacts),
               std::invalid_argument);
  EXPECT_EQ(5u, of_contacts.first.rows());
}

}  // namespace distance_derivatives_test
}  // namespace adaptive_bvh_test
