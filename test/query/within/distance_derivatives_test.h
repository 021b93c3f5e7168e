#pragma once

#include <gtest/gtest.h>

#include "query/within/moved_bodies.h"
#include "support/closed_bodies.h"
#include "support/random_geometry.h"

// The fixture of tests of derivatives of distances: random bodies; and what holds of derivatives,
// by differences of distances in quadruple precision.
namespace adaptive_bvh_test {
namespace distance_derivatives {

using adaptive_bvh::FeatureDetails;
using adaptive_bvh::FeaturePairDerivatives;
using adaptive_bvh::FeaturePairDetails;
using adaptive_bvh::FeaturePairs;
using adaptive_bvh::VertexContacts;

class DistanceDerivativesTest : public testing::Test {
 protected:
  using Model = DeformableMesh;
  using Transform = fcl::Transform3d;
  static Transform still() { return Transform::Identity(); }

  /// Triangles with corners of their own. On a lattice many are thin, have parallel edges, or
  /// corners in common; else some are needles, segments and points.
  TriangleMesh soupOf(int triangles, bool is_lattice, bool are_general) {
    TriangleMesh mesh;
    for (std::size_t t = 0; t < std::size_t(triangles); ++t) {
      std::array<fcl::Vector3d, 3> corners = random_.triangleAt(random_.point(), 0.7);
      for (fcl::Vector3d& p : corners) {
        if (are_general) p = random_.point();
        if (is_lattice)
          p = fcl::Vector3d(double(random_.below(4)), double(random_.below(4)),
                            double(random_.below(3)));
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
  Displacements anyDisplacements(const Bodies& bodies) {
    const auto fill = [&](std::size_t count, Points& points) {
      for (std::size_t i = 0; i < count; ++i)
        points.push_back(quad::of(fcl::Vector3d(random_.direction() * random_.uniform(0, 1))));
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
  static void forEachPair(const FeaturePairs& pairs, const FeaturePairDetails& details,
                          const FeaturePairDerivatives& derivatives, const Check& check) {
    const auto run = [&](FeatureKind kind, const std::vector<FeaturePair>& list,
                         const FeatureDetails& of_list, const DistanceDerivatives& g) {
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
    const Real rounding = Real(0x1p-42) * (size + m * size / d) + more;
    EXPECT_LE(double(excess / rounding), 1) << "motion " << double(m / size);
    excess_ = std::max(excess_, double(excess / rounding));
    ++bounds_;
  }

  /// The bound, for motions from tiny to as large as the bodies.
  void expectBound(const Bodies& bodies, const FeaturePairs& pairs,
                   const FeaturePairDetails& details, const FeaturePairDerivatives& derivatives) {
    for (const double share : {1e-12, 1e-9, 1e-6, 1e-3, 0.1, 1.}) {
      const Displacements by = anyDisplacements(bodies);
      const Real m = Real(share) * bodies.size;
      const Positions to = moved(bodies.at, by, bodies.to_first, m);
      forEachPair(pairs, details, derivatives,
                  [&](FeatureKind kind, const FeaturePair& pair, const FeatureDetails& of_list,
                      const DistanceDerivatives& g, std::size_t i) {
                    const Real d = of_list.distances[i];
                    if (!isApart(d, bodies.size)) return;
                    expectBelow(bodies.distance(kind, pair, to), d, m, m * changeOf(g, i, by),
                                bodies.size);
                  });
    }
  }

  /// Slopes of both sides: the derivative where they agree, else it lies between both.
  void expectSlopes(const Bodies& bodies, const FeaturePairs& pairs,
                    const FeaturePairDetails& details, const FeaturePairDerivatives& derivatives) {
    const Displacements by = anyDisplacements(bodies);
    const Real t = Real(1e-12) * bodies.size;
    const Positions after = moved(bodies.at, by, bodies.to_first, t),
                    before = moved(bodies.at, by, bodies.to_first, -t);
    forEachPair(pairs, details, derivatives,
                [&](FeatureKind kind, const FeaturePair& pair, const FeatureDetails& of_list,
                    const DistanceDerivatives& g, std::size_t i) {
                  if (of_list.distances[i] < 1e-3 * double(bodies.size)) return;
                  expectSlope(
                      bodies.distance(kind, pair, before), bodies.distance(kind, pair, bodies.at),
                      bodies.distance(kind, pair, after), t, changeOf(g, i, by), bodies.size);
                });
  }
  void expectSlope(Real before, Real now, Real after, Real t, Real change, Real size) {
    const Real left = (now - before) / t, right = (after - now) / t;
    const Real error = Real(1e-12) * (1 + size / now) + Real(1e-8);
    EXPECT_LE(double(right - change), double(error));
    EXPECT_GE(double(left - change), -double(error));
    if (left - right > Real(1e-4)) ++ties_;
    if (quad::absolute(left - right) > Real(1e-8)) return;
    ++smooth_;
    const Real off = quad::absolute((left + right) / 2 - change) * now / size;
    worst_ = std::max(worst_, double(off));
  }

  /// Turned to the world, gradients add up to zero, and so do their moments.
  void expectBalance(const Bodies& bodies, const VertexGradients& first,
                     const VertexGradients& second, std::size_t row) {
    Point force = {0, 0, 0}, moment = {0, 0, 0};
    const auto add = [&](const VertexGradients& g, const Points& at, bool is_turned) {
      for (std::size_t i = row * g.per_distance; i < (row + 1) * g.per_distance; ++i) {
        Point f = quad::of(g.gradients[i]);
        if (is_turned) f = bodies.to_first.turned(f);
        force = force + f;
        moment = moment + quad::cross(at[g.vertices[i]], f);
      }
    };
    add(first, bodies.at.first, false);
    add(second, bodies.at.second, true);
    const Real unit = Real(0x1p-48);
    EXPECT_LE(double(quad::size(force)), double(unit));
    EXPECT_LE(double(quad::size(moment) / bodies.size), double(4 * unit));
  }

  RandomGeometry random_{5501};
  long bounds_ = 0, ties_ = 0, smooth_ = 0;
  double excess_ = 0;  ///< largest part of the bound's rounding that was needed
  double worst_ = 0;   ///< largest error of a derivative where it is smooth, times d / X
};

}  // namespace distance_derivatives
}  // namespace adaptive_bvh_test
