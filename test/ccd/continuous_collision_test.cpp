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

class ContinuousCollision : public testing::Test {
 protected:
  using Model = DeformableMesh;
  using Points = std::vector<fcl::Vector3d>;

  /// A crumpled sheet or a tube, or triangles that share nothing, and where it goes.
  TriangleMesh mesh(int kind) {
    if (kind == 2) return soup(40, random_.engine());
    TriangleMesh mesh = kind == 0 ? plate(6, 5) : tube(6, 6);
    for (auto& x : mesh.vertices) x += random_.point() * 0.1;
    if (kind == 1) mesh.triangles[3].set(1, 2, 2);  // collapsed
    return mesh;
  }
  Points moved(const Points& from, double size) {
    Points to = from;
    const fcl::Vector3d together = random_.point() * size;
    for (auto& x : to) x += together + random_.point() * size * 0.5;
    return to;
  }
  static std::vector<P> inWorld(const Points& points, const fcl::Transform3d& tf) {
    std::vector<P> world;
    for (const auto& x : points) world.push_back(tf.linear() * x + tf.translation());
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
    Body(ContinuousCollision& test, int kind, double motion, double reach)
        : mesh(test.mesh(kind)), model(mesh) {
      end = test.moved(mesh.vertices, motion);
      if (reach > 0) {
        start_tf = test.random_.pose(reach);
        end_tf = test.random_.oneIn(2) ? start_tf : test.random_.pose(reach);
      }
      world = {inWorld(mesh.vertices, start_tf), inWorld(end, end_tf), mesh.triangles};
    }
    Motion motion() const { return Motion(model, mesh.vertices, end, start_tf, end_tf); }

    TriangleMesh mesh;
    Model model;
    Points end;
    fcl::Transform3d start_tf = fcl::Transform3d::Identity(), end_tf = start_tf;
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
    if (!a.exists()) return;
    ASSERT_EQ(a.kind, b.kind);
    ASSERT_TRUE(a.pair == b.pair);
  }

  RandomGeometry random_{31};
};

/// Candidates of two meshes are the pairs whose swept boxes are near, and the earliest impact is
/// the earliest of theirs.
TEST_F(ContinuousCollision, TwoMeshesAgainstAllPairs) {
  int impacts = 0, none = 0;
  for (int round = 0; round < 24; ++round) {
    const double size = double(this->random_.size(-2, 0));
    const double reach = round % 2 ? 0. : 0.6;
    const Body a(*this, round % 3, size, reach), b(*this, round / 3 % 3, size, reach);
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
    if (first.exists()) {
      EXPECT_EQ(first.time,
                timeOfImpact(a.motion(), b.motion(), first.kind, first.pair, separation));
    }
    (first.exists() ? impacts : none) += 1;
  }
  EXPECT_GT(impacts, 3);
}

/// Of one mesh with itself, too; features that share a vertex are left out.
TEST_F(ContinuousCollision, OneMeshAgainstAllPairs) {
  int impacts = 0;
  for (int round = 0; round < 24; ++round) {
    const Body a(*this, round % 3, double(this->random_.size(-3, 0)), round % 2 ? 0. : 10.);
    const double separation = round % 4 < 2 ? 0 : this->random_.size(-4, -1);
    FeaturePairs pairs;
    selfCandidates(a.motion(), separation, pairs);
    const AllPairs all(a.world, a.world);
    const double tolerance = 1e-5 * this->sizeOf(a.world, a.world) + 1e-5 * separation;
    expectPairs(all.vertex_face, pairs.vertex_face, separation, tolerance);
    expectPairs(all.edge_edge, pairs.edge_edge, separation, tolerance);
    EXPECT_TRUE(pairs.face_vertex.empty());
    ImpactTimes times;
    selfTimesOfImpact(a.motion(), pairs, separation, times);
    const Impact first = this->earliest(pairs, times);
    this->expectSame(first, selfEarliestImpact(a.motion(), separation));
    FeaturePairs again;
    this->expectSame(first, selfEarliestImpact(a.motion(), separation, again));
    EXPECT_TRUE(pairs.vertex_face == again.vertex_face && pairs.edge_edge == again.edge_edge);
    EXPECT_EQ(std::min(1., first.time), selfLargestSafeStep(a.motion(), separation));
    if (first.exists()) {
      EXPECT_EQ(first.time, selfTimeOfImpact(a.motion(), first.kind, first.pair, separation));
    }
    impacts += first.exists();
  }
  EXPECT_GT(impacts, 3);
}

/// A two-frame update says what moves, and how.
TEST_F(ContinuousCollision, TwoFrameUpdate) {
  for (int round = 0; round < 4; ++round) {
    Body a(*this, 0, 0.1, 0);
    const double expected = selfEarliestImpact(a.motion(), 0.).time;
    EXPECT_THROW(Motion{a.model}, std::invalid_argument);
    a.model.updateTwoFrames(a.end);
    EXPECT_EQ(expected, selfEarliestImpact(Motion(a.model), 0.).time);
    EXPECT_TRUE(a.model.validate());
    a.model.update(a.end);
    EXPECT_THROW(Motion{a.model}, std::invalid_argument) << "one frame again";
  }
}

/// Whatever vertices do within their safe displacements, nothing comes together.
TEST_F(ContinuousCollision, SafeDisplacements) {
  int bounded = 0, whole = 0;
  for (int round = 0; round < 24; ++round) {
    const Body a(*this, round % 3, double(this->random_.size(-2, 0)), 0),
        b(*this, (round + 1) % 3, double(this->random_.size(-2, 0)), 1.2);
    const double separation = round % 4 < 2 ? 0 : 1e-3;
    std::vector<double> self, of_a, of_b;
    selfSafeDisplacements(a.motion(), separation, self);
    safeDisplacements(a.motion(), b.motion(), separation, of_a, of_b);
    ASSERT_EQ(a.end.size(), self.size());
    ASSERT_EQ(a.end.size(), of_a.size());
    ASSERT_EQ(b.end.size(), of_b.size());
    // Anywhere within, in the model's frame; a little less, for the rounding of positions.
    const auto within = [&](const Body& body, const std::vector<double>& safe) {
      const double turned = double(this->random_.oneIn(2));
      Points to = body.mesh.vertices;
      for (std::size_t v = 0; v < to.size(); ++v) {
        const fcl::Vector3d own = body.end[v] - to[v];
        const fcl::Vector3d way = turned > 0 && own.norm() > 0 ? fcl::Vector3d(own.normalized())
                                                               : this->random_.direction();
        to[v] += way * (double(safe[v]) * 0.9999);
        const double wanted = (body.world.end[v] - body.world.start[v]).norm();
        EXPECT_LE(safe[v], wanted * (1 + 1e-12));
        (safe[v] < wanted * (1 - 1e-9) ? bounded : whole) += 1;
      }
      return to;
    };
    const bool apart_alone =
        selfEarliestImpact(Motion(a.model, a.mesh.vertices, a.mesh.vertices), separation).time > 0;
    const Motion b_rest(b.model, b.mesh.vertices, b.mesh.vertices, b.start_tf, b.start_tf);
    const bool apart =
        earliestImpact(Motion(a.model, a.mesh.vertices, a.mesh.vertices), b_rest, separation).time >
        0;
    for (int trial = 0; trial < 4; ++trial) {
      const auto to_self = within(a, self), to_a = within(a, of_a), to_b = within(b, of_b);
      if (apart_alone) {
        EXPECT_FALSE(
            selfEarliestImpact(Motion(a.model, a.mesh.vertices, to_self), separation).exists());
      }
      if (apart) {
        EXPECT_FALSE(earliestImpact(Motion(a.model, a.mesh.vertices, to_a),
                                    Motion(b.model, b.mesh.vertices, to_b, b.start_tf, b.start_tf),
                                    separation)
                         .exists());
      }
    }
  }
  EXPECT_GT(bounded, 500);
  EXPECT_GT(whole, 500);
}

/// On two threads there are the same pairs in the same order, and the same earliest impact.
TEST_F(ContinuousCollision, OnThreads) {
  TriangleMesh mesh = plate(60, 60);
  for (auto& x : mesh.vertices) x += this->random_.point() * 0.02;
  Model model(mesh);
  const auto end = this->moved(mesh.vertices, 0.03);
  const Motion motion(model, mesh.vertices, end);
  FeaturePairs one, two;
  ImpactTimes times_one, times_two;
  selfCandidates(motion, 1e-3, one);
  selfTimesOfImpact(motion, one, 1e-3, times_one);
  const Impact first = selfEarliestImpact(motion, 1e-3);
  const Impact between = earliestImpact(motion, motion, 0);
  model.setThreads(2);
  selfCandidates(motion, 1e-3, two);
  selfTimesOfImpact(motion, two, 1e-3, times_two);
  EXPECT_GT(one.size(), 10000u);
  EXPECT_TRUE(one.vertex_face == two.vertex_face);
  EXPECT_TRUE(one.edge_edge == two.edge_edge);
  EXPECT_EQ(times_one.vertex_face, times_two.vertex_face);
  EXPECT_EQ(times_one.edge_edge, times_two.edge_edge);
  this->expectSame(first, selfEarliestImpact(motion, 1e-3));
  this->expectSame(first, selfEarliestImpact(motion, 1e-3, two));
  EXPECT_TRUE(one.edge_edge == two.edge_edge);
  this->expectSame(between, earliestImpact(motion, motion, 0));
  EXPECT_EQ(0, between.time) << "a mesh touches its like from the start";
}

/// Wrong calls are refused.
TEST_F(ContinuousCollision, Refuses) {
  const Body a(*this, 0, 0.2, 0);
  const Motion motion = a.motion();
  FeaturePairs pairs;
  ImpactTimes times;
  std::vector<double> safe;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double separation : {-1., nan, std::numeric_limits<double>::infinity()}) {
    EXPECT_THROW(selfCandidates(motion, separation, pairs), std::invalid_argument);
    EXPECT_THROW(earliestImpact(motion, motion, separation), std::invalid_argument);
    EXPECT_THROW(selfTimesOfImpact(motion, pairs, separation, times), std::invalid_argument);
    EXPECT_THROW(selfSafeDisplacements(motion, separation, safe), std::invalid_argument);
    EXPECT_THROW(selfTimeOfImpact(motion, FeatureKind::EdgeEdge, {0, 1}, separation),
                 std::invalid_argument);
  }
  auto short_end = a.end;
  short_end.pop_back();
  EXPECT_THROW(Motion(a.model, a.mesh.vertices, short_end), std::invalid_argument);
  EXPECT_THROW(Motion(a.model, short_end, short_end), std::invalid_argument);
  EXPECT_THROW(Motion(a.model, nullptr, nullptr, a.end.size()), std::invalid_argument);
  for (const double bad : {double(nan), std::numeric_limits<double>::infinity()}) {
    auto end = a.end;
    end.back()[1] = bad;
    const Motion broken(a.model, a.mesh.vertices, end);
    EXPECT_THROW(selfEarliestImpact(broken), std::invalid_argument);
    EXPECT_THROW(selfTimeOfImpact(broken, FeatureKind::EdgeEdge, {0, 1}), std::invalid_argument);
    auto tf = fcl::Transform3d(fcl::Transform3d::Identity());
    tf.translation()[0] = bad;
    EXPECT_THROW(selfEarliestImpact(Motion(a.model, a.end, a.end, tf, tf)), std::invalid_argument);
  }
  const unsigned vertices = unsigned(a.end.size()), faces = unsigned(a.mesh.triangles.size());
  for (const FeaturePair& pair : {FeaturePair{vertices, 0}, FeaturePair{0, faces}})
    EXPECT_THROW(selfTimeOfImpact(motion, FeatureKind::VertexFace, pair), std::invalid_argument);
  EXPECT_THROW(selfTimeOfImpact(motion, FeatureKind::FaceVertex, {0, 0}), std::invalid_argument);
  EXPECT_THROW(timeOfImpact(motion, motion, FeatureKind::FaceVertex, {faces, 0}),
               std::invalid_argument);
  EXPECT_THROW(selfTimeOfImpact(motion, FeatureKind::EdgeEdge, {3 * faces, 0}),
               std::invalid_argument);
  pairs.edge_edge.push_back({0, 3 * faces});
  EXPECT_THROW(selfTimesOfImpact(motion, pairs, 0, times), std::invalid_argument);
}

/// A motion in which nothing moves, and a mesh that is a point.
TEST_F(ContinuousCollision, AtRestAndCollapsed) {
  const Body a(*this, 2, 0., 0);
  const Motion at_rest(a.model, a.mesh.vertices, a.mesh.vertices);
  const Impact none = selfEarliestImpact(at_rest);
  EXPECT_TRUE(!none.exists() || none.time == 0);
  const Points point(a.mesh.vertices.size(), fcl::Vector3d(1, 2, 3));
  EXPECT_EQ(0, selfEarliestImpact(Motion(a.model, point, point)).time);
  const double shrinking = selfEarliestImpact(Motion(a.model, a.mesh.vertices, point)).time;
  EXPECT_LE(shrinking, 1);
}

}  // namespace continuous_collision_test
}  // namespace adaptive_bvh_test
