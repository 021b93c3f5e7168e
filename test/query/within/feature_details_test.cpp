// Distance, nearest points, coordinates and normal of pairs of features, against long double; and
// pairs that queries leave out, against filtering what they find.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "adaptive_bvh/proximity.h"
#include "adaptive_bvh/self_collision.h"
#include "support/exact_geometry.h"
#include "support/long_mode.h"
#include "support/random_geometry.h"
#include "support/test_mesh.h"

namespace adaptive_bvh_test {
namespace feature_details_test {

using adaptive_bvh::DeformableMesh;
using adaptive_bvh::FeatureDetails;
using adaptive_bvh::FeaturePair;
using adaptive_bvh::FeaturePairDetails;
using adaptive_bvh::FeaturePairs;
using adaptive_bvh::FeatureProximityRequest;
using adaptive_bvh::IgnoredPairs;
using adaptive_bvh::NeighbourFilter;
using adaptive_bvh::ProximityRequest;
using adaptive_bvh::TrianglePairs;
using exact::Point;
using exact::Real;
using exact::Triangle;

/// Zero where there is none.
Point unitOf(const Point& v) { return v.norm() > 0 ? Point(v.normalized()) : Point::Zero(); }
Point normalOf(const Triangle& t) {
  return unitOf(Point(unitOf(t[1] - t[0]).cross(unitOf(t[2] - t[0]))));
}

class FeatureDetailsTest : public testing::Test {
 protected:
  using Model = DeformableMesh;
  using Transform = fcl::Transform3d;

  /// Triangles with corners of their own, anywhere or on a lattice: there many are thin, have
  /// parallel edges, or corners in common.
  TriangleMesh soupOf(int triangles, bool is_lattice) {
    TriangleMesh mesh;
    for (int i = 0; i < 3 * triangles; ++i) {
      fcl::Vector3d p = random_.point();
      if (is_lattice)
        p = fcl::Vector3d(double(random_.below(4)), double(random_.below(4)),
                          double(random_.below(3)));
      mesh.vertices.push_back(p);
    }
    for (std::size_t t = 0; t < std::size_t(triangles); ++t)
      mesh.triangles.emplace_back(3 * t, 3 * t + 1, 3 * t + 2);
    return mesh;
  }
  /// All pairs, or some.
  FeaturePairs pairsOf(const Model& a, const Model& b, int share) {
    FeaturePairs pairs;
    const auto fill = [&](int count1, int count2, std::vector<FeaturePair>& list) {
      for (int i = 0; i < count1; ++i)
        for (int j = 0; j < count2; ++j)
          if (random_.oneIn(share)) list.push_back({unsigned(i), unsigned(j)});
    };
    fill(numVertices(a), numTriangles(b), pairs.vertex_face);
    fill(numTriangles(a), numVertices(b), pairs.face_vertex);
    fill(3 * numTriangles(a), 3 * numTriangles(b), pairs.edge_edge);
    return pairs;
  }

  /// One mesh as it is placed in the world.
  struct Body {
    const Model& mesh;
    exact::Placement placed;

    Body(const Model& of, const Transform& tf) : mesh(of), placed(exact::placement(tf)) {}
    Point vertex(unsigned v) const { return placed(exact::of(mesh.vertices()[v])); }
    Triangle face(unsigned t) const {
      const fcl::Triangle& v = mesh.triangles()[t];
      return {vertex(unsigned(v[0])), vertex(unsigned(v[1])), vertex(unsigned(v[2]))};
    }
    std::array<Point, 2> edge(unsigned e) const {
      const auto ends = adaptive_bvh::edgeVertices(mesh.triangles().data(), e);
      return {vertex(ends[0]), vertex(ends[1])};
    }
  };

  /// The largest coordinate, times what rounding takes; transforms are off by as much.
  static Real toleranceOf(const Body& a, const Body& b) {
    Real size = 0;
    for (const Body* body : {&a, &b})
      for (unsigned v = 0; v < unsigned(numVertices(body->mesh)); ++v)
        size = std::max({size, body->vertex(v).cwiseAbs().maxCoeff(),
                         exact::of(body->mesh.vertices()[v]).cwiseAbs().maxCoeff()});
    return size * (4e-14L);
  }

  void expectUnit(const fcl::Vector3d& normal, bool may_be_zero) {
    if (may_be_zero && normal.isZero(0)) return;
    EXPECT_NEAR(1, double(normal.norm()), 1e-14);
  }
  /// What holds of all kinds. `first` and `second`: the points of the coordinates.
  bool expectDetail(const FeatureDetails& found, std::size_t i, Real distance, const Point& first,
                    const Point& second, Real tolerance) {
    const Point p = exact::of(found.nearest_points[i][0]),
                q = exact::of(found.nearest_points[i][1]);
    EXPECT_NEAR(double(distance), double(found.distances[i]), double(tolerance));
    EXPECT_LE(double((p - first).norm()), double(4 * tolerance));
    EXPECT_LE(double((q - second).norm()), double(4 * tolerance));
    EXPECT_NEAR(double(distance), double((q - p).norm()), double(4 * tolerance));
    EXPECT_GE(found.coordinates[i].minCoeff(), -1e-6);
    EXPECT_LE(found.coordinates[i].maxCoeff(), double(1 + 1e-6));
    pairs_ += 1;
    const bool is_apart = distance > 1e3L * tolerance;
    expectUnit(found.normals[i], !is_apart);
    if (is_apart) {
      EXPECT_LE(double((exact::of(found.normals[i]) - unitOf(q - p)).norm()),
                double(16 * tolerance / distance));
    }
    return !is_apart && distance < tolerance / 1e3L;  // on a lattice 0
  }

  /// A vertex and a face; `towards` is 1 where the vertex is the first's.
  void expectVertexFace(const FeatureDetails& found, std::size_t i, const Point& x,
                        const Triangle& t, int towards, Real tolerance) {
    const Point w = exact::of(found.coordinates[i]);
    EXPECT_NEAR(1, double(w.sum()), 1e-6);
    const Point on_face = w[0] * t[0] + w[1] * t[1] + w[2] * t[2];
    const bool touches = expectDetail(found, i, exact::distance(t, x), towards > 0 ? x : on_face,
                                      towards > 0 ? on_face : x, tolerance);
    if (!touches) return;
    touching_ += 1;  // a triangle with corners of its own: its normal also on its sides
    EXPECT_LE(double((exact::of(found.normals[i]) + towards * normalOf(t)).norm()), 1e-10);
  }
  void expectEdgeEdge(const FeatureDetails& found, std::size_t i, const std::array<Point, 2>& a,
                      const std::array<Point, 2>& b, const Point& facing, Real tolerance) {
    const Point at = exact::of(found.coordinates[i]);
    EXPECT_EQ(0, at[2]);
    const Point p = (1 - at[0]) * a[0] + at[0] * a[1], q = (1 - at[1]) * b[0] + at[1] * b[1];
    if (!expectDetail(found, i, exact::distance(a[0], a[1], b[0], b[1]), p, q, tolerance)) return;
    touching_ += 1;
    const Real small = 1e-7L;
    const Point n = exact::of(found.normals[i]), u = unitOf(a[1] - a[0]), v = unitOf(b[1] - b[0]);
    EXPECT_LE(double(std::abs(n.dot(u))), double(small));
    EXPECT_LE(double(std::abs(n.dot(v))), double(small));
    EXPECT_GE(double(n.dot(facing)), -double(small));
    const Point across = u.cross(v), rest = facing - facing.dot(u + (u.norm() > 0 ? 0 : 1) * v) * u;
    if (across.norm() > 1e-3L || (u.norm() > 0 && v.norm() > 0 && rest.norm() > 1e-3L)) {
      EXPECT_NEAR(1, double(n.norm()), 1e-6);
    }
  }

  void expectAll(const FeaturePairs& pairs, const FeaturePairDetails& found, const Body& a,
                 const Body& b) {
    const Real tolerance = toleranceOf(a, b);
    ASSERT_EQ(pairs.vertex_face.size(), found.vertex_face.size());
    ASSERT_EQ(pairs.face_vertex.size(), found.face_vertex.size());
    ASSERT_EQ(pairs.edge_edge.size(), found.edge_edge.size());
    for (std::size_t i = 0; i < pairs.vertex_face.size(); ++i) {
      const FeaturePair& p = pairs.vertex_face[i];
      expectVertexFace(found.vertex_face, i, a.vertex(p.first), b.face(p.second), 1, tolerance);
    }
    for (std::size_t i = 0; i < pairs.face_vertex.size(); ++i) {
      const FeaturePair& p = pairs.face_vertex[i];
      expectVertexFace(found.face_vertex, i, b.vertex(p.second), a.face(p.first), -1, tolerance);
    }
    for (std::size_t i = 0; i < pairs.edge_edge.size(); ++i) {
      const FeaturePair& p = pairs.edge_edge[i];
      const Point facing = normalOf(a.face(p.first / 3)) - normalOf(b.face(p.second / 3));
      expectEdgeEdge(found.edge_edge, i, a.edge(p.first), b.edge(p.second), facing, tolerance);
    }
  }

  RandomGeometry random_{4711};
  long pairs_ = 0, touching_ = 0;
};

TEST_F(FeatureDetailsTest, AreThoseOfLongDouble) {
  using Placed = Body;
  FeaturePairDetails found;
  for (int body = 0; body < manySteps(400) && !testing::Test::HasFailure(); ++body) {
    const bool is_lattice = this->random_.oneIn(2);
    Model a(this->soupOf(1 + this->random_.below(8), is_lattice)),
        b(this->soupOf(1 + this->random_.below(8), is_lattice));
    a.setThreads(1 + this->random_.below(3));
    fcl::Transform3d tf1 = fcl::Transform3d::Identity(), tf2 = tf1;
    if (this->random_.oneIn(3)) {
      tf1 = this->random_.pose(1);
      tf2 = this->random_.pose(1);
    }
    const FeaturePairs pairs = this->pairsOf(a, b, 1 + this->random_.below(3));
    featurePairDetails(a, tf1, b, tf2, pairs, found);
    this->expectAll(pairs, found, Placed(a, tf1), Placed(b, tf2));
  }
  std::printf("%ld pairs, %ld that touch\n", this->pairs_, this->touching_);
  EXPECT_GT(this->touching_, this->pairs_ / 100);
}

TEST_F(FeatureDetailsTest, OfOneMeshAreInItsOwnFrame) {
  using Placed = Body;
  const auto still = fcl::Transform3d::Identity();
  FeaturePairDetails found;
  for (int body = 0; body < manySteps(200) && !testing::Test::HasFailure(); ++body) {
    Model mesh(this->soupOf(2 + this->random_.below(10), this->random_.oneIn(2)));
    FeaturePairs pairs;
    selfFeaturePairsWithin(mesh, 0.3, pairs);
    selfFeaturePairDetails(mesh, pairs, found);
    this->expectAll(pairs, found, Placed(mesh, still), Placed(mesh, still));
    for (const double d : found.edge_edge.distances) EXPECT_LE(d, 0.3 * double(1 + 1e-6));
  }
  std::printf("%ld pairs, %ld that touch\n", this->pairs_, this->touching_);
}

// The outward directions of all triangles at an edge count.
TEST_F(FeatureDetailsTest, OfEdgesThatTouchPointWhereTheirSurfacesFace) {
  // Two roofs, one upside down on the other, ridge across ridge.
  TriangleMesh below;
  below.vertices = {{0, -1, 0}, {0, 1, 0}, {1, 0, -1}, {-1, 0, -1}};
  below.triangles = {{0, 2, 1}, {0, 1, 3}};
  const adaptive_bvh::DeformableMesh roof(below);
  fcl::Transform3d turned = fcl::Transform3d::Identity();
  turned.linear() << 0, 1, 0, 1, 0, 0, 0, 0, -1;
  FeaturePairs pairs;
  pairs.edge_edge = {{2, 2}};
  FeaturePairDetails found;
  featurePairDetails(roof, fcl::Transform3d(fcl::Transform3d::Identity()), roof, turned, pairs,
                     found);
  EXPECT_EQ(0, found.edge_edge.distances[0]);
  EXPECT_LE((found.edge_edge.normals[0] - fcl::Vector3d(0, 0, 1)).norm(), 1e-6);
  EXPECT_LE((found.edge_edge.coordinates[0] - fcl::Vector3d(0.5, 0.5, 0)).norm(), 1e-6);
}

TEST_F(FeatureDetailsTest, RefusesFeaturesThatAMeshDoesNotHave) {
  const adaptive_bvh::DeformableMesh mesh(this->soupOf(2, false));
  FeaturePairDetails found;
  found.edge_edge.resize(7);
  for (int kind = 0; kind < 3; ++kind)
    for (const FeaturePair bad : {FeaturePair{6, 0}, FeaturePair{0, 6}}) {
      FeaturePairs pairs;
      (kind == 0   ? pairs.vertex_face
       : kind == 1 ? pairs.face_vertex
                   : pairs.edge_edge) = {{0, 0}, bad};
      EXPECT_THROW(selfFeaturePairDetails(mesh, pairs, found), std::invalid_argument);
      EXPECT_EQ(7u, found.edge_edge.size());
    }
}

/// A part of a list: those pairs that a function names or a list has.
std::vector<FeaturePair> without(const std::vector<FeaturePair>& all, const IgnoredPairs& ignored) {
  std::set<FeaturePair> list;
  if (ignored.list) list.insert(ignored.list->begin(), ignored.list->end());
  std::vector<FeaturePair> kept;
  for (const FeaturePair& p : all)
    if (list.count(p) == 0 && !(ignored.test && ignored.test(p.first, p.second))) kept.push_back(p);
  return kept;
}

class IgnoredPairsTest : public testing::Test {
 protected:
  using Model = DeformableMesh;

  /// Half of the pairs as a list, or by a function, or both.
  IgnoredPairs anyOf(const std::vector<FeaturePair>& all, std::vector<FeaturePair>& memory) {
    IgnoredPairs ignored;
    const int kind = random_.below(3);
    if (kind != 1) {
      for (const FeaturePair& p : all)
        if (random_.oneIn(2)) memory.push_back(p);
      memory.push_back({7, 7000});  // which is none
      std::sort(memory.begin(), memory.end());
      ignored.list = &memory;
    }
    if (kind != 0) ignored.test = [](unsigned a, unsigned b) { return (a + 3 * b) % 4 == 1; };
    return ignored;
  }
  /// Two sheets through each other.
  static TriangleMesh sheets(int side) {
    TriangleMesh mesh = plate(side, side);
    for (fcl::Vector3d& p : mesh.vertices) p[2] += 0.1 * std::sin(7 * p[0]) * std::cos(5 * p[1]);
    return mesh;
  }

  RandomGeometry random_{815};
  const fcl::Transform3d still_ = fcl::Transform3d::Identity();
};

TEST_F(IgnoredPairsTest, AreLeftOutInOrder) {
  for (int round = 0; round < manySteps(8); ++round) {
    Model a(this->sheets(3 + this->random_.below(30))),
        b(this->sheets(3 + this->random_.below(30)));
    fcl::Transform3d tf = this->random_.pose(0.1);
    for (const int threads : {1, 3}) {
      a.setThreads(threads);
      std::vector<FeaturePair> list, vertices, faces, edges;
      ProximityRequest request;
      request.distance = 0.05;
      request.enable_distances = true;
      TrianglePairs all, kept;
      pairsWithin(a, this->still_, b, tf, request, all);
      request.ignored.triangles = this->anyOf(all.triangles, list);
      pairsWithin(a, this->still_, b, tf, request, kept);
      EXPECT_EQ(without(all.triangles, request.ignored.triangles), kept.triangles);
      EXPECT_EQ(kept.size(), kept.distances.size());

      FeaturePairs features, kept_features;
      FeatureProximityRequest wanted;
      wanted.distance = 0.05;
      featurePairsWithin(a, this->still_, b, tf, wanted.distance, features);
      wanted.ignored.vertex_face = this->anyOf(features.vertex_face, vertices);
      wanted.ignored.face_vertex = this->anyOf(features.face_vertex, faces);
      wanted.ignored.edge_edge = this->anyOf(features.edge_edge, edges);
      featurePairsWithin(a, this->still_, b, tf, wanted, kept_features);
      EXPECT_EQ(without(features.vertex_face, wanted.ignored.vertex_face),
                kept_features.vertex_face);
      EXPECT_EQ(without(features.face_vertex, wanted.ignored.face_vertex),
                kept_features.face_vertex);
      EXPECT_EQ(without(features.edge_edge, wanted.ignored.edge_edge), kept_features.edge_edge);
    }
  }
}

TEST_F(IgnoredPairsTest, OfOneMeshAreLeftOutInOrder) {
  for (int round = 0; round < manySteps(8); ++round) {
    TriangleMesh crumpled = this->sheets(4 + this->random_.below(25));
    for (fcl::Vector3d& p : crumpled.vertices) p += this->random_.point() * 0.1;
    Model mesh(crumpled);
    for (const int threads : {1, 3}) {
      mesh.setThreads(threads);
      std::vector<FeaturePair> list, vertices, edges, contacts;
      ProximityRequest request;
      request.distance = 0.03;
      request.ignored.neighbours = NeighbourFilter::SharedEdge;
      TrianglePairs all, kept;
      selfPairsWithin(mesh, request, all);
      request.ignored.triangles = this->anyOf(all.triangles, list);
      selfPairsWithin(mesh, request, kept);
      EXPECT_EQ(without(all.triangles, request.ignored.triangles), kept.triangles);

      FeaturePairs features, kept_features;
      FeatureProximityRequest wanted;
      wanted.distance = 0.03;
      selfFeaturePairsWithin(mesh, wanted.distance, features);
      wanted.ignored.vertex_face = this->anyOf(features.vertex_face, vertices);
      wanted.ignored.edge_edge = this->anyOf(features.edge_edge, edges);
      selfFeaturePairsWithin(mesh, wanted, kept_features);
      EXPECT_EQ(without(features.vertex_face, wanted.ignored.vertex_face),
                kept_features.vertex_face);
      EXPECT_EQ(without(features.edge_edge, wanted.ignored.edge_edge), kept_features.edge_edge);

      const auto collide = [&](const IgnoredPairs& ignored) {
        fcl::CollisionResultd result;
        adaptive_bvh::Ignored all_ignored;
        all_ignored.triangles = ignored;
        selfCollide(mesh, all_ignored, fcl::CollisionRequestd(1000000), result);
        std::vector<FeaturePair> pairs;
        for (std::size_t i = 0; i < result.numContacts(); ++i)
          pairs.push_back({unsigned(result.getContact(i).b1), unsigned(result.getContact(i).b2)});
        return pairs;
      };
      const std::vector<FeaturePair> touching = collide({});
      const IgnoredPairs ignored = this->anyOf(touching, contacts);
      EXPECT_EQ(without(touching, ignored), collide(ignored));
    }
  }
}

TEST_F(IgnoredPairsTest, AreRefusedWhereTheirListIsNotSorted) {
  const Model mesh(this->sheets(4));
  const std::vector<FeaturePair> unsorted = {{1, 2}, {1, 1}};
  ProximityRequest request;
  request.ignored.triangles.list = &unsorted;
  TrianglePairs pairs;
  pairs.triangles.resize(3);
  EXPECT_THROW(selfPairsWithin(mesh, request, pairs), std::invalid_argument);
  EXPECT_THROW(pairsWithin(mesh, this->still_, mesh, this->still_, request, pairs),
               std::invalid_argument);
  EXPECT_EQ(3u, pairs.size());
  FeaturePairs features;
  using adaptive_bvh::Ignored;
  for (auto kind : {&Ignored::vertex_face, &Ignored::face_vertex, &Ignored::edge_edge}) {
    FeatureProximityRequest wanted;
    (wanted.ignored.*kind).list = &unsorted;
    EXPECT_THROW(selfFeaturePairsWithin(mesh, wanted, features), std::invalid_argument);
    EXPECT_THROW(featurePairsWithin(mesh, this->still_, mesh, this->still_, wanted, features),
                 std::invalid_argument);
  }
  fcl::CollisionResultd result;
  EXPECT_THROW(selfCollide(mesh, request.ignored, fcl::CollisionRequestd(), result),
               std::invalid_argument);
}

}  // namespace feature_details_test
}  // namespace adaptive_bvh_test
