// A mesh in single precision answers what a mesh in double precision with the same numbers does,
// rounded once: bounds outward, and a distance to 0 only where it is 0.
#include <gtest/gtest.h>

#include <fcl/geometry/octree/octree.h>
#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/cone.h>
#include <fcl/geometry/shape/convex.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/ellipsoid.h>
#include <fcl/geometry/shape/halfspace.h>
#include <fcl/geometry/shape/plane.h>
#include <fcl/geometry/shape/sphere.h>

#include "adaptive_bvh/coherent_distance.h"
#include "adaptive_bvh/contact_regions.h"
#include "adaptive_bvh/continuous_collision.h"
#include "adaptive_bvh/distance_derivatives.h"
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
    tf1_ = pose();
    tf2_ = pose();
    tf2_.translation() = tf1_.translation() + apart * random_.direction();
  }
  /// One that is rigid for a query in double precision, too.
  Transform3f pose() {
    for (;;) {
      const Transform3f tf = random_.pose(1);
      const fcl::Matrix3d R = tf.linear().cast<double>();
      if ((R.transpose() * R - fcl::Matrix3d::Identity()).norm() < 9e-7) return tf;
    }
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
    adaptive_bvh::FeaturePairDerivatives<float> derivatives;
    adaptive_bvh::FeaturePairDerivatives<double> derivatives_twin;
    distanceDerivatives(first_.single, tf1_, second_.single, tf2_, pairs, details, derivatives);
    distanceDerivatives(first_.twin, twin1(), second_.twin, twin2(), pairs, details_twin,
                        derivatives_twin);
    const auto& of_single = derivatives.vertex_face.second;
    const auto& of_twin = derivatives_twin.vertex_face.second;
    EXPECT_EQ(of_twin.vertices, of_single.vertices);
    for (std::size_t i = 0; i < of_single.gradients.size(); ++i)  // of rounded details
      EXPECT_LE((of_twin.gradients[i] - of_single.gradients[i].cast<double>()).norm(), 0x1p-22);
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

/// A shape in both number types, with the same numbers.
struct ShapeTwins {
  std::shared_ptr<fcl::CollisionGeometryf> single;
  std::shared_ptr<fcl::CollisionGeometryd> twin;
};
template <template <typename> class Shape, typename... Sizes>
ShapeTwins shapeOf(Sizes... sizes) {
  return {std::make_shared<Shape<float>>(sizes...),
          std::make_shared<Shape<double>>(static_cast<double>(sizes)...)};
}

template <typename S>
std::shared_ptr<fcl::Convex<S>> wedge() {
  const auto points = std::make_shared<std::vector<fcl::Vector3<S>>>();
  for (const fcl::Vector3f& x : {fcl::Vector3f(0.7f, 0.1f, -0.3f),
                                 {-0.5f, 0.6f, -0.3f},
                                 {-0.4f, -0.7f, -0.3f},
                                 {0.1f, 0.05f, 0.9f}})
    points->push_back(x.cast<S>());
  const auto faces = std::make_shared<const std::vector<int>>(
      std::vector<int>{3, 0, 2, 1, 3, 0, 1, 3, 3, 1, 2, 3, 3, 2, 0, 3});
  return std::make_shared<fcl::Convex<S>>(points, 4, faces);
}

std::vector<ShapeTwins> allShapes() {
  std::vector<ShapeTwins> shapes = {
      shapeOf<fcl::Sphere>(0.6f),        shapeOf<fcl::Box>(0.9f, 0.4f, 1.3f),
      shapeOf<fcl::Capsule>(0.3f, 1.1f), shapeOf<fcl::Cylinder>(0.5f, 0.8f),
      shapeOf<fcl::Cone>(0.6f, 1.2f),    shapeOf<fcl::Ellipsoid>(0.3f, 0.5f, 0.8f),
      {wedge<float>(), wedge<double>()}};
  for (const fcl::Vector3f& n : {fcl::Vector3f(0, 0, 1), {0.6f, 0, 0.8f}}) {
    const auto plane = std::make_shared<fcl::Planed>(n.cast<double>(), double(0.3f));
    const auto half_space = std::make_shared<fcl::Halfspaced>(n.cast<double>(), double(0.3f));
    const auto single_plane = std::make_shared<fcl::Planef>(n, 0.3f);
    const auto single_half_space = std::make_shared<fcl::Halfspacef>(n, 0.3f);
    plane->n = single_plane->n.cast<double>();  // each divides by the length
    half_space->n = single_half_space->n.cast<double>();
    plane->d = double(single_plane->d);
    half_space->d = double(single_half_space->d);
    shapes.push_back({single_plane, plane});
    shapes.push_back({single_half_space, half_space});
  }
  return shapes;
}

TEST_F(SinglePrecision, ShapesAreThoseOfDouble) {
  std::size_t contacts = 0, vertices = 0;
  const std::vector<ShapeTwins> shapes = allShapes();
  for (int round = 0; round < 12; ++round)
    for (const ShapeTwins& shape : shapes) {
      next(kApart[round % 4]);
      for (const bool is_signed : {false, true}) {
        fcl::DistanceResultf found;
        fcl::DistanceResultd expected;
        adaptive_bvh::distance(&first_.single, tf1_, shape.single.get(), tf2_,
                               fcl::DistanceRequestf(true, is_signed), found);
        adaptive_bvh::distance(&first_.twin, twin1(), shape.twin.get(), twin2(),
                               fcl::DistanceRequestd(true, is_signed), expected);
        ASSERT_EQ(float(expected.min_distance), found.min_distance);
        EXPECT_EQ(expected.b1, found.b1);
        EXPECT_EQ(static_cast<const fcl::CollisionGeometryf*>(shape.single.get()), found.o2);
        EXPECT_EQ(rounded(expected.nearest_points[1]), found.nearest_points[1]);
        const auto limit = float(std::max(0., expected.min_distance));
        EXPECT_EQ(adaptive_bvh::isNearer(first_.twin, twin1(), *shape.twin, twin2(), double(limit)),
                  adaptive_bvh::isNearer(first_.single, tf1_, *shape.single, tf2_, limit));
      }
      fcl::CollisionResultf touching;
      fcl::CollisionResultd expected;
      adaptive_bvh::collide(&first_.single, tf1_, shape.single.get(), tf2_,
                            fcl::CollisionRequestf(1000, true, 5, true, false), touching);
      adaptive_bvh::collide(&first_.twin, twin1(), shape.twin.get(), twin2(),
                            fcl::CollisionRequestd(1000, true, 5, true, false), expected);
      ASSERT_EQ(expected.numContacts(), touching.numContacts());
      EXPECT_EQ(expected.numCostSources(), touching.numCostSources());
      for (std::size_t i = 0; i < touching.numContacts(); ++i) {
        EXPECT_EQ(rounded(expected.getContact(i).pos), touching.getContact(i).pos);
        EXPECT_EQ(rounded(expected.getContact(i).normal), touching.getContact(i).normal);
        EXPECT_EQ(float(expected.getContact(i).penetration_depth),
                  touching.getContact(i).penetration_depth);
      }
      contacts += touching.numContacts();
      adaptive_bvh::VertexContacts<float> near;
      adaptive_bvh::VertexContacts<double> near_twin;
      vertices += vertexContacts(first_.single, tf1_, *shape.single, tf2_, 0.1f, near);
      vertexContacts(first_.twin, twin1(), *shape.twin, twin2(), double(0.1f), near_twin);
      ASSERT_EQ(near_twin.vertices, near.vertices);
      for (std::size_t i = 0; i < near.size(); ++i)
        EXPECT_EQ(float(near_twin.distances[i]), near.distances[i]);
      if (shape.single->getNodeType() == fcl::GEOM_PLANE || round > 4) continue;
      const auto depth = signedDistance(first_.single, tf1_, *shape.single, tf2_, 1e-2f);
      const auto depth_twin =
          signedDistance(first_.twin, twin1(), *shape.twin, twin2(), double(1e-2f));
      EXPECT_LE(double(depth.lower), depth_twin.lower);
      EXPECT_GE(double(depth.upper), depth_twin.upper);
      EXPECT_EQ(rounded(depth_twin.points[0]), depth.points[0]);
    }
  EXPECT_GT(contacts, 100u);
  EXPECT_GT(vertices, 100u);
}

TEST_F(SinglePrecision, OctreesAreThoseOfDouble) {
  const auto cells = std::make_shared<octomap::OcTree>(double(0.1f));
  for (int i = 0; i < 300; ++i) {
    const fcl::Vector3f x = 0.8f * random_.direction();
    cells->updateNode(octomap::point3d(x[0], x[1], x[2]), true);
  }
  const fcl::OcTreef single(cells);
  const fcl::OcTreed twin(cells);
  std::size_t contacts = 0;
  for (int round = 0; round < 40; ++round) {
    next(kApart[round % 4]);
    fcl::DistanceResultf found;
    fcl::DistanceResultd expected;
    adaptive_bvh::distance(&single, tf1_, &second_.single, tf2_, fcl::DistanceRequestf(true),
                           found);
    adaptive_bvh::distance(&twin, twin1(), &second_.twin, twin2(), fcl::DistanceRequestd(true),
                           expected);
    ASSERT_EQ(float(expected.min_distance), found.min_distance);
    EXPECT_EQ(expected.b1, found.b1);
    EXPECT_EQ(expected.b2, found.b2);
    EXPECT_EQ(static_cast<const fcl::CollisionGeometryf*>(&single), found.o1);
    fcl::CollisionResultf touching;
    fcl::CollisionResultd touching_twin;
    adaptive_bvh::collide(&single, tf1_, &second_.single, tf2_, fcl::CollisionRequestf(1000),
                          touching);
    adaptive_bvh::collide(&twin, twin1(), &second_.twin, twin2(), fcl::CollisionRequestd(1000),
                          touching_twin);
    ASSERT_EQ(touching_twin.numContacts(), touching.numContacts());
    contacts += touching.numContacts();
  }
  EXPECT_GT(contacts, 50u);
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
