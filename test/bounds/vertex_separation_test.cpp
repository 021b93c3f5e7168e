// VertexSeparation against the distances of all triangles below two nodes in long double.
#include "query/vertex_separation.h"

#include <gtest/gtest.h>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "model_state.h"
#include "support/exact_geometry.h"
#include "support/random_geometry.h"

namespace adaptive_bvh_test {
namespace vertex_separation_test {

using adaptive_bvh::AdaptiveBVHModel;
using adaptive_bvh::PlacedMesh;
using adaptive_bvh::VertexSeparation;
using exact::Real;

template <typename S>
class Vertices : public testing::Test {
 protected:
  using BV = fcl::RSS<S>;
  using Model = AdaptiveBVHModel<BV>;
  using P = Vector3<S>;

  static PlacedMesh<BV> placed(const Model& model) {
    return {&model, &adaptive_bvh::detail::ModelAccess<BV>::tree(model),
            fcl::Transform3<S>::Identity()};
  }
  static void trianglesBelow(const Model& model, int node, std::vector<exact::Triangle>& all) {
    const auto& bv = model.getBV(node);
    if (!bv.isLeaf()) {
      trianglesBelow(model, bv.leftChild(), all);
      trianglesBelow(model, bv.rightChild(), all);
      return;
    }
    const fcl::Triangle& t = model.tri_indices[bv.primitiveId()];
    all.push_back({exact::of(model.vertices[t[0]]), exact::of(model.vertices[t[1]]),
                   exact::of(model.vertices[t[2]])});
  }
  /// Of what is below two nodes, by the placement that FCL takes.
  static Real distance(const Model& a, int node1, const Model& b, int node2,
                       const fcl::Matrix3<S>& R, const P& T) {
    std::vector<exact::Triangle> below1, below2;
    trianglesBelow(a, node1, below1);
    trianglesBelow(b, node2, below2);
    const exact::Placement to_first{exact::of(R), exact::of(T)};
    Real least = std::numeric_limits<Real>::max();
    for (const auto& q : below2)
      for (const auto& p : below1) least = std::min(least, exact::distance(p, to_first(q)));
    return least;
  }
  /// What double precision may round off.
  static Real error(const Model& a, const Model& b, const P& T) {
    Real sum = exact::of(T).template lpNorm<1>();
    for (const Model* m : {&a, &b})
      sum += exact::of(m->aabb_center).template lpNorm<1>() + Real(m->aabb_radius);
    return 8 * Real(std::numeric_limits<double>::epsilon()) * sum;
  }

  RandomGeometry<S> random_{5};
};

using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(Vertices, Scalars);

/// Meshes of any shape, any two nodes, any line: what is returned is a lower bound.
TYPED_TEST(Vertices, NeverExceedTheDistance) {
  using S = TypeParam;
  int found = 0;
  for (int round = 0; round < 60; ++round) {
    typename TestFixture::Model a, b;
    fillModel(round % 2 ? plate<S>(4, 3) : tube<S>(4, 3), a);
    fillModel(round % 3 ? plate<S>(3, 4) : soup<S>(20, this->random_.engine()), b);
    for (auto* model : {&a, &b}) model->computeLocalAABB();
    const fcl::Matrix3<S> R = this->random_.rotation();
    const Vector3<S> T = this->random_.vectorOfSize(S(round % 4));
    const auto first = this->placed(a), second = this->placed(b);
    VertexSeparation<fcl::RSS<S>> separation(first, second, R, T);
    for (int k = 0; k < 12; ++k) {
      const int node1 = this->random_.below(a.getNumBVs()),
                node2 = k ? this->random_.below(b.getNumBVs()) : 0;
      const Real d = this->distance(a, node1, b, node2, R, T);
      for (const double enough : {0., double(d) * 0.5, double(d) * 0.99, double(d) * 1.5}) {
        const double bound = separation(node1, node2, this->random_.direction(), enough);
        ASSERT_LE(Real(bound), d + this->error(a, b, T)) << round << ' ' << k;
        found += bound >= enough && enough > 0;
      }
    }
  }
  EXPECT_GT(found, 200) << "-infinity would be a lower bound, too";
}

/// Plates that lie parallel, turned in any way and far from the origin: the separation is their
/// distance, but for rounding, without a line that would help.
TYPED_TEST(Vertices, OfParallelPlatesAreTheirDistance) {
  using S = TypeParam;
  for (int round = 0; round < 40; ++round) {
    const fcl::Matrix3<S> turn = this->random_.rotation();
    TriangleMesh<S> low = plate<S>(5, 4, 2, 1), high = plate<S>(3, 6, 1, 1);
    const S gap = this->random_.size(-2, 1);
    for (auto& p : low.vertices) p = turn * p;
    for (auto& p : high.vertices) p = turn * (p + Vector3<S>(S(0.3), S(0.2), gap));
    typename TestFixture::Model a, b;
    fillModel(low, a);
    fillModel(high, b);
    for (auto* model : {&a, &b}) model->computeLocalAABB();
    const auto first = this->placed(a), second = this->placed(b);
    VertexSeparation<fcl::RSS<S>> separation(first, second, fcl::Matrix3<S>::Identity(),
                                             Vector3<S>::Zero());
    const double slack = 16 * double(std::numeric_limits<S>::epsilon()) * (2 + double(gap));
    EXPECT_GE(separation(0, 0, Vector3<S>::Zero(), double(gap) - slack), double(gap) - slack);
    EXPECT_GT(separation.read(), 30 + 28);
    const long before = separation.read();
    EXPECT_LT(separation(0, 0, Vector3<S>::Zero(), 2 * double(gap)), double(gap) + slack);
    EXPECT_LT(separation.read() - before, 100) << "the samples say that it is in vain";
  }
}

}  // namespace vertex_separation_test
}  // namespace adaptive_bvh_test
