// Derivatives of distances of features, against differences of distances in quadruple precision:
// the bound that holds for all motions, and slopes where the distance is smooth.
#include "query/within/distance_derivatives_test.h"

namespace adaptive_bvh_test {
namespace distance_derivatives {

class FeatureDerivatives : public DistanceDerivativesTest {};
TEST_F(FeatureDerivatives, NeverPromiseTooLittle) {
  FeaturePairDetails details;
  FeaturePairDerivatives derivatives;
  for (int body = 0; body < manySteps(60) && !testing::Test::HasFailure(); ++body) {
    const bool is_lattice = this->random_.oneIn(2);
    TriangleMesh one = this->soupOf(1 + this->random_.below(5), is_lattice, false),
                 other = this->soupOf(1 + this->random_.below(5), is_lattice, false);
    fcl::Transform3d tf1 = still(), tf2 = tf1;
    if (this->random_.oneIn(2)) {
      tf1 = this->random_.pose(1);
      tf2 = this->random_.pose(1);
    }
    const double scale = this->random_.oneIn(3) ? std::ldexp(1., this->random_.below(40) - 20) : 1.;
    for (TriangleMesh* mesh : {&one, &other})
      for (fcl::Vector3d& p : mesh->vertices) p *= scale;
    tf1.translation() *= scale;
    tf2.translation() *= scale;
    Model a(one), b(other);
    a.setThreads(1 + this->random_.below(3));
    const FeaturePairs pairs = allPairs(a, b);
    featurePairDetails(a, tf1, b, tf2, pairs, details);
    distanceDerivatives(a, tf1, b, tf2, pairs, details, derivatives);
    this->expectBound(Bodies(a, tf1, b, tf2), pairs, details, derivatives);
  }
  std::printf("%ld motions, up to %.2g of the rounding\n", this->bounds_, this->excess_);
}

TEST_F(FeatureDerivatives, AreSlopesWhereDistancesAreSmooth) {
  FeaturePairDetails details;
  FeaturePairDerivatives derivatives;
  for (int body = 0; body < manySteps(100) && !testing::Test::HasFailure(); ++body) {
    const bool is_lattice = this->random_.oneIn(2);
    Model a(this->soupOf(1 + this->random_.below(5), is_lattice, true)),
        b(this->soupOf(1 + this->random_.below(5), is_lattice, true));
    fcl::Transform3d tf1 = still(), tf2 = tf1;
    if (!is_lattice && this->random_.oneIn(2)) {
      tf1 = this->random_.pose(1);
      tf2 = this->random_.pose(1);
    }
    const FeaturePairs pairs = allPairs(a, b);
    featurePairDetails(a, tf1, b, tf2, pairs, details);
    distanceDerivatives(a, tf1, b, tf2, pairs, details, derivatives);
    this->expectSlopes(Bodies(a, tf1, b, tf2), pairs, details, derivatives);
  }
  std::printf("%ld smooth, %ld ties; largest error of a derivative, times d / X: %.2g\n",
              this->smooth_, this->ties_, this->worst_);
  EXPECT_GT(this->smooth_, 10 * this->ties_);
  EXPECT_GT(this->ties_, 100);
  EXPECT_LT(this->worst_, 1e-9);
}

TEST_F(FeatureDerivatives, AddUpToNoForceAndNoMoment) {
  FeaturePairDetails details;
  FeaturePairDerivatives derivatives;
  for (int body = 0; body < manySteps(40) && !testing::Test::HasFailure(); ++body) {
    const bool is_lattice = this->random_.oneIn(2);
    Model a(this->soupOf(3, is_lattice, false)), b(this->soupOf(3, is_lattice, false));
    const fcl::Transform3d tf1 = this->random_.pose(1), tf2 = this->random_.pose(1);
    const Bodies bodies(a, tf1, b, tf2);
    const FeaturePairs pairs = allPairs(a, b);
    featurePairDetails(a, tf1, b, tf2, pairs, details);
    distanceDerivatives(a, tf1, b, tf2, pairs, details, derivatives);
    forEachPair(
        pairs, details, derivatives,
        [&](FeatureKind, const FeaturePair&, const FeatureDetails&, const DistanceDerivatives& g,
            std::size_t i) { this->expectBalance(bodies, g.first, g.second, i); });
  }
}

TEST_F(FeatureDerivatives, OfOneMeshAreByItsOwnVertices) {
  TriangleMesh sheet = plate(6, 6);
  for (fcl::Vector3d& p : sheet.vertices) {  // rolled up, and uneven: no edges are parallel
    p = fcl::Vector3d(0.16 * std::sin(6 * p[0]), p[1],
                      double(0.16 + 0.05 * p[0]) * std::cos(6 * p[0]));
    p += this->random_.point() * 0.02;
  }
  const Model mesh(sheet);
  FeaturePairs pairs;
  selfFeaturePairsWithin(mesh, 0.2, pairs);
  FeaturePairDetails details;
  selfFeaturePairDetails(mesh, pairs, details);
  FeaturePairDerivatives g;
  selfDistanceDerivatives(mesh, pairs, details, g);
  EXPECT_GT(g.vertex_face.first.rows(), 20u);
  EXPECT_GT(g.edge_edge.first.rows(), 20u);
  EXPECT_EQ(0u, g.face_vertex.first.rows());
  const Bodies bodies(mesh, still(), mesh, still());
  this->expectBound(bodies, pairs, details, g);
  this->expectSlopes(bodies, pairs, details, g);
  EXPECT_GT(this->smooth_, 40);
}

}  // namespace distance_derivatives
}  // namespace adaptive_bvh_test
