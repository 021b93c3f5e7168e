// A mesh in single precision answers what a mesh in double precision with the same numbers does,
// rounded once: bounds outward, and a distance to 0 only where it is 0.
#include <gtest/gtest.h>

#include <fcl/geometry/shape/box.h>

#include "adaptive_bvh/coherent_distance.h"
#include "adaptive_bvh/contact_regions.h"
#include "adaptive_bvh/continuous_collision.h"
#include "adaptive_bvh/penetration.h"
#include "adaptive_bvh/point_query.h"
#include "adaptive_bvh/proximity.h"
#include "adaptive_bvh/query.h"
#include "adaptive_bvh/self_collision.h"
#include "support/closed_bodies.h"
#include "support/fcl_float.h"
#include "support/random_geometry.h"

namespace adaptive_bvh_test {
namespace single_precision_test {

using adaptive_bvh::DeformableMesh;
using fcl::Transform3d;
using fcl::Transform3f;

fcl::Vector3f rounded(const fcl::Vector3d& x) { return x.cast<float>(); }

std::vector<fcl::Vector3d> inDouble(const std::vector<fcl::Vector3f>& points) {
  std::vector<fcl::Vector3d> converted;
  for (const auto& x : points) converted.push_back(x.cast<double>());
  return converted;
}

/// Two bodies in both number types, in places where they touch, or nearly do.
class SinglePrecision : public testing::Test {
 protected:
  struct Body {
    explicit Body(const TriangleMesh<float>& mesh)
        : single(mesh), twin(inDouble(mesh.vertices), mesh.triangles) {}
    void update(const std::vector<fcl::Vector3f>& positions) {
      single.update(positions);
      twin.update(inDouble(positions));
    }
    DeformableMesh<float> single;
    DeformableMesh<double> twin;
  };

  SinglePrecision() : first_(gridBall<float>(9, 8)), second_(gridBall<float>(7, 10)) {}

  /// Deforms both, and places the second `apart` from the first.
  void next(float apart) {
    for (Body* body : {&first_, &second_}) {
      std::vector<fcl::Vector3f> positions = body->single.vertices();
      for (auto& x : positions) x += 0.01f * random_.point();
      body->update(positions);
    }
    tf1_ = random_.pose(1);
    tf2_ = random_.pose(1);
    tf2_.translation() = tf1_.translation() + apart * random_.direction();
  }
  Transform3d twin1() const { return tf1_.cast<double>(); }
  Transform3d twin2() const { return tf2_.cast<double>(); }

  Body first_, second_;
  Transform3f tf1_, tf2_;
  RandomGeometry<float> random_{91};
};

constexpr float kApart[] = {0.5f, 1.9f, 2.05f, 4, 1000};

TEST_F(SinglePrecision, MeshesHoldTheNumbersThatWereGiven) {
  for (int step = 0; step < 20; ++step) {
    next(2);
    EXPECT_TRUE(first_.single.validate());
    std::vector<unsigned> some = {3, 1, 3};
    const std::vector<fcl::Vector3f> to = {random_.point(), random_.point(), random_.point()};
    first_.single.update(some, to);
    first_.twin.update(some, inDouble(to));
    EXPECT_EQ(to[2], first_.single.vertices()[3]);
    EXPECT_EQ(to[1], first_.single.vertices()[1]);
    EXPECT_EQ(first_.twin.vertices(), inDouble(first_.single.vertices()));
    EXPECT_EQ(first_.twin.lastUpdate().largest_displacement,
              first_.single.lastUpdate().largest_displacement);
    const std::vector<fcl::Vector3f> before = first_.single.vertices();
    std::vector<fcl::Vector3f> to_all = before;
    to_all[5] += 0.1f * random_.point();
    first_.single.updateTwoFrames(to_all);
    EXPECT_EQ(before, first_.single.previousVertices());
    for (const auto& x : first_.single.vertices()) {
      EXPECT_TRUE(first_.single.aabb_local.contain(x));
      EXPECT_LE((x - first_.single.aabb_center).norm(), first_.single.aabb_radius * (1 + 1e-6f));
    }
  }
}

TEST_F(SinglePrecision, DistancesAreThoseOfDouble) {
  adaptive_bvh::CoherentDistance<float> coherent(first_.single, second_.single);
  for (int round = 0; round < 60; ++round) {
    next(kApart[round % 5]);
    fcl::DistanceResultf found, again;
    fcl::DistanceResultd expected;
    adaptive_bvh::distance(&first_.single, tf1_, &second_.single, tf2_, fcl::DistanceRequestf(true),
                           found);
    adaptive_bvh::distance(&first_.twin, twin1(), &second_.twin, twin2(),
                           fcl::DistanceRequestd(true), expected);
    ASSERT_EQ(float(expected.min_distance), found.min_distance) << round;
    EXPECT_EQ(expected.b1, found.b1);
    EXPECT_EQ(expected.b2, found.b2);
    EXPECT_EQ(static_cast<const fcl::CollisionGeometryf*>(&first_.single), found.o1);
    EXPECT_EQ(static_cast<const fcl::CollisionGeometryf*>(&second_.single), found.o2);
    if (found.min_distance > 0) {
      EXPECT_EQ(rounded(expected.nearest_points[0]), found.nearest_points[0]);
    }
    coherent.distance(tf1_, tf2_, fcl::DistanceRequestf(), again);
    EXPECT_NEAR(found.min_distance, again.min_distance, 1e-12 * kApart[round % 5]);
    EXPECT_EQ(found.o2, again.o2);
    const float limit = float(expected.min_distance);
    EXPECT_EQ(adaptive_bvh::isNearer(first_.twin, twin1(), second_.twin, twin2(), double(limit)),
              adaptive_bvh::isNearer(first_.single, tf1_, second_.single, tf2_, limit));
  }
}

TEST_F(SinglePrecision, ContactsAreThoseOfDouble) {
  std::size_t contacts = 0;
  for (int round = 0; round < 40; ++round) {
    next(kApart[round % 3]);
    const std::size_t most = round % 2 ? 7 : 100000;
    fcl::CollisionResultf found;
    fcl::CollisionResultd expected;
    adaptive_bvh::collide(&first_.single, tf1_, &second_.single, tf2_,
                          fcl::CollisionRequestf(most, true, 5, true, false), found);
    adaptive_bvh::collide(&first_.twin, twin1(), &second_.twin, twin2(),
                          fcl::CollisionRequestd(most, true, 5, true, false), expected);
    ASSERT_EQ(expected.numContacts(), found.numContacts());
    EXPECT_EQ(expected.numCostSources(), found.numCostSources());
    for (std::size_t i = 0; i < found.numContacts(); ++i) {
      const auto& a = expected.getContact(i);
      const auto& b = found.getContact(i);
      EXPECT_EQ(a.b1, b.b1);
      EXPECT_EQ(a.b2, b.b2);
      EXPECT_EQ(rounded(a.pos), b.pos);
      EXPECT_EQ(rounded(a.normal), b.normal);
      EXPECT_EQ(float(a.penetration_depth), b.penetration_depth);
      EXPECT_EQ(static_cast<const fcl::CollisionGeometryf*>(&second_.single), b.o2);
    }
    contacts += found.numContacts();
    // A result that holds some is filled up.
    fcl::CollisionResultf filled;
    for (int twice = 0; twice < 2; ++twice)
      adaptive_bvh::collide(&first_.single, tf1_, &second_.single, tf2_,
                            fcl::CollisionRequestf(found.numContacts() + 3, false), filled);
    EXPECT_LE(filled.numContacts(), found.numContacts() + 3);
    filled.clear();
    adaptive_bvh::selfCollide(first_.single, tf1_, fcl::CollisionRequestf(100000), filled);
    fcl::CollisionResultd own;
    adaptive_bvh::selfCollide(first_.twin, twin1(), fcl::CollisionRequestd(100000), own);
    EXPECT_EQ(own.numContacts(), filled.numContacts());
  }
  EXPECT_GT(contacts, 100u);
}

TEST_F(SinglePrecision, PairsAndDepthsAreThoseOfDouble) {
  std::size_t pairs = 0, contacts = 0, regions = 0;
  for (int round = 0; round < 30; ++round) {
    next(kApart[round % 4]);
    adaptive_bvh::ProximityRequest<float> asked;
    adaptive_bvh::ProximityRequest<double> twin;
    asked.distance = 0.2f;
    twin.distance = double(asked.distance);
    asked.enable_distances = twin.enable_distances = true;
    adaptive_bvh::TrianglePairs<float> found;
    adaptive_bvh::TrianglePairs<double> expected;
    pairs += pairsWithin(first_.single, tf1_, second_.single, tf2_, asked, found);
    pairsWithin(first_.twin, twin1(), second_.twin, twin2(), twin, expected);
    ASSERT_EQ(expected.triangles, found.triangles);
    for (std::size_t i = 0; i < found.size(); ++i) {
      EXPECT_EQ(float(expected.distances[i]), found.distances[i]);
      EXPECT_EQ(expected.distances[i] == 0, found.distances[i] == 0);
    }
    adaptive_bvh::VertexContacts<float> near;
    adaptive_bvh::VertexContacts<double> near_twin;
    contacts += vertexContacts(first_.single, tf1_, second_.single, tf2_, 0.1f, near);
    vertexContacts(first_.twin, twin1(), second_.twin, twin2(), double(0.1f), near_twin);
    ASSERT_EQ(near_twin.vertices, near.vertices);
    EXPECT_EQ(near_twin.triangles, near.triangles);
    for (std::size_t i = 0; i < near.size(); ++i)
      EXPECT_EQ(float(near_twin.distances[i]), near.distances[i]);
    const auto depth = signedDistance(first_.single, tf1_, second_.single, tf2_, 1e-3f);
    const auto depth_twin =
        signedDistance(first_.twin, twin1(), second_.twin, twin2(), double(1e-3f));
    EXPECT_LE(double(depth.lower), depth_twin.lower);
    EXPECT_GE(double(depth.upper), depth_twin.upper);
    EXPECT_LE(double(depth.upper) - double(depth.lower), 1.1e-3);
    adaptive_bvh::ContactRegions<float> common;
    adaptive_bvh::ContactRegions<double> common_twin;
    regions += contactRegions(first_.single, tf1_, second_.single, tf2_, common);
    contactRegions(first_.twin, twin1(), second_.twin, twin2(), common_twin);
    ASSERT_EQ(common_twin.size(), common.size());
    for (std::size_t i = 0; i < common.size(); ++i)
      EXPECT_EQ(float(common_twin.volumes[i]), common.volumes[i]);
  }
  EXPECT_GT(pairs, 100u);
  EXPECT_GT(contacts, 50u);
  EXPECT_GT(regions, 5u);
}

TEST_F(SinglePrecision, PointsAndRaysAreThoseOfDouble) {
  int hits = 0;
  for (int round = 0; round < 10; ++round) {
    next(1);
    std::vector<fcl::Vector3f> points, directions;
    for (int i = 0; i < 200; ++i) {
      points.push_back(random_.point() * (i % 2 ? 1.1f : 5.f));
      directions.push_back(random_.direction());
    }
    points.push_back(first_.single.vertices()[4]);
    directions.push_back({0, 0, 1});
    std::vector<adaptive_bvh::ClosestPoint<float>> nearest;
    std::vector<adaptive_bvh::ClosestPoint<double>> nearest_twin;
    closestPoints(first_.single, points, nearest);
    closestPoints(first_.twin, inDouble(points), nearest_twin);
    std::vector<float> signs, clearances;
    std::vector<double> signs_twin, clearances_twin;
    signedDistances(first_.single, points, signs);
    signedDistances(first_.twin, inDouble(points), signs_twin);
    std::vector<adaptive_bvh::RayHit<float>> first_hits;
    std::vector<adaptive_bvh::RayHit<double>> first_hits_twin;
    firstHits(first_.single, points.data(), directions.data(), points.size(), first_hits);
    const auto from = inDouble(points), along = inDouble(directions);
    firstHits(first_.twin, from.data(), along.data(), from.size(), first_hits_twin);
    for (std::size_t i = 0; i < points.size(); ++i) {
      EXPECT_EQ(nearest_twin[i].triangle, nearest[i].triangle);
      EXPECT_EQ(rounded(nearest_twin[i].point), nearest[i].point);
      EXPECT_EQ(float(nearest_twin[i].distance), nearest[i].distance);
      EXPECT_EQ(float(signs_twin[i]), signs[i]);
      EXPECT_EQ(first_hits_twin[i].triangle, first_hits[i].triangle);
      EXPECT_EQ(float(first_hits_twin[i].t), first_hits[i].t);
      hits += first_hits[i].triangle >= 0;
    }
    signedClearance(first_.single, tf1_, second_.single, tf2_, 3.f, clearances);
    signedClearance(first_.twin, twin1(), second_.twin, twin2(), 3., clearances_twin);
    for (std::size_t i = 0; i < clearances.size(); ++i)
      EXPECT_EQ(float(clearances_twin[i]), clearances[i]);
  }
  EXPECT_GT(hits, 300);
}

TEST_F(SinglePrecision, FeaturesAndImpactsAreThoseOfDouble) {
  int impacts = 0;
  for (int round = 0; round < 20; ++round) {
    next(kApart[round % 3]);
    adaptive_bvh::FeaturePairs pairs, pairs_twin;
    featurePairsWithin(first_.single, tf1_, second_.single, tf2_, 0.15f, pairs);
    featurePairsWithin(first_.twin, twin1(), second_.twin, twin2(), double(0.15f), pairs_twin);
    EXPECT_EQ(pairs_twin.vertex_face, pairs.vertex_face);
    EXPECT_EQ(pairs_twin.edge_edge, pairs.edge_edge);
    adaptive_bvh::FeaturePairDetails<float> details;
    adaptive_bvh::FeaturePairDetails<double> details_twin;
    featurePairDetails(first_.single, tf1_, second_.single, tf2_, pairs, details);
    featurePairDetails(first_.twin, twin1(), second_.twin, twin2(), pairs, details_twin);
    for (std::size_t i = 0; i < details.edge_edge.size(); ++i) {
      EXPECT_EQ(float(details_twin.edge_edge.distances[i]), details.edge_edge.distances[i]);
      EXPECT_EQ(rounded(details_twin.edge_edge.normals[i]), details.edge_edge.normals[i]);
    }
    const std::vector<fcl::Vector3f> from = first_.single.vertices(),
                                     at = second_.single.vertices();
    std::vector<fcl::Vector3f> to = from;
    const fcl::Vector3f way = tf1_.linear().transpose() * (tf2_.translation() - tf1_.translation());
    for (auto& x : to) x += way;
    const auto from_twin = inDouble(from), to_twin = inDouble(to), at_twin = inDouble(at);
    using adaptive_bvh::Motion;
    const adaptive_bvh::Impact impact =
        earliestImpact(Motion<float>(first_.single, from, to, tf1_, tf1_),
                       Motion<float>(second_.single, at, at, tf2_, tf2_));
    const adaptive_bvh::Impact twin =
        earliestImpact(Motion<double>(first_.twin, from_twin, to_twin, twin1(), twin1()),
                       Motion<double>(second_.twin, at_twin, at_twin, twin2(), twin2()));
    EXPECT_EQ(twin.time, impact.time);
    EXPECT_EQ(twin.pair, impact.pair);
    impacts += impact.happens();
  }
  EXPECT_GT(impacts, 10);
}

/// What a contact says of objects: FCL's fields of the mesh in single precision count.
TEST_F(SinglePrecision, OccupancyIsThatOfTheMesh) {
  next(1);
  fcl::CollisionResultf result;
  adaptive_bvh::collide(&first_.single, tf1_, &second_.single, tf2_, fcl::CollisionRequestf(),
                        result);
  EXPECT_TRUE(result.isCollision());
  first_.single.threshold_occupied = 2;  // its cost density is 1
  result.clear();
  adaptive_bvh::collide(&first_.single, tf1_, &second_.single, tf2_, fcl::CollisionRequestf(),
                        result);
  EXPECT_FALSE(result.isCollision());
}

/// Points that were not asked for stay NaN, and a result that is more than full takes no contact.
TEST_F(SinglePrecision, ResultsKeepWhatIsNotAskedFor) {
  next(4);
  fcl::DistanceResultf distance;
  adaptive_bvh::distance(&first_.single, tf1_, &second_.single, tf2_, fcl::DistanceRequestf(false),
                         distance);
  EXPECT_GT(distance.min_distance, 0);
  EXPECT_TRUE(distance.nearest_points[0].array().isNaN().all());
  adaptive_bvh::CoherentDistance<float> coherent(first_.single, second_.single);
  distance = fcl::DistanceResultf();
  coherent.distance(tf1_, tf2_, fcl::DistanceRequestf(false), distance);
  EXPECT_TRUE(distance.nearest_points[1].array().isNaN().all());
  next(1);
  fcl::CollisionResultf contacts;
  adaptive_bvh::collide(&first_.single, tf1_, &second_.single, tf2_, fcl::CollisionRequestf(100000),
                        contacts);
  const std::size_t before = contacts.numContacts();
  ASSERT_GT(before, 5u);
  adaptive_bvh::collide(&first_.single, tf1_, &second_.single, tf2_,
                        fcl::CollisionRequestf(3, false, 5, true), contacts);
  EXPECT_EQ(before, contacts.numContacts());
  EXPECT_GT(contacts.numCostSources(), 0u);
}

}  // namespace single_precision_test
}  // namespace adaptive_bvh_test
