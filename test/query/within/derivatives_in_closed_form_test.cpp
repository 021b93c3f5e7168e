// Derivatives of distances of features in closed form: in each region of a face, along parallel
// edges, and where features touch.
#include "query/within/distance_derivatives_test.h"

namespace adaptive_bvh_test {
namespace distance_derivatives {

class DerivativesInClosedForm : public DistanceDerivativesTest {};
// The plane of a face with its sides and corners, and two edges, in numbers that S has exactly.
TEST_F(DerivativesInClosedForm, AreThoseOfFormulasInEachRegion) {
  using V = fcl::Vector3d;
  const auto still = fcl::Transform3d(fcl::Transform3d::Identity());
  const std::vector<fcl::Triangle> one = {{0, 1, 2}};
  const DeformableMesh face({{0, 0, 0}, {4, 0, 0}, {0, 4, 0}}, one);
  struct Case {
    V x, normal;  ///< of the face's corners: the weights times the normal, from x to the face
    V weights;
  };
  const double r = std::sqrt(0.5);
  const Case cases[] = {
      {{1, 1, 2}, {0, 0, -1}, {0.5, 0.25, 0.25}}, {{1, 1, -2}, {0, 0, 1}, {0.5, 0.25, 0.25}},
      {{2, -3, 0}, {0, 1, 0}, {0.5, 0.5, 0}},     {{-3, 1, 4}, {0.6, 0, -0.8}, {0.75, 0, 0.25}},
      {{3, 3, 0}, {-r, -r, 0}, {0, 0.5, 0.5}},    {{-3, -4, 0}, {0.6, 0.8, 0}, {1, 0, 0}},
      {{7, 0, -4}, {-0.6, 0, 0.8}, {0, 1, 0}},    {{0, 4, 5}, {0, 0, -1}, {0, 0, 1}}};
  fcl::Transform3d turned = still;  // the face's frame is turned by a quarter about z
  turned.linear() << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  FeaturePairs pairs;
  pairs.vertex_face = {{0, 0}};
  FeaturePairDetails details;
  FeaturePairDerivatives g;
  for (const Case& c : cases)
    for (const fcl::Transform3d& tf : {still, turned}) {
      const DeformableMesh vertex({tf * c.x, {9, 9, 9}, {9, 8, 9}}, one);
      featurePairDetails(vertex, still, face, tf, pairs, details);
      distanceDerivatives(vertex, still, face, tf, pairs, details, g);
      const auto &first = g.vertex_face.first, &second = g.vertex_face.second;
      ASSERT_EQ(1u, first.per_distance);
      ASSERT_EQ(3u, second.per_distance);
      EXPECT_EQ(std::vector<unsigned>({0}), first.vertices);
      EXPECT_EQ(std::vector<unsigned>({0, 1, 2}), second.vertices);
      EXPECT_LE((first.gradients[0] + tf.linear() * c.normal).norm(), 1e-6);
      for (int k = 0; k < 3; ++k)
        EXPECT_LE((second.gradients[std::size_t(k)] - c.weights[k] * c.normal).norm(), 1e-6);
      EXPECT_EQ(0u, g.edge_edge.first.rows());
      EXPECT_EQ(2u, g.edge_edge.first.per_distance);
    }
}

// Along parallel edges many pairs of points are nearest: it is one of them.
TEST_F(DerivativesInClosedForm, OfParallelEdgesAreThoseOfOnePairOfPoints) {
  const auto still = fcl::Transform3d(fcl::Transform3d::Identity());
  const std::vector<fcl::Triangle> one = {{0, 1, 2}};
  FeaturePairs pairs;
  pairs.edge_edge = {{0, 0}};
  FeaturePairDetails details;
  FeaturePairDerivatives g;
  for (const double begin : {-3., 0., 1., 4.})  // they share a part, or the end of one
    for (const bool is_opposite : {false, true}) {
      fcl::Vector3d from(begin, 0, 2), to(begin + 4, 0, 2);
      if (is_opposite) std::swap(from, to);
      const DeformableMesh a({{0, 0, 0}, {4, 0, 0}, {0, -9, 0}}, one),
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
TEST_F(DerivativesInClosedForm, OfTouchingFeaturesAreThoseOfTheGap) {
  FeaturePairDetails details;
  FeaturePairDerivatives derivatives;
  long crossing = 0, touching = 0;
  for (int body = 0; body < manySteps(400) && !testing::Test::HasFailure(); ++body) {
    Model a(this->soupOf(6, true, false)), b(this->soupOf(6, true, false));
    const Bodies bodies(a, still(), b, still());
    const Displacements by = this->anyDisplacements(bodies);
    const FeaturePairs pairs = allPairs(a, b);
    featurePairDetails(a, still(), b, still(), pairs, details);
    distanceDerivatives(a, still(), b, still(), pairs, details, derivatives);
    const Real t = 1e-12, error = Real(1e-7);
    const Positions to = moved(bodies.at, by, bodies.to_first, t);
    forEachPair(
        pairs, details, derivatives,
        [&](FeatureKind kind, const FeaturePair& pair, const FeatureDetails& of_list,
            const DistanceDerivatives& g, std::size_t i) {
          if (bodies.distance(kind, pair, bodies.at) > Real(1e-20)) return;
          const fcl::Vector3d at = of_list.coordinates[i];
          bool is_inside = at.minCoeff() > 1e-3;
          if (kind == FeatureKind::EdgeEdge) {
            const auto e = adaptive_bvh::edgeVertices(a.triangles().data(), pair.first),
                       f = adaptive_bvh::edgeVertices(b.triangles().data(), pair.second);
            const fcl::Vector3d u = a.vertices()[e[1]] - a.vertices()[e[0]],
                                v = b.vertices()[f[1]] - b.vertices()[f[0]];
            const bool are_parallel = u.cross(v).norm() < 1e-3;
            if (are_parallel) return;  // many points touch, or one has many weights
            is_inside = at.head(2).minCoeff() > 1e-3 && at.head(2).maxCoeff() < double(1 - 1e-3);
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

}  // namespace distance_derivatives
}  // namespace adaptive_bvh_test
