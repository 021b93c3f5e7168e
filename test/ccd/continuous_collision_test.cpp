// Continuous collision of deforming meshes against every pair of features, one by one.
#include "adaptive_bvh/continuous_collision.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "support/exact_geometry.h"
#include "support/random_geometry.h"
#include "support/test_mesh.h"
#include "triangles/time_of_impact.h"

namespace adaptive_bvh_test {
namespace continuous_collision_test {

using adaptive_bvh::DeformableMesh;
using adaptive_bvh::FeatureKind;
using adaptive_bvh::FeaturePair;
using adaptive_bvh::FeaturePairs;
using adaptive_bvh::Impact;
using adaptive_bvh::ImpactTimes;
using adaptive_bvh::Motion;
using P = Eigen::Vector3d;
using PairSet = std::set<std::pair<unsigned, unsigned>>;

/// A mesh at two times, in the world and in double precision.
struct Moving {
  std::vector<P> start, end;
  std::vector<fcl::Triangle> triangles;

  std::set<unsigned> usedVertices() const {
    std::set<unsigned> used;
    for (const auto& t : triangles)
      for (int k = 0; k < 3; ++k) used.insert(unsigned(t[k]));
    return used;
  }
  /// By their smallest numbers.
  std::map<unsigned, std::array<unsigned, 2>> edges() const {
    std::map<std::pair<unsigned, unsigned>, unsigned> numbers;
    std::map<unsigned, std::array<unsigned, 2>> edges;
    for (unsigned i = 0; i < 3 * triangles.size(); ++i) {
      const auto e = adaptive_bvh::edgeVertices(triangles.data(), i);
      if (e[0] != e[1] && numbers.emplace(std::minmax({e[0], e[1]}), i).second) edges[i] = e;
    }
    return edges;
  }
  template <typename Vertices>
  Eigen::AlignedBox3d swept(const Vertices& vertices) const {
    Eigen::AlignedBox3d box;
    for (const unsigned v : vertices) {
      box.extend(start[v]);
      box.extend(end[v]);
    }
    return box;
  }
  std::array<unsigned, 3> corners(unsigned t) const {
    return {unsigned(triangles[t][0]), unsigned(triangles[t][1]), unsigned(triangles[t][2])};
  }
};

/// How far apart boxes are along the axis along which they are farthest.
double gap(const Eigen::AlignedBox3d& a, const Eigen::AlignedBox3d& b) {
  return (a.min() - b.max()).cwiseMax(b.min() - a.max()).maxCoeff();
}

/// All pairs of features with the gap of their swept boxes.
struct AllPairs {
  using Gaps = std::map<std::pair<unsigned, unsigned>, double>;
  Gaps vertex_face, face_vertex, edge_edge;

  AllPairs(const Moving& a, const Moving& b) {
    const bool self = &a == &b;
    pointsAndFaces(a, b, self, false, vertex_face);
    if (!self) pointsAndFaces(b, a, false, true, face_vertex);
    for (const auto& [i, e] : a.edges())
      for (const auto& [j, f] : b.edges()) {
        if (self && (j <= i || e[0] == f[0] || e[0] == f[1] || e[1] == f[0] || e[1] == f[1]))
          continue;
        edge_edge[{i, j}] = gap(a.swept(e), b.swept(f));
      }
  }

 private:
  static void pointsAndFaces(const Moving& points, const Moving& faces, bool self, bool swapped,
                             Gaps& gaps) {
    for (const unsigned v : points.usedVertices()) {
      const auto box = points.swept(std::array<unsigned, 1>{v});
      for (unsigned t = 0; t < faces.triangles.size(); ++t) {
        const auto c = faces.corners(t);
        if (self && (c[0] == v || c[1] == v || c[2] == v)) continue;
        gaps[swapped ? std::make_pair(t, v) : std::make_pair(v, t)] = gap(box, faces.swept(c));
      }
    }
  }
};

PairSet setOf(const std::vector<FeaturePair>& pairs) {
  PairSet set;
  for (const FeaturePair& p : pairs) set.emplace(p.first, p.second);
  EXPECT_EQ(pairs.size(), set.size()) << "a pair twice";
  return set;
}

/// All required pairs are found, and others only if rounding may bring boxes together.
void expectPairs(const AllPairs::Gaps& all, const std::vector<FeaturePair>& found,
                 double separation, double tolerance) {
  const PairSet set = setOf(found);
  for (const auto& [pair, gap] : all) {
    if (gap <= separation) {
      ASSERT_TRUE(set.count(pair)) << pair.first << ' ' << pair.second << " gap " << gap;
    } else if (gap > separation + tolerance) {
      ASSERT_FALSE(set.count(pair)) << pair.first << ' ' << pair.second << " gap " << gap;
    }
  }
  for (const auto& pair : set) ASSERT_TRUE(all.count(pair));
}

template <typename S>
class ContinuousCollision : public testing::Test {
 protected:
  using Model = DeformableMesh<S>;
  using Points = std::vector<Vector3<S>>;

  /// A crumpled sheet or a tube, or triangles that share nothing, and where it goes.
  TriangleMesh<S> mesh(int kind) {
    if (kind == 2) return soup<S>(40, random_.engine());
    TriangleMesh<S> mesh = kind == 0 ? plate<S>(6, 5) : tube<S>(6, 6);
    for (auto& x : mesh.vertices) x += random_.point() * S(0.1);
    if (kind == 1) mesh.triangles[3].set(1, 2, 2);  // collapsed
    return mesh;
  }
  Points moved(const Points& from, S size) {
    Points to = from;
    const Vector3<S> together = random_.point() * size;
    for (auto& x : to) x += together + random_.point() * size * S(0.5);
    return to;
  }
  static std::vector<P> inWorld(const Points& points, const fcl::Transform3<S>& tf) {
    std::vector<P> world;
    for (const auto& x : points)
      world.push_back(tf.linear().template cast<double>() * x.template cast<double>() +
                      tf.translation().template cast<double>());
    return world;
  }
  static double sizeOf(const Moving& a, const Moving& b) {
    Eigen::AlignedBox3d box;
    for (const auto* points : {&a.start, &a.end, &b.start, &b.end})
      for (const P& x : *points) box.extend(x);
    return box.sizes().maxCoeff();
  }

  /// A model with the motion of one body, and what it is in the world.
  struct Body {
    Body(ContinuousCollision& test, int kind, S motion, S reach)
        : mesh(test.mesh(kind)), model(mesh) {
      end = test.moved(mesh.vertices, motion);
      if (reach > 0) {
        start_tf = test.random_.pose(reach);
        end_tf = test.random_.oneIn(2) ? start_tf : test.random_.pose(reach);
      }
      world = {inWorld(mesh.vertices, start_tf), inWorld(end, end_tf), mesh.triangles};
    }
    Motion<S> motion() const { return Motion<S>(model, mesh.vertices, end, start_tf, end_tf); }

    TriangleMesh<S> mesh;
    Model model;
    Points end;
    fcl::Transform3<S> start_tf = fcl::Transform3<S>::Identity(), end_tf = start_tf;
    Moving world;
  };

  /// The earliest of all, by their times.
  static Impact earliest(const FeaturePairs& pairs, const ImpactTimes& times) {
    Impact best;
    const auto take = [&](FeatureKind kind, const std::vector<FeaturePair>& of,
                          const std::vector<double>& at) {
      ASSERT_EQ(of.size(), at.size());
      for (std::size_t i = 0; i < of.size(); ++i)
        if (at[i] < best.time || (at[i] == best.time && kind == best.kind && of[i] < best.pair))
          best = {at[i], kind, of[i]};
    };
    take(FeatureKind::VertexFace, pairs.vertex_face, times.vertex_face);
    take(FeatureKind::FaceVertex, pairs.face_vertex, times.face_vertex);
    take(FeatureKind::EdgeEdge, pairs.edge_edge, times.edge_edge);
    return best;
  }
  static void expectSame(const Impact& a, const Impact& b) {
    ASSERT_EQ(a.time, b.time);
    if (!a.happens()) return;
    ASSERT_EQ(a.kind, b.kind);
    ASSERT_TRUE(a.pair == b.pair);
  }

  RandomGeometry<S> random_{31};
};

TYPED_TEST_SUITE(ContinuousCollision, QueryScalars);

/// Candidates of two meshes are the pairs whose swept boxes are near, and the earliest impact is
/// the earliest of theirs.
TYPED_TEST(ContinuousCollision, TwoMeshesAgainstAllPairs) {
  using S = TypeParam;
  int impacts = 0, none = 0;
  for (int round = 0; round < 24; ++round) {
    const S size = S(this->random_.size(-2, 0));
    const S reach = round % 2 ? S(0) : S(0.6);
    const typename TestFixture::Body a(*this, round % 3, size, reach),
        b(*this, round / 3 % 3, size, reach);
    const double separation = round % 4 < 2 ? 0 : this->random_.size(-3, -0.5);
    FeaturePairs pairs;
    candidates(a.motion(), b.motion(), separation, pairs);
    const AllPairs all(a.world, b.world);
    const double tolerance = 1e-5 * this->sizeOf(a.world, b.world) + 1e-5 * separation;
    expectPairs(all.vertex_face, pairs.vertex_face, separation, tolerance);
    expectPairs(all.face_vertex, pairs.face_vertex, separation, tolerance);
    expectPairs(all.edge_edge, pairs.edge_edge, separation, tolerance);
    ImpactTimes times;
    timesOfImpact(a.motion(), b.motion(), pairs, separation, times);
    const Impact first = this->earliest(pairs, times);
    this->expectSame(first, earliestImpact(a.motion(), b.motion(), separation));
    FeaturePairs again;
    this->expectSame(first, earliestImpact(a.motion(), b.motion(), separation, again));
    EXPECT_TRUE(pairs.vertex_face == again.vertex_face && pairs.edge_edge == again.edge_edge &&
                pairs.face_vertex == again.face_vertex);
    EXPECT_EQ(std::min(1., first.time), largestSafeStep(a.motion(), b.motion(), separation));
    if (first.happens()) {
      EXPECT_EQ(first.time,
                timeOfImpact(a.motion(), b.motion(), first.kind, first.pair, separation));
    }
    (first.happens() ? impacts : none) += 1;
  }
  EXPECT_GT(impacts, 3);
}

/// Of one mesh with itself, too; features that share a vertex are left out.
TYPED_TEST(ContinuousCollision, OneMeshAgainstAllPairs) {
  using S = TypeParam;
  int impacts = 0;
  for (int round = 0; round < 24; ++round) {
    const typename TestFixture::Body a(*this, round % 3, S(this->random_.size(-3, 0)),
                                       round % 2 ? S(0) : S(10));
    const double separation = round % 4 < 2 ? 0 : this->random_.size(-4, -1);
    FeaturePairs pairs;
    candidates(a.motion(), separation, pairs);
    const AllPairs all(a.world, a.world);
    const double tolerance = 1e-5 * this->sizeOf(a.world, a.world) + 1e-5 * separation;
    expectPairs(all.vertex_face, pairs.vertex_face, separation, tolerance);
    expectPairs(all.edge_edge, pairs.edge_edge, separation, tolerance);
    EXPECT_TRUE(pairs.face_vertex.empty());
    ImpactTimes times;
    timesOfImpact(a.motion(), pairs, separation, times);
    const Impact first = this->earliest(pairs, times);
    this->expectSame(first, earliestImpact(a.motion(), separation));
    FeaturePairs again;
    this->expectSame(first, earliestImpact(a.motion(), separation, again));
    EXPECT_TRUE(pairs.vertex_face == again.vertex_face && pairs.edge_edge == again.edge_edge);
    EXPECT_EQ(std::min(1., first.time), largestSafeStep(a.motion(), separation));
    if (first.happens()) {
      EXPECT_EQ(first.time, timeOfImpact(a.motion(), first.kind, first.pair, separation));
    }
    impacts += first.happens();
  }
  EXPECT_GT(impacts, 3);
}

/// A two-frame update says what moves, and how.
TYPED_TEST(ContinuousCollision, TwoFrameUpdate) {
  using S = TypeParam;
  for (int round = 0; round < 4; ++round) {
    typename TestFixture::Body a(*this, 0, S(0.1), 0);
    const double expected = earliestImpact(a.motion(), 0.).time;
    EXPECT_THROW(Motion<S>{a.model}, std::invalid_argument);
    a.model.updateTwoFrames(a.end);
    EXPECT_EQ(expected, earliestImpact(Motion<S>(a.model), 0.).time);
    EXPECT_TRUE(a.model.validate());
    a.model.update(a.end);
    EXPECT_THROW(Motion<S>{a.model}, std::invalid_argument) << "one frame again";
  }
}

/// Whatever vertices do within their safe displacements, nothing comes together.
TYPED_TEST(ContinuousCollision, SafeDisplacements) {
  using S = TypeParam;
  int bounded = 0, whole = 0;
  for (int round = 0; round < 24; ++round) {
    const typename TestFixture::Body a(*this, round % 3, S(this->random_.size(-2, 0)), 0),
        b(*this, (round + 1) % 3, S(this->random_.size(-2, 0)), S(1.2));
    const double separation = round % 4 < 2 ? 0 : 1e-3;
    std::vector<double> self, of_a, of_b;
    safeDisplacements(a.motion(), separation, self);
    safeDisplacements(a.motion(), b.motion(), separation, of_a, of_b);
    ASSERT_EQ(a.end.size(), self.size());
    ASSERT_EQ(a.end.size(), of_a.size());
    ASSERT_EQ(b.end.size(), of_b.size());
    // Anywhere within, in the model's frame; a little less, for the rounding of positions.
    const auto within = [&](const typename TestFixture::Body& body,
                            const std::vector<double>& safe) {
      const S turned = S(this->random_.oneIn(2));
      typename TestFixture::Points to = body.mesh.vertices;
      for (std::size_t v = 0; v < to.size(); ++v) {
        const Vector3<S> own = body.end[v] - to[v];
        const Vector3<S> way =
            turned > 0 && own.norm() > 0 ? Vector3<S>(own.normalized()) : this->random_.direction();
        to[v] += way * (S(safe[v]) * S(0.9999));
        const double wanted = (body.world.end[v] - body.world.start[v]).norm();
        EXPECT_LE(safe[v], wanted * (1 + 1e-12));
        (safe[v] < wanted * (1 - 1e-9) ? bounded : whole) += 1;
      }
      return to;
    };
    const bool apart_alone =
        earliestImpact(Motion<S>(a.model, a.mesh.vertices, a.mesh.vertices), separation).time > 0;
    const Motion<S> b_rest(b.model, b.mesh.vertices, b.mesh.vertices, b.start_tf, b.start_tf);
    const bool apart =
        earliestImpact(Motion<S>(a.model, a.mesh.vertices, a.mesh.vertices), b_rest, separation)
            .time > 0;
    for (int trial = 0; trial < 4; ++trial) {
      const auto to_self = within(a, self), to_a = within(a, of_a), to_b = within(b, of_b);
      if (apart_alone) {
        EXPECT_FALSE(
            earliestImpact(Motion<S>(a.model, a.mesh.vertices, to_self), separation).happens());
      }
      if (apart) {
        EXPECT_FALSE(
            earliestImpact(Motion<S>(a.model, a.mesh.vertices, to_a),
                           Motion<S>(b.model, b.mesh.vertices, to_b, b.start_tf, b.start_tf),
                           separation)
                .happens());
      }
    }
  }
  EXPECT_GT(bounded, 500);
  EXPECT_GT(whole, 500);
}

/// On two threads there are the same pairs in the same order, and the same earliest impact.
TYPED_TEST(ContinuousCollision, OnThreads) {
  using S = TypeParam;
  TriangleMesh<S> mesh = plate<S>(60, 60);
  for (auto& x : mesh.vertices) x += this->random_.point() * S(0.02);
  typename TestFixture::Model model(mesh);
  const auto end = this->moved(mesh.vertices, S(0.03));
  const Motion<S> motion(model, mesh.vertices, end);
  FeaturePairs one, two;
  ImpactTimes times_one, times_two;
  candidates(motion, 1e-3, one);
  timesOfImpact(motion, one, 1e-3, times_one);
  const Impact first = earliestImpact(motion, 1e-3);
  const Impact between = earliestImpact(motion, motion, 0);
  model.setQueryThreads(2);
  candidates(motion, 1e-3, two);
  timesOfImpact(motion, two, 1e-3, times_two);
  EXPECT_GT(one.size(), 10000u);
  EXPECT_TRUE(one.vertex_face == two.vertex_face);
  EXPECT_TRUE(one.edge_edge == two.edge_edge);
  EXPECT_EQ(times_one.vertex_face, times_two.vertex_face);
  EXPECT_EQ(times_one.edge_edge, times_two.edge_edge);
  this->expectSame(first, earliestImpact(motion, 1e-3));
  this->expectSame(first, earliestImpact(motion, 1e-3, two));
  EXPECT_TRUE(one.edge_edge == two.edge_edge);
  this->expectSame(between, earliestImpact(motion, motion, 0));
  EXPECT_EQ(0, between.time) << "a mesh touches its like from the start";
}

/// Wrong calls are refused.
TYPED_TEST(ContinuousCollision, Refuses) {
  using S = TypeParam;
  const typename TestFixture::Body a(*this, 0, S(0.2), 0);
  const Motion<S> motion = a.motion();
  FeaturePairs pairs;
  ImpactTimes times;
  std::vector<double> safe;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double separation : {-1., nan, std::numeric_limits<double>::infinity()}) {
    EXPECT_THROW(candidates(motion, separation, pairs), std::invalid_argument);
    EXPECT_THROW(earliestImpact(motion, motion, separation), std::invalid_argument);
    EXPECT_THROW(timesOfImpact(motion, pairs, separation, times), std::invalid_argument);
    EXPECT_THROW(safeDisplacements(motion, separation, safe), std::invalid_argument);
    EXPECT_THROW(timeOfImpact(motion, FeatureKind::EdgeEdge, {0, 1}, separation),
                 std::invalid_argument);
  }
  auto short_end = a.end;
  short_end.pop_back();
  EXPECT_THROW(Motion<S>(a.model, a.mesh.vertices, short_end), std::invalid_argument);
  EXPECT_THROW(Motion<S>(a.model, short_end, short_end), std::invalid_argument);
  EXPECT_THROW(Motion<S>(a.model, nullptr, nullptr, a.end.size()), std::invalid_argument);
  for (const S bad : {S(nan), std::numeric_limits<S>::infinity()}) {
    auto end = a.end;
    end.back()[1] = bad;
    const Motion<S> broken(a.model, a.mesh.vertices, end);
    EXPECT_THROW(earliestImpact(broken), std::invalid_argument);
    EXPECT_THROW(timeOfImpact(broken, FeatureKind::EdgeEdge, {0, 1}), std::invalid_argument);
    auto tf = fcl::Transform3<S>(fcl::Transform3<S>::Identity());
    tf.translation()[0] = bad;
    EXPECT_THROW(earliestImpact(Motion<S>(a.model, a.end, a.end, tf, tf)), std::invalid_argument);
  }
  const unsigned vertices = unsigned(a.end.size()), faces = unsigned(a.mesh.triangles.size());
  for (const FeaturePair& pair : {FeaturePair{vertices, 0}, FeaturePair{0, faces}})
    EXPECT_THROW(timeOfImpact(motion, FeatureKind::VertexFace, pair), std::invalid_argument);
  EXPECT_THROW(timeOfImpact(motion, FeatureKind::FaceVertex, {0, 0}), std::invalid_argument);
  EXPECT_THROW(timeOfImpact(motion, motion, FeatureKind::FaceVertex, {faces, 0}),
               std::invalid_argument);
  EXPECT_THROW(timeOfImpact(motion, FeatureKind::EdgeEdge, {3 * faces, 0}), std::invalid_argument);
  pairs.edge_edge.push_back({0, 3 * faces});
  EXPECT_THROW(timesOfImpact(motion, pairs, 0, times), std::invalid_argument);
}

/// A motion in which nothing moves, and a mesh that is a point.
TYPED_TEST(ContinuousCollision, AtRestAndCollapsed) {
  using S = TypeParam;
  const typename TestFixture::Body a(*this, 2, S(0), 0);
  const Motion<S> at_rest(a.model, a.mesh.vertices, a.mesh.vertices);
  const Impact none = earliestImpact(at_rest);
  EXPECT_TRUE(!none.happens() || none.time == 0);
  const typename TestFixture::Points point(a.mesh.vertices.size(), Vector3<S>(1, 2, 3));
  EXPECT_EQ(0, earliestImpact(Motion<S>(a.model, point, point)).time);
  const double shrinking = earliestImpact(Motion<S>(a.model, a.mesh.vertices, point)).time;
  EXPECT_LE(shrinking, 1);
}

}  // namespace continuous_collision_test
}  // namespace adaptive_bvh_test
