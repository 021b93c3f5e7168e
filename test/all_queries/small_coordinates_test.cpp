// Meshes of any size down to the smallest numbers, and large ones with tiny parts: lengths, normals
// and decisions, judged in quadruple precision, whose exponents have room for all squares.
#include <gtest/gtest.h>

#include <fcl/geometry/shape/sphere.h>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/continuous_collision.h"
#include "adaptive_bvh/penetration.h"
#include "adaptive_bvh/point_query.h"
#include "adaptive_bvh/proximity.h"
#include "adaptive_bvh/query.h"
#include "support/lattice_features.h"
#include "support/random_geometry.h"
#include "support/test_mesh.h"

namespace adaptive_bvh_test {
namespace small_coordinates_test {

using adaptive_bvh::DeformableMesh;
using Mesh = DeformableMesh;
using Points = std::vector<fcl::Vector3d>;

const fcl::Transform3d kStill = fcl::Transform3d::Identity();

/// A mesh on a lattice, and the length of its step, a power of two.
struct Lattice {
  TriangleMesh mesh;
  int exponent;

  Lattice times(int power) const {
    Lattice scaled{mesh, power};
    for (fcl::Vector3d& p : scaled.mesh.vertices)
      for (double& x : p) x = std::ldexp(x, power);
    return scaled;
  }
};

class SmallCoordinates : public testing::Test {
 protected:
  /// A tetrahedron or a few triangles with corners from -16 to 16, moved along x.
  TriangleMesh body(bool is_closed, int away) {
    TriangleMesh mesh;
    const int corners = is_closed ? 4 : 6;
    do {
      mesh.vertices.clear();
      for (int v = 0; v < corners; ++v)
        mesh.vertices.emplace_back(random_.below(17) - 8 + away, random_.below(17) - 8,
                                   random_.below(17) - 8);
      mesh.triangles = is_closed
                           ? std::vector<fcl::Triangle>{{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}
                           : std::vector<fcl::Triangle>{{0, 1, 2}, {3, 4, 5}, {1, 3, 5}};
    } while (is_closed && volume(mesh) <= 0);
    return mesh;
  }
  static double volume(const TriangleMesh& m) {
    const Points& p = m.vertices;
    return (p[1] - p[0]).cross(p[2] - p[0]).dot(p[3] - p[0]);
  }
  static quad::Triangle triangle(const TriangleMesh& mesh, std::size_t t) {
    const auto& v = mesh.triangles[t];
    return {quad::of(mesh.vertices[v[0]]), quad::of(mesh.vertices[v[1]]),
            quad::of(mesh.vertices[v[2]])};
  }
  static double distance(const fcl::Vector3d& x, const TriangleMesh& mesh) {
    quad::Real least = std::numeric_limits<double>::max();
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
      least = std::min(least, quad::distance(quad::of(x), triangle(mesh, t)));
    return double(least);
  }
  static double distance(const TriangleMesh& a, const TriangleMesh& b) {
    quad::Real least = std::numeric_limits<double>::max();
    for (std::size_t s = 0; s < a.triangles.size(); ++s)
      for (std::size_t t = 0; t < b.triangles.size(); ++t) {
        const quad::Real d = quad::distance(triangle(a, s), triangle(b, t));
        least = std::min(least, d < quad::Real(1e-25) ? quad::Real(0) : d);
      }
    return double(least);
  }

  /// A length in steps of the lattice, exactly as `length`, or off by the smallest number.
  static double inSteps(double length, int exponent) {
    return std::ldexp(std::ldexp(length, -exponent / 2), -(exponent - exponent / 2));
  }
  static void expectLength(double expected, double found, int exponent) {
    const double smallest = inSteps(4 * std::numeric_limits<double>::denorm_min(), exponent);
    EXPECT_NEAR(expected, inSteps(found, exponent), 1e-12 + smallest) << "2^" << exponent;
  }
  static void expectLength(double expected, const fcl::Vector3d& from, const fcl::Vector3d& to,
                           int exponent) {
    expectLength(expected, (to - from).stableNorm(), exponent);
  }

  /// All sizes, or of many some.
  template <typename Try>
  void forEachSize(const Try& tryAt) {
    const int step = isLongMode() ? 1 : 7;
    for (int exponent = 0; exponent >= -1074 && !HasFailure(); exponent -= step) tryAt(exponent);
    tryAt(-1074);
  }

  RandomGeometry random_{91};
};

TEST_F(SmallCoordinates, DistancesOfMeshesAreRight) {
  forEachSize([&](int exponent) {
    const TriangleMesh first = body(false, 0), second = body(false, random_.below(30));
    const double expected = distance(first, second);
    const Mesh a(Lattice{first, 0}.times(exponent).mesh),
        b(Lattice{second, 0}.times(exponent).mesh);
    fcl::DistanceRequestd request(true);
    fcl::DistanceResultd result;
    adaptive_bvh::distance(&a, kStill, &b, kStill, request, result);
    expectLength(expected, result.min_distance, exponent);
    expectLength(expected, result.nearest_points[0], result.nearest_points[1], exponent);
    EXPECT_EQ(expected == 0, result.min_distance == 0);
    const auto isNearer = [&](double steps) {
      return adaptive_bvh::isNearer(a, kStill, b, kStill, std::ldexp(steps, exponent));
    };
    EXPECT_EQ(expected == 0, isNearer(0));
    EXPECT_TRUE(isNearer(std::ceil(expected + 1)));
    if (expected > 2) {
      EXPECT_FALSE(isNearer(std::floor(expected - 1)));
    }
    std::vector<double> clearances;
    adaptive_bvh::vertexDistances(a, kStill, b, kStill, 1e300, clearances);
    for (std::size_t v = 0; v < clearances.size(); ++v)
      expectLength(distance(first.vertices[v], second), clearances[v], exponent);
  });
}

TEST_F(SmallCoordinates, PointsHaveTheirDistancesAndNormals) {
  forEachSize([&](int exponent) {
    const TriangleMesh mesh = body(true, 0);
    const Mesh small(Lattice{mesh, 0}.times(exponent).mesh);
    Points points, small_points;
    for (int i = 0; i < 20; ++i) {
      points.emplace_back(random_.below(41) - 20, random_.below(41) - 20, random_.below(41) - 20);
      small_points.push_back(points.back());
      for (double& x : small_points.back()) x = std::ldexp(x, exponent);
    }
    std::vector<adaptive_bvh::ClosestFeature> features;
    adaptive_bvh::closestFeatures(small, small_points, 1e300, features);
    std::vector<double> distances;
    adaptive_bvh::signedDistances(small, small_points, distances);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double expected = distance(points[i], mesh);
      expectLength(expected, features[i].distance, exponent);
      expectLength(expected, features[i].point, small_points[i], exponent);
      expectLength(expected, std::abs(distances[i]), exponent);
      EXPECT_NEAR(1, features[i].normal.norm(), 1e-12) << "2^" << exponent;
      EXPECT_NEAR(1, features[i].barycentric.sum(), 1e-12);
      const fcl::Vector3d away = points[i] - fcl::Vector3d(features[i].point.unaryExpr(
                                                 [&](double x) { return inSteps(x, exponent); }));
      if (expected > 0.01 && features[i].feature == adaptive_bvh::SurfaceFeature::Face &&
          exponent > -1000) {
        EXPECT_NEAR(expected, std::abs(away.dot(features[i].normal)), 1e-6);
      }
    }
  });
}

TEST_F(SmallCoordinates, ContactsAndSignedDistancesAreThoseOfTheLargeBodies) {
  forEachSize([&](int exponent) {
    const TriangleMesh first = body(true, 0), second = body(true, random_.below(20));
    const Mesh large1(first), large2(second);
    const Mesh small1(Lattice{first, 0}.times(exponent).mesh),
        small2(Lattice{second, 0}.times(exponent).mesh);
    adaptive_bvh::VertexContacts large, small;
    vertexContacts(large1, kStill, large2, kStill, 4., large);
    vertexContacts(small1, kStill, small2, kStill, std::ldexp(4., exponent), small);
    if (exponent < -1050) return;  // a distance of 4.2 is rounded to 4
    ASSERT_EQ(large.vertices, small.vertices) << "2^" << exponent;
    EXPECT_EQ(large.triangles, small.triangles);
    for (std::size_t i = 0; i < small.size(); ++i) {
      expectLength(large.distances[i], small.distances[i], exponent);
      if (exponent > -1000) {
        EXPECT_NEAR(0, (large.normals[i] - small.normals[i]).norm(), 1e-9) << "2^" << exponent;
      }
    }
    const auto of_large = signedDistance(large1, kStill, large2, kStill, 1e-3),
               of_small =
                   signedDistance(small1, kStill, small2, kStill, std::ldexp(1e-3, exponent));
    const double smallest = inSteps(4 * std::numeric_limits<double>::denorm_min(), exponent);
    EXPECT_NEAR(of_large.lower, inSteps(of_small.lower, exponent), 2e-3 + smallest)
        << "2^" << exponent;
    EXPECT_NEAR(of_large.upper, inSteps(of_small.upper, exponent), 2e-3 + smallest)
        << "2^" << exponent;
  });
}

TEST_F(SmallCoordinates, PairsOfFeaturesAreThoseOfTheLargeBodies) {
  forEachSize([&](int exponent) {
    const TriangleMesh first = body(false, 0), second = body(false, random_.below(12));
    const Mesh a(Lattice{first, 0}.times(exponent).mesh),
        b(Lattice{second, 0}.times(exponent).mesh);
    const int limit = random_.below(3);
    adaptive_bvh::FeaturePairs found;
    featurePairsWithin(a, kStill, b, kStill, std::ldexp(double(limit), exponent), found);
    EXPECT_EQ(featurePairs(first, second, limit), featurePairs(found, first, second))
        << "2^" << exponent;
  });
}

/// Two vertices of a body of the size 1 are 1e-200 apart, and the body is as near to another one.
TEST_F(SmallCoordinates, LargeBodiesMayHaveTinyParts) {
  for (const double tiny : {1e-20, 1e-60, 1e-100, 1e-160, 1e-200, 1e-300, 5e-324})
    for (const bool is_joined : {true, false}) {
      TriangleMesh mesh;
      mesh.vertices = {{0, 0, 0}, {tiny, 0, 0}, {0, tiny, 0}, {1, 0, -1}, {0, 1, -1}, {0, 0, -2}};
      mesh.triangles = is_joined ? std::vector<fcl::Triangle>{{0, 1, 2}, {1, 3, 2}, {2, 3, 4}}
                                 : std::vector<fcl::Triangle>{{0, 1, 2}, {3, 4, 5}};
      const Mesh body(mesh);
      TriangleMesh above = mesh;
      for (fcl::Vector3d& p : above.vertices) p = fcl::Vector3d(p[0], p[1], 4 * tiny - p[2]);
      const Mesh other(above);
      fcl::DistanceResultd result;
      adaptive_bvh::distance(&body, kStill, &other, kStill, fcl::DistanceRequestd(true), result);
      const auto closest = adaptive_bvh::closestPoint(body, fcl::Vector3d(0, 0, 4 * tiny));
      EXPECT_GT(result.min_distance, 0);
      EXPECT_EQ(0, closest.triangle);
      EXPECT_FALSE(adaptive_bvh::isNearer(body, kStill, other, kStill, 0));
      // Off by the rounding of the features: those that are large or those that are tiny.
      const double error = (is_joined ? 1e-14 : 1e-12 * tiny);
      EXPECT_NEAR(4 * tiny, result.min_distance, error) << tiny;
      EXPECT_NEAR(4 * tiny, closest.distance, 1e-12 * tiny) << tiny;
      std::vector<adaptive_bvh::ClosestFeature> features;
      closestFeatures(body, {fcl::Vector3d(tiny / 4, tiny / 4, 1)}, 10., features);
      EXPECT_NEAR(1, features[0].normal.norm(), 1e-12) << tiny;
      adaptive_bvh::FeaturePairs pairs;
      featurePairsWithin(body, kStill, other, kStill, 5 * tiny + error, pairs);
      EXPECT_GE(pairs.size(), 3u) << tiny;
    }
}

/// FCL's managers place a model by it, also where its square underflows.
TEST_F(SmallCoordinates, RadiiOfModelsReachTheirVertices) {
  for (const int exponent : {-300, -500, -540, -900}) {
    const double unit = std::ldexp(1., exponent);
    TriangleMesh sheet = plate(3, 2);
    for (fcl::Vector3d& p : sheet.vertices) p *= unit;
    adaptive_bvh::AdaptiveBVHModel<fcl::RSSd> model;
    ASSERT_EQ(fcl::BVH_OK, fillModel(sheet, model));
    for (int step = 0; step < 2; ++step) {
      const double radius = model.aabb_radius / unit;
      for (const fcl::Vector3d& p : sheet.vertices)
        EXPECT_GE(radius * (1 + 1e-12), ((p - model.aabb_center) / unit).norm()) << exponent;
      EXPECT_LT(radius, 2);
      for (fcl::Vector3d& p : sheet.vertices) p *= 1.25;
      model.update(sheet.vertices);
    }
  }
}

TEST_F(SmallCoordinates, TinyShapesAreRefused) {
  const Mesh mesh(body(true, 0));
  fcl::DistanceResultd result;
  const auto distanceTo = [&](double radius) {
    const fcl::Sphered sphere(radius);
    adaptive_bvh::distance(&mesh, kStill, &sphere, kStill, fcl::DistanceRequestd(), result);
  };
  EXPECT_THROW(distanceTo(1e-70), std::invalid_argument);
  EXPECT_NO_THROW(distanceTo(1e-60));
}

/// Times are never late, though early where lengths count as none.
TEST_F(SmallCoordinates, TimesOfImpactAreNeverLate) {
  forEachSize([&](int exponent) {
    const TriangleMesh first = body(true, 0), second = body(true, 40);
    Points end = second.vertices;
    for (fcl::Vector3d& p : end) p[0] -= 40;
    const auto timeAt = [&](int power) {
      const Mesh a(Lattice{first, 0}.times(power).mesh), b(Lattice{second, 0}.times(power).mesh);
      Lattice moved{second, 0};
      moved.mesh.vertices = end;
      const Points to = moved.times(power).mesh.vertices;
      const adaptive_bvh::Motion still(a, a.vertices(), a.vertices()), moves(b, b.vertices(), to);
      return adaptive_bvh::earliestImpact(still, moves).time;
    };
    EXPECT_LE(timeAt(exponent), timeAt(0) + 1e-9) << "2^" << exponent;
  });
}

}  // namespace small_coordinates_test
}  // namespace adaptive_bvh_test
