// Derivatives of distances of two meshes, and of vertices in contact with a mesh or a shape,
// against differences of distances in quadruple precision; and what is refused.
#include "adaptive_bvh/coherent_distance.h"
#include "adaptive_bvh/query.h"
#include "query/within/distance_derivatives_test.h"

namespace adaptive_bvh_test {
namespace distance_derivatives {

template <typename S>
class DerivativesOfMeshes : public DistanceDerivativesTest<S> {};
TYPED_TEST_SUITE(DerivativesOfMeshes, MeshScalars);

TYPED_TEST(DerivativesOfMeshes, OfTwoMeshesAreThoseOfTheirNearestTriangles) {
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

TYPED_TEST(DerivativesOfMeshes, OfContactsAreThoseOfSignedDistances) {
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

TYPED_TEST(DerivativesOfMeshes, OfContactsOnTheSurfaceAndWithShapes) {
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

TYPED_TEST(DerivativesOfMeshes, RefuseWhatDoesNotFit) {
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

}  // namespace distance_derivatives
}  // namespace adaptive_bvh_test
