// Derivatives of distances of features, against differences of distances in quadruple precision:
// the bound that holds for all motions, and slopes where the distance is smooth.
#include "query/within/distance_derivatives_test.h"

namespace adaptive_bvh_test {
namespace distance_derivatives {

template <typename S>
class FeatureDerivatives : public DistanceDerivativesTest<S> {};
TYPED_TEST_SUITE(FeatureDerivatives, MeshScalars);

TYPED_TEST(FeatureDerivatives, NeverPromiseTooLittle) {
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

TYPED_TEST(FeatureDerivatives, AreSlopesWhereDistancesAreSmooth) {
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

TYPED_TEST(FeatureDerivatives, AddUpToNoForceAndNoMoment) {
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

TYPED_TEST(FeatureDerivatives, OfOneMeshAreByItsOwnVertices) {
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

}  // namespace distance_derivatives
}  // namespace adaptive_bvh_test
