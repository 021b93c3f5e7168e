// Derivatives of distances of two meshes, and of vertices in contact with a mesh or a shape,
// against differences of distances in quadruple precision; and what is refused.
#include "adaptive_bvh/coherent_distance.h"
#include "adaptive_bvh/query.h"
#include "query/within/distance_derivatives_test.h"

namespace adaptive_bvh_test {
namespace distance_derivatives {

class DerivativesOfMeshes : public DistanceDerivativesTest {};
TEST_F(DerivativesOfMeshes, OfTwoMeshesAreThoseOfTheirNearestTriangles) {
  long touching = 0;
  DistanceDerivatives g, again;
  for (int body = 0; body < manySteps(40) && !testing::Test::HasFailure(); ++body) {
    const bool is_lattice = this->random_.oneIn(2);
    TriangleMesh one = this->soupOf(4, is_lattice, true), other = this->soupOf(4, is_lattice, true);
    Model a(one), b(other);
    adaptive_bvh::CoherentDistance pair(a, b);
    for (int step = 0; step < 3; ++step) {
      for (fcl::Vector3d& p : one.vertices)
        p += is_lattice ? fcl::Vector3d(double(step), 0, 0)
                        : fcl::Vector3d(this->random_.point() * 0.1);
      a.update(one.vertices);
      fcl::Transform3d tf1 = still(), tf2 = tf1;
      tf2.translation() = fcl::Vector3d(0, 0, double(this->random_.below(5)));
      if (!is_lattice) tf1 = this->random_.pose(1);
      fcl::DistanceResultd result, plain;
      pair.distance(tf1, tf2, fcl::DistanceRequestd(), result);
      distanceDerivatives(a, tf1, b, tf2, result, g);
      adaptive_bvh::distance(&a, tf1, &b, tf2, fcl::DistanceRequestd(true), plain);
      distanceDerivatives(a, tf1, b, tf2, plain, again);
      EXPECT_EQ(1u, g.first.rows());
      EXPECT_EQ(3u, g.second.per_distance);
      if (plain.b1 == result.b1 && plain.b2 == result.b2) {
        EXPECT_EQ(again.first.gradients, g.first.gradients);
        EXPECT_EQ(again.second.gradients, g.second.gradients);
      }
      const Bodies bodies(a, tf1, b, tf2);
      const Real d = result.min_distance;
      if (d == 0) {
        for (const auto* of : {&g.first, &g.second})
          for (const fcl::Vector3d& gradient : of->gradients) EXPECT_TRUE(gradient.isZero(0));
        ++touching;
      }
      if (!isApart(d, bodies.size)) continue;
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

TEST_F(DerivativesOfMeshes, OfContactsAreThoseOfSignedDistances) {
  VertexContacts contacts;
  DistanceDerivatives g;
  long inside = 0;
  for (int body = 0; body < manySteps(12) && !testing::Test::HasFailure(); ++body) {
    Model a(body % 2 ? latticeBox(2) : gridBall(7, 4)),
        b(body % 3 ? gridBall(8, 5) : latticeBox(1));
    fcl::Transform3d tf = still(), other_tf = tf;
    tf = this->random_.pose(1);
    other_tf = this->random_.pose(1);
    tf.translation() = this->random_.point() * 0.7;
    vertexContacts(a, tf, b, other_tf, std::numeric_limits<double>::infinity(), contacts);
    distanceDerivatives(a, tf, b, other_tf, contacts, g);
    ASSERT_EQ(contacts.size(), g.first.rows());
    const Bodies bodies(a, tf, b, other_tf);
    const Displacements by = this->anyDisplacements(bodies);
    const Real t = Real(1e-12) * bodies.size;
    const Positions after = moved(bodies.at, by, bodies.to_first, t),
                    before = moved(bodies.at, by, bodies.to_first, -t);
    for (std::size_t i = 0; i < contacts.size(); ++i) {
      EXPECT_EQ(contacts.vertices[i], g.first.vertices[i]);
      this->expectBalance(bodies, g.first, g.second, i);
      const Real sign = contacts.distances[i] < 0 ? -1 : 1, d = sign * contacts.distances[i];
      if (!isApart(d, bodies.size)) continue;
      inside += sign < 0;
      const unsigned v = contacts.vertices[i];
      const quad::Triangle face =
          Bodies::face(b, bodies.at.second, unsigned(contacts.triangles[i]));
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

TEST_F(DerivativesOfMeshes, OfContactsOnTheSurfaceAndWithShapes) {
  const Model box(latticeBox(2));
  fcl::Transform3d tf = still(), turned = tf;
  tf.translation() = fcl::Vector3d(0.5, 0.25, 2);  // stands on the other box
  turned.linear() << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  turned.translation() = fcl::Vector3d(2, 0, 0);
  VertexContacts contacts;
  DistanceDerivatives g, same;
  vertexContacts(box, tf, box, turned, 0., contacts);
  EXPECT_GT(contacts.size(), 3u);
  distanceDerivatives(box, tf, box, turned, contacts, g);
  distanceDerivatives(box, tf, static_cast<const fcl::CollisionGeometryd&>(box), turned, contacts,
                      same);
  EXPECT_EQ(g.second.gradients, same.second.gradients);
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    EXPECT_EQ(0, contacts.distances[i]);
    if (contacts.barycentric[i].minCoeff() < 0.01) continue;  // on a side
    const fcl::Vector3d up = fcl::Vector3d::UnitZ();
    EXPECT_LE((g.first.gradients[i] - up).norm(), 1e-6);
    for (std::size_t k = 0; k < 3; ++k) {
      const double weight = contacts.barycentric[i][int(k)];
      EXPECT_LE((g.second.gradients[3 * i + k] + weight * up).norm(), 1e-6);
    }
  }
  const fcl::Sphered ball(1.);
  const fcl::Transform3d pose = this->random_.pose(1);
  vertexContacts(box, tf, ball, pose, 9., contacts);
  distanceDerivatives(box, tf, ball, pose, contacts, g);
  ASSERT_EQ(box.vertices().size(), g.first.rows());
  EXPECT_EQ(0u, g.second.rows());
  EXPECT_EQ(0u, g.second.gradients.size());
  for (std::size_t i = 0; i < contacts.size(); ++i)
    EXPECT_LE(
        (g.first.gradients[i] - (contacts.positions[i] - pose.translation()).normalized()).norm(),
        1e-5);
}

TEST_F(DerivativesOfMeshes, RefuseWhatDoesNotFit) {
  const auto still = DistanceDerivativesTest::still();
  const Model mesh(latticeBox(1));
  fcl::Transform3d scaled = still;
  scaled.linear() *= 2.;
  FeaturePairs pairs;
  pairs.vertex_face = {{0, 0}};
  pairs.edge_edge = {{0, 5}};
  FeaturePairDetails details;
  selfFeaturePairDetails(mesh, pairs, details);
  FeaturePairDerivatives g;
  g.edge_edge.first.resize(7, 2);
  const auto refuses = [&](const auto& call) {
    EXPECT_THROW(call(), std::invalid_argument);
    EXPECT_EQ(7u, g.edge_edge.first.rows());
  };
  refuses([&] { distanceDerivatives(mesh, scaled, mesh, still, pairs, details, g); });
  refuses([&] { distanceDerivatives(mesh, still, mesh, scaled, pairs, details, g); });
  FeaturePairs wrong = pairs;
  wrong.edge_edge[0].second = 36;
  refuses([&] { selfDistanceDerivatives(mesh, wrong, details, g); });
  wrong.edge_edge.clear();
  refuses([&] { selfDistanceDerivatives(mesh, wrong, details, g); });
  FeaturePairDetails shorter = details;
  shorter.vertex_face.coordinates.clear();
  refuses([&] { selfDistanceDerivatives(mesh, pairs, shorter, g); });

  VertexContacts contacts;
  vertexContacts(mesh, still, mesh, still, 0., contacts);
  DistanceDerivatives of_contacts;
  of_contacts.first.resize(5, 1);
  const auto refusesContacts = [&](const VertexContacts& bad) {
    EXPECT_THROW(distanceDerivatives(mesh, still, mesh, still, bad, of_contacts),
                 std::invalid_argument);
    EXPECT_EQ(5u, of_contacts.first.rows());
  };
  VertexContacts bad = contacts;
  bad.vertices[1] = 8;
  refusesContacts(bad);
  bad = contacts;
  bad.triangles[1] = -1;
  refusesContacts(bad);
  bad = contacts;
  bad.normals.pop_back();
  refusesContacts(bad);
  const fcl::Boxd shape(1, 1, 1);
  EXPECT_THROW(distanceDerivatives(mesh, still, shape, still, bad, of_contacts),
               std::invalid_argument);

  fcl::DistanceResultd nearest;  // which names no triangles
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
