// Scenes: random bodies of all kinds, added, removed, moved, deformed and filtered. The judge goes
// over all pairs: distances of meshes in long double, everything else by the query of the pair,
// which other tests judge.
#include "adaptive_bvh/scene.h"

#include <gtest/gtest.h>

#include <fcl/geometry/octree/octree.h>
#include <octomap/octomap.h>

#include "adaptive_bvh/point_query.h"
#include "adaptive_bvh/query.h"
#include "adaptive_bvh/self_collision.h"
#include "deformable/mesh_state.h"
#include "support/closed_bodies.h"
#include "support/exact_geometry.h"
#include "support/fcl_float.h"
#include "support/long_mode.h"
#include "support/random_geometry.h"
#include "support/shape_oracle.h"
#include "support/test_mesh.h"

namespace adaptive_bvh_test {
namespace scene_test {

using adaptive_bvh::BodyId;
using adaptive_bvh::BodyOptions;
using adaptive_bvh::BodyPair;
using adaptive_bvh::DeformableMesh;
using adaptive_bvh::FeaturePairs;
using adaptive_bvh::ProximityRequest;
using adaptive_bvh::RayHit;
using adaptive_bvh::RayRange;
using adaptive_bvh::Scene;
using adaptive_bvh::SceneCollisionRequest;
using adaptive_bvh::SceneCollisions;
using adaptive_bvh::SceneDistance;
using adaptive_bvh::SceneFeaturePairs;
using adaptive_bvh::SceneRayHit;
using adaptive_bvh::SceneTrianglePairs;
using adaptive_bvh::SceneVertexContacts;
using adaptive_bvh::TrianglePairs;
using adaptive_bvh::VertexContacts;
using exact::Real;

constexpr double kFar = std::numeric_limits<double>::infinity();

/// A body as the judge knows it.
struct Judged {
  BodyId id;
  std::shared_ptr<const fcl::CollisionGeometryd> geometry;
  std::shared_ptr<DeformableMesh> mesh;  ///< null of another geometry
  fcl::Transform3d tf;
  BodyOptions options;
};

class SceneTest : public testing::Test {
 protected:
  using P = fcl::Vector3d;
  using Transform = fcl::Transform3d;

  // ---- A random scene

  void fill(int count) {
    for (int i = 0; i < count; ++i) add();
  }
  void add() {
    Judged body;
    body.tf = pose();
    body.options.group = random_.oneIn(4) ? 2 : 1;
    if (random_.oneIn(4)) body.options.mask = 1u + unsigned(random_.below(3));
    if (!bodies_.empty() && random_.oneIn(8)) {  // shares a geometry
      const Judged& other = any();
      body.geometry = other.geometry;
      body.mesh = other.mesh;
    } else if (random_.below(5) < 3) {
      body.mesh = std::make_shared<DeformableMesh>(mesh());
      body.geometry = body.mesh;
    } else {
      body.geometry = shape();
    }
    body.options.self_collision = body.mesh && random_.oneIn(4);
    body.options.solid = body.mesh && isWatertight(*body.mesh) && !random_.oneIn(4);
    body.id = random_.oneIn(2) ? scene_.add(body.geometry, body.tf, body.options)
                               : scene_.add(*body.geometry, body.tf, body.options);
    bodies_.push_back(body);
    starts_[body.id] = body.tf;
  }
  TriangleMesh mesh() {
    TriangleMesh mesh;
    switch (random_.below(3)) {
      case 0: mesh = latticeBox(1); break;
      case 1: mesh = tube(3, 2); break;
      default:
        mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
        for (const auto& t : {std::array<std::size_t, 3>{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}})
          mesh.triangles.emplace_back(t[0], t[1], t[2]);
    }
    if (random_.oneIn(4))  // others may be inside
      for (P& x : mesh.vertices) x *= 6;
    return mesh;
  }
  std::shared_ptr<const fcl::CollisionGeometryd> shape() {
    using namespace judged_shapes;
    const auto size = [&] { return double(random_.uniform(0.2, 1.5)); };
    const P sizes(size(), size(), size());
    switch (random_.below(10)) {
      case 0: return sphere(size()).geometry;
      case 1: return capsule(size(), size()).geometry;
      case 2: return box(sizes).geometry;
      case 3: return cylinder(size(), size()).geometry;
      case 4: return cone(size(), size()).geometry;
      case 5: return ellipsoid(sizes).geometry;
      case 6: return octahedron(sizes, P::Zero()).geometry;
      case 7: return flat(P::UnitZ(), -3, random_.oneIn(2)).geometry;
      default: return octree();
    }
  }
  std::shared_ptr<const fcl::CollisionGeometryd> octree() {
    auto tree = std::make_shared<octomap::OcTree>(0.25);
    for (int i = 0; i < 6; ++i) {
      const P x = random_.point();
      tree->updateNode(octomap::point3d(float(x[0]), float(x[1]), float(x[2])), true);
    }
    return std::make_shared<fcl::OcTreed>(tree);
  }
  /// On the lattice half of the time.
  Transform pose() {
    if (random_.oneIn(2)) return random_.pose(extent_);
    Transform tf = Transform::Identity();
    const int n = int(extent_) + 1;
    for (int k = 0; k < 3; ++k) tf.translation()[k] = double(random_.below(2 * n + 1) - n);
    return tf;
  }
  Judged& any() { return bodies_[std::size_t(random_.below(int(bodies_.size())))]; }

  void change() {
    switch (random_.below(8)) {
      case 0: return add();
      case 1: {
        if (bodies_.size() < 3) return;
        const auto at = random_.below(int(bodies_.size()));
        const BodyId id = bodies_[std::size_t(at)].id;
        scene_.remove(id);
        bodies_.erase(bodies_.begin() + at);
        const auto names = [&](const BodyPair& p) { return p.first == id || p.second == id; };
        for (auto i = ignored_.begin(); i != ignored_.end();)
          i = names(*i) ? ignored_.erase(i) : std::next(i);
        return;
      }
      case 2: {
        Judged& body = any();
        body.options.mask = 1u + unsigned(random_.below(3));
        return scene_.setOptions(body.id, body.options);
      }
      case 3: {
        const BodyId a = any().id, b = any().id;
        const BodyPair pair{std::min(a, b), std::max(a, b)};
        if (ignored_.count(pair)) {
          scene_.unignore(a, b);
          ignored_.erase(pair);
        } else {
          scene_.ignore(b, a);
          ignored_.insert(pair);
        }
        return;
      }
      case 4:
      case 5: {
        Judged& body = any();
        if (!body.mesh) return;
        std::vector<P> positions = body.mesh->vertices();
        for (P& x : positions) x += 0.1 * random_.point();
        random_.oneIn(2) ? body.mesh->update(positions) : body.mesh->updateTwoFrames(positions);
        return;
      }
      default: {
        Judged& body = any();
        body.tf = pose();
        scene_.setTransform(body.id, body.tf);
      }
    }
  }

  // ---- The judge

  bool admits(const Judged& a, const Judged& b) const {
    if (!(a.options.group & b.options.mask) || !(b.options.group & a.options.mask)) return false;
    if (is_filtered_ && (a.id + b.id) % 3 == 0) return false;
    return ignored_.count({std::min(a.id, b.id), std::max(a.id, b.id)}) == 0;
  }
  template <typename Do>
  void forEachPair(const Do& act) const {
    for (std::size_t i = 0; i < bodies_.size(); ++i)
      for (std::size_t j = i + 1; j < bodies_.size(); ++j)
        if (admits(bodies_[i], bodies_[j])) act(bodies_[i], bodies_[j]);
  }
  static std::vector<exact::Triangle> trianglesOf(const Judged& body) {
    const exact::Placement place = exact::placement(body.tf);
    std::vector<exact::Triangle> triangles;
    for (const fcl::Triangle& t : body.mesh->triangles()) {
      exact::Triangle corners;
      for (int k = 0; k < 3; ++k) corners[std::size_t(k)] = exact::of(body.mesh->vertices()[t[k]]);
      triangles.push_back(place(corners));
    }
    return triangles;
  }
  /// A scene of some bodies alone. scene_shapes_test.cpp judges what such a scene says of shapes.
  static Scene sceneOf(std::initializer_list<const Judged*> bodies) {
    Scene scene;
    for (const Judged* body : bodies) scene.add(body->geometry, body->tf);
    scene.update();
    return scene;
  }
  /// Of two meshes in the world, in long double; of others by the query of the pair.
  static double distanceOf(const Judged& a, const Judged& b) {
    if (!a.mesh && !b.mesh) return double(sceneOf({&a, &b}).distance().distance);
    if (!a.mesh || !b.mesh) {
      fcl::DistanceResultd result;
      return double(adaptive_bvh::distance(a.geometry.get(), a.tf, b.geometry.get(), b.tf,
                                           fcl::DistanceRequestd(), result));
    }
    Real least = std::numeric_limits<Real>::max();
    const auto first = trianglesOf(a), second = trianglesOf(b);
    for (const exact::Triangle& p : first)
      for (const exact::Triangle& q : second) least = std::min(least, exact::distance(p, q));
    return double(least);
  }

  /// Whether a body is inside of a solid one, where their surfaces do not touch.
  static bool isInside(const Judged& inner, const Judged& around) {
    if (!around.options.solid || inner.geometry->getNodeType() == fcl::GEOM_OCTREE) return false;
    P x = inner.mesh ? inner.mesh->vertices()[0] : P(P::Zero());
    if (inner.geometry->getNodeType() == fcl::GEOM_CONVEX)
      x = static_cast<const fcl::Convexd&>(*inner.geometry).getVertices()[0];
    if (inner.geometry->getNodeType() == fcl::GEOM_PLANE ||
        inner.geometry->getNodeType() == fcl::GEOM_HALFSPACE)
      return false;
    const exact::Point in_world = exact::placement(inner.tf)(exact::of(x));
    return std::round(
               windingNumberOf(*around.mesh, exact::placement(around.tf).inverse(in_world))) != 0;
  }

  void expectCollisions() {
    std::vector<BodyPair> expected;
    std::vector<std::size_t> counts;
    const fcl::CollisionRequestd all(100000, true);
    const auto note = [&](BodyId a, BodyId b, const fcl::CollisionResultd& result) {
      if (!result.isCollision()) return;
      expected.push_back({a, b});
      counts.push_back(result.numContacts());
    };
    forEachPair([&](const Judged& a, const Judged& b) {
      if (!a.mesh && !b.mesh) {
        SceneCollisions of_pair;
        if (sceneOf({&a, &b}).collide(SceneCollisionRequest(), of_pair) == 0) return;
        expected.push_back({a.id, b.id});
        counts.push_back(of_pair.contacts.size());
        return;
      }
      fcl::CollisionResultd result;
      adaptive_bvh::collide(a.geometry.get(), a.tf, b.geometry.get(), b.tf, all, result);
      note(a.id, b.id, result);
      if (result.isCollision() || (!isInside(a, b) && !isInside(b, a))) return;
      expected.push_back({a.id, b.id});
      counts.push_back(1);
    });
    for (const Judged& body : bodies_) {
      if (!body.options.self_collision) continue;
      fcl::CollisionResultd result;
      adaptive_bvh::selfCollide(*body.mesh, body.tf, {}, all, result);
      if (result.isCollision()) {
        const auto at =
            std::lower_bound(expected.begin(), expected.end(), BodyPair{body.id, body.id});
        counts.insert(counts.begin() + (at - expected.begin()), result.numContacts());
        expected.insert(at, {body.id, body.id});
      }
    }
    SceneCollisions found;
    scene_.collide(SceneCollisionRequest(), found);
    ASSERT_EQ(expected, found.pairs);
    ASSERT_EQ(found.pairs.size() + 1, found.begins.size());
    for (std::size_t i = 0; i < counts.size(); ++i) {
      ASSERT_EQ(counts[i], found.begins[i + 1] - found.begins[i]);
      for (std::size_t c = found.begins[i]; c < found.begins[i + 1]; ++c) {
        ASSERT_EQ(&scene_.geometry(found.pairs[i].first), found.contacts[c].o1);
        ASSERT_EQ(&scene_.geometry(found.pairs[i].second), found.contacts[c].o2);
      }
    }
    SceneCollisionRequest few;
    few.contacts_per_pair = 0;
    scene_.collide(few, found);
    ASSERT_EQ(expected, found.pairs);
    ASSERT_TRUE(found.contacts.empty());
    few.first_only = true;
    ASSERT_EQ(expected.empty() ? 0u : 1u, scene_.collide(few, found));
    if (!expected.empty()) {
      ASSERT_EQ(expected[0], found.pairs[0]);
    }
    touching_ += expected.size();
  }

  void expectNear(double distance) {
    ProximityRequest request;
    request.distance = distance;
    request.enable_distances = true;
    SceneTrianglePairs pairs;
    SceneFeaturePairs features;
    SceneVertexContacts contacts;
    scene_.pairsWithin(request, pairs);
    scene_.featurePairsWithin(distance, features);
    scene_.vertexContacts(distance, contacts);
    std::size_t at = 0, at_feature = 0, with_contacts = 0;
    bool is_nearer = false;
    const auto expectPair = [&](const Judged& a, const Judged& b) {
      TrianglePairs near;
      FeaturePairs near_features;
      if (a.id == b.id) {
        adaptive_bvh::selfPairsWithin(*a.mesh, request, near);
        adaptive_bvh::selfFeaturePairsWithin(*a.mesh, distance, near_features);
      } else {
        adaptive_bvh::pairsWithin(*a.mesh, a.tf, *b.mesh, b.tf, request, near);
        adaptive_bvh::featurePairsWithin(*a.mesh, a.tf, *b.mesh, b.tf, distance, near_features);
      }
      if (near.size() > 0) {
        ASSERT_LT(at, pairs.pairs.size());
        ASSERT_EQ((BodyPair{a.id, b.id}), pairs.pairs[at]);
        const std::vector<adaptive_bvh::FeaturePair> found(
            pairs.found.triangles.begin() + std::ptrdiff_t(pairs.begins[at]),
            pairs.found.triangles.begin() + std::ptrdiff_t(pairs.begins[at + 1]));
        ASSERT_EQ(near.triangles, found);
        ++at;
      }
      if (near_features.size() > 0) {
        ASSERT_LT(at_feature, features.pairs.size());
        ASSERT_EQ((BodyPair{a.id, b.id}), features.pairs[at_feature]);
        const auto &from = features.begins[at_feature], &to = features.begins[at_feature + 1];
        ASSERT_EQ(near_features.vertex_face.size(), to[0] - from[0]);
        ASSERT_EQ(near_features.face_vertex.size(), to[1] - from[1]);
        ASSERT_EQ(near_features.edge_edge.size(), to[2] - from[2]);
        ++at_feature;
      }
    };
    for (std::size_t i = 0; i < bodies_.size(); ++i)
      for (std::size_t j = i; j < bodies_.size() && !testing::Test::HasFailure(); ++j) {
        const Judged &a = bodies_[i], &b = bodies_[j];
        const bool is_self = i == j && a.options.self_collision;
        if (!is_self && (i == j || !admits(a, b))) continue;
        if (a.mesh && b.mesh) expectPair(a, b);
        if (i != j) {
          // Distances of two meshes near the limit are rounded otherwise in the world.
          const double d = distanceOf(a, b);
          is_nearer = is_nearer || d <= double(distance) || isInside(a, b) || isInside(b, a);
          with_contacts += expectContacts(a, b, distance, contacts);
          with_contacts += expectContacts(b, a, distance, contacts);
        }
      }
    ASSERT_EQ(pairs.pairs.size(), at);
    ASSERT_EQ(features.pairs.size(), at_feature);
    ASSERT_EQ(contacts.pairs.size(), with_contacts);
    ASSERT_EQ(is_nearer, scene_.isNearer(distance)) << distance;
  }
  /// 1 where the vertices of a mesh have contacts with another body: they must be there.
  std::size_t expectContacts(const Judged& a, const Judged& b, double margin,
                             const SceneVertexContacts& contacts) const {
    if (!a.mesh || b.geometry->getNodeType() == fcl::GEOM_OCTREE) return 0;
    VertexContacts near;
    try {
      adaptive_bvh::vertexContacts(*a.mesh, a.tf, *b.geometry, b.tf, margin, near);
    } catch (const std::invalid_argument&) {
      return 0;  // not closed
    }
    if (near.size() == 0) return 0;
    const auto at =
        std::lower_bound(contacts.pairs.begin(), contacts.pairs.end(), BodyPair{a.id, b.id});
    EXPECT_TRUE(at != contacts.pairs.end() && *at == (BodyPair{a.id, b.id}));
    if (testing::Test::HasFailure()) return 0;
    const std::size_t i = std::size_t(at - contacts.pairs.begin()), from = contacts.begins[i];
    EXPECT_EQ(near.size(), contacts.begins[i + 1] - from);
    for (std::size_t c = 0; c < near.size() && !testing::Test::HasFailure(); ++c) {
      EXPECT_EQ(near.vertices[c], contacts.found.vertices[from + c]);
      EXPECT_EQ(near.distances[c], contacts.found.distances[from + c]);
    }
    return 1;
  }

  void expectDistances() {
    const double error = 1e-12;
    double least = kFar;
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      std::vector<double> expected;
      for (std::size_t j = 0; j < bodies_.size(); ++j)
        if (i != j && admits(bodies_[i], bodies_[j]))
          expected.push_back(distanceOf(bodies_[i], bodies_[j]));
      std::sort(expected.begin(), expected.end());
      const SceneDistance nearest = scene_.nearest(bodies_[i].id);
      ASSERT_EQ(!expected.empty(), nearest.exists());
      ASSERT_EQ(nearest.distance, std::as_const(scene_).nearest(bodies_[i].id).distance);
      std::vector<SceneDistance> several;
      scene_.nearest(bodies_[i].id, 3, several);
      ASSERT_EQ(std::min<std::size_t>(3, expected.size()), several.size());
      for (std::size_t k = 0; k < several.size(); ++k)
        ASSERT_NEAR(expected[k], double(several[k].distance), error);
      if (expected.empty()) continue;
      ASSERT_NEAR(expected[0], double(nearest.distance), error);
      ASSERT_EQ(bodies_[i].id, nearest.bodies.first);
      ASSERT_NEAR(double(nearest.distance), double((nearest.points[0] - nearest.points[1]).norm()),
                  10 * error);
      least = std::min(least, expected[0]);
    }
    const SceneDistance of_const = std::as_const(scene_).distance();
    const SceneDistance nearest = scene_.distance();
    ASSERT_EQ(nearest.distance, of_const.distance);
    ASSERT_EQ(least < kFar, nearest.exists());
    if (nearest.exists()) {
      ASSERT_NEAR(least, double(nearest.distance), error);
    }
  }

  void expectPointsAndRays() {
    const double error = 1e-12;
    const P point = 2. * extent_ * random_.point();
    double least = kFar;
    for (const Judged& body : bodies_) {
      if (!body.mesh) {
        least = std::min(least, double(sceneOf({&body}).nearestPoint(point).distance));
        continue;
      }
      const P seen = body.tf.inverse(Eigen::Isometry) * point;
      least = std::min(least, double(adaptive_bvh::closestPoint(*body.mesh, seen).distance));
    }
    ASSERT_NEAR(std::min(least, 1e9), std::min(double(scene_.nearestPoint(point).distance), 1e9),
                error);
    const std::vector<P> origins = {point, P(-2. * extent_, 0.25, 0.25)};
    const std::vector<P> directions = {-point, P::UnitX()};
    std::vector<SceneRayHit> hits;
    const RayRange range =
        random_.oneIn(2) ? RayRange() : RayRange{0.25, 1. + double(random_.oneIn(2))};
    scene_.firstHits(origins.data(), directions.data(), origins.size(), range, hits);
    for (std::size_t r = 0; r < origins.size(); ++r) {
      double first = kFar;
      for (const Judged& body : bodies_) {
        if (!body.mesh) {
          std::vector<SceneRayHit> alone;
          sceneOf({&body}).firstHits(&origins[r], &directions[r], 1, range, alone);
          first = std::min(first, alone[0].t);
          continue;
        }
        std::vector<RayHit> all;
        adaptive_bvh::rayHits(*body.mesh, seenFrom(body.tf, origins[r], body.tf.translation()),
                              seenFrom(body.tf, directions[r], P::Zero()), all);
        for (const RayHit& hit : all)
          if (hit.t >= range.begin && hit.t <= range.end) first = std::min(first, hit.t);
      }
      ASSERT_EQ(first, hits[r].t);
    }
  }

  /// A difference in the frame of a body.
  static fcl::Vector3d seenFrom(const fcl::Transform3d& tf, const P& x, const P& origin) {
    const fcl::Matrix3d back = tf.linear().transpose();
    return back * (x - origin);
  }

  /// The step from the last beginStep.
  void expectImpact() {
    const double separation = random_.oneIn(2) ? 0 : 0.05;
    double expected = kFar;
    const auto motion = [&](const Judged& body) {
      const auto& end = body.mesh->vertices();
      const auto& previous = body.mesh->previousVertices();
      return adaptive_bvh::Motion(*body.mesh, previous.empty() ? end : previous, end,
                                  starts_.at(body.id), body.tf);
    };
    forEachPair([&](const Judged& a, const Judged& b) {
      if (!a.mesh || !b.mesh) {
        Scene pair;
        const BodyId first = pair.add(a.geometry, starts_.at(a.id)),
                     second = pair.add(b.geometry, starts_.at(b.id));
        pair.beginStep();
        pair.setTransform(first, a.tf);
        pair.setTransform(second, b.tf);
        pair.update();
        expected = std::min(expected, pair.earliestImpact(separation).impact.time);
        return;
      }
      const auto impact = adaptive_bvh::earliestImpact(motion(a), motion(b), separation);
      expected = std::min(expected, impact.time);
    });
    for (const Judged& body : bodies_)
      if (body.options.self_collision)
        expected =
            std::min(expected, adaptive_bvh::selfEarliestImpact(motion(body), separation).time);
    ASSERT_EQ(expected, scene_.earliestImpact(separation).impact.time);
    scene_.setThreads(3);
    ASSERT_EQ(std::min(1., expected), scene_.largestSafeStep(separation));
    scene_.setThreads(1);
    scene_.beginStep();
    starts_.clear();
    for (const Judged& body : bodies_) starts_[body.id] = body.tf;
  }

  void expectSame(int threads) {
    SceneCollisions one, several;
    scene_.collide(SceneCollisionRequest(), one);
    scene_.setThreads(threads);
    scene_.collide(SceneCollisionRequest(), several);
    scene_.setThreads(1);
    ASSERT_EQ(one.pairs, several.pairs);
    ASSERT_EQ(one.begins, several.begins);
    for (std::size_t i = 0; i < one.contacts.size(); ++i) {
      ASSERT_EQ(one.contacts[i].b1, several.contacts[i].b1);
      ASSERT_EQ(one.contacts[i].b2, several.contacts[i].b2);
    }
  }

  void judge() {
    scene_.update();
    expectCollisions();
    if (!this->HasFatalFailure())
      expectNear(double(random_.oneIn(2) ? 0.5 : random_.uniform(0, 1)));
    if (!this->HasFatalFailure()) expectDistances();
    if (!this->HasFatalFailure()) expectPointsAndRays();
    if (!this->HasFatalFailure()) expectSame(3);
    if (!this->HasFatalFailure()) expectImpact();
  }

  RandomGeometry random_{97};
  double extent_ = 3;
  Scene scene_;
  std::vector<Judged> bodies_;
  std::set<BodyPair> ignored_;
  std::map<BodyId, Transform> starts_;  ///< of the step
  bool is_filtered_ = false;
  std::size_t touching_ = 0;
};

TEST_F(SceneTest, AnswersAsAllPairsDo) {
  const int scenes = manySteps(20);
  for (int i = 0; i < scenes && !testing::Test::HasFailure(); ++i) {
    SCOPED_TRACE(i);
    this->scene_ = Scene();
    this->bodies_.clear();
    this->ignored_.clear();
    this->starts_.clear();
    this->extent_ = double(this->random_.uniform(1, 6));
    this->is_filtered_ = this->random_.oneIn(3);
    if (this->is_filtered_)
      this->scene_.setFilter([](BodyId a, BodyId b) { return (a + b) % 3 != 0; });
    this->fill(1 + this->random_.below(this->random_.oneIn(8) ? 40 : 10));
    for (int step = 0; step < 3 && !testing::Test::HasFailure(); ++step) {
      SCOPED_TRACE(step);
      for (int k = 0; k < 4; ++k) this->change();
      this->judge();
    }
  }
  EXPECT_GT(this->touching_, 20u);
}

TEST_F(SceneTest, KnowsWhatWasNotUpdated) {
  DeformableMesh mesh(latticeBox(1));
  const DeformableMesh other(latticeBox(1));
  Scene& scene = this->scene_;
  const BodyId a = scene.add(mesh), b = scene.add(other);
  EXPECT_THROW(scene.distance(), std::logic_error);
  scene.update();
  EXPECT_EQ(0., scene.distance().distance);
  std::vector<fcl::Vector3d> positions = mesh.vertices();
  for (fcl::Vector3d& x : positions) x[0] += 3;
  mesh.update(positions);
  EXPECT_THROW(scene.nearest(a), std::logic_error);
  scene.update();
  EXPECT_EQ(2., scene.nearest(b).distance);
  fcl::Transform3d tf = fcl::Transform3d::Identity();
  tf.translation()[0] = -1;
  scene.setTransform(a, tf);
  EXPECT_THROW(scene.isNearer(1), std::logic_error);
  scene.update();
  EXPECT_EQ(1., scene.distance().distance);
}

TEST_F(SceneTest, RefusesWhatItCannotHold) {
  Scene& scene = this->scene_;
  const DeformableMesh mesh(latticeBox(1));
  const fcl::BVHModel<fcl::RSSd> model;
  const fcl::Sphered ball(1);
  EXPECT_THROW(scene.add(model), std::invalid_argument);
  EXPECT_THROW(scene.add(std::shared_ptr<const fcl::CollisionGeometryd>()), std::invalid_argument);
  fcl::Transform3d scaled = fcl::Transform3d::Identity();
  scaled.linear() *= 2;
  EXPECT_THROW(scene.add(mesh, scaled), std::invalid_argument);
  BodyOptions self;
  self.self_collision = true;
  EXPECT_THROW(scene.add(ball, fcl::Transform3d::Identity(), self), std::invalid_argument);
  EXPECT_EQ(0u, scene.size());
  const BodyId id = scene.add(mesh);
  EXPECT_THROW(scene.setTransform(id, scaled), std::invalid_argument);
  EXPECT_THROW(scene.remove(id + 1), std::invalid_argument);
  EXPECT_THROW(scene.ignoreNeighbours({id, id + 1}), std::invalid_argument);
  EXPECT_THROW(scene.setThreads(0), std::invalid_argument);
  scene.update();
  EXPECT_THROW(scene.isNearer(-1), std::invalid_argument);
  EXPECT_THROW(scene.isNearer(std::numeric_limits<double>::quiet_NaN()), std::invalid_argument);
  EXPECT_FALSE(scene.distance().exists());
  scene.remove(id);
  scene.update();
  EXPECT_FALSE(scene.isNearer(1));
  EXPECT_EQ(id + 1, scene.add(mesh)) << "numbers are never given again";
}

/// A box with a small one, a ball and an open mesh inside of it.
TEST_F(SceneTest, SolidBodiesTouchWhatIsInside) {
  Scene& scene = this->scene_;
  TriangleMesh without_a_triangle = latticeBox(1);
  without_a_triangle.triangles.pop_back();
  const DeformableMesh around(latticeBox(9)), small(latticeBox(1)), open(without_a_triangle);
  const fcl::Sphered ball(1);
  const auto at = [](double x) {
    fcl::Transform3d tf = fcl::Transform3d::Identity();
    tf.translation() = fcl::Vector3d(x, 4.2, 4.4);
    return tf;
  };
  const BodyId b = scene.add(small, at(1)), s = scene.add(ball, at(4.1)),
               o = scene.add(open, at(7)), a = scene.add(around);
  SceneCollisions found;
  scene.update();
  EXPECT_EQ(0u, scene.collide(SceneCollisionRequest(), found));
  EXPECT_FALSE(scene.isNearer(0.01));
  BodyOptions solid;
  solid.solid = true;
  scene.setOptions(a, solid);
  scene.update();
  EXPECT_EQ(3u, scene.collide(SceneCollisionRequest(), found));
  EXPECT_EQ((std::vector<BodyPair>{{b, a}, {s, a}, {o, a}}), found.pairs);
  for (const fcl::Contactd& contact : found.contacts) {
    EXPECT_EQ(&around, contact.o2);
    // The first body gets out against the normal.
    const fcl::Vector3d out = contact.pos - contact.penetration_depth * contact.normal;
    EXPECT_NEAR(0, double(std::min(out.minCoeff(), 9. - out.maxCoeff())), 1e-5);
  }
  EXPECT_TRUE(scene.isNearer(0));
  EXPECT_THROW(scene.setOptions(o, solid), std::invalid_argument);
  EXPECT_THROW(scene.setOptions(s, solid), std::invalid_argument);
}

/// Three boxes in one mesh: 0 and 1 cross each other, 2 crosses itself.
TEST_F(SceneTest, PairsOfOneMeshAreChosenByLabels) {
  TriangleMesh all;
  std::vector<unsigned> labels;
  for (unsigned part = 0; part < 3; ++part) {
    TriangleMesh box = latticeBox(2);
    const std::size_t first = all.vertices.size();
    for (std::size_t v = 0; v < box.vertices.size(); ++v) {
      fcl::Vector3d x =
          box.vertices[v] + double(part == 2 ? 20 : 1.25 * part) * fcl::Vector3d::Ones();
      if (part == 2 && v == 0) x += fcl::Vector3d(3, 2.75, 2.5);  // through the other side
      all.vertices.push_back(x);
    }
    for (const fcl::Triangle& t : box.triangles) {
      all.triangles.emplace_back(first + t[0], first + t[1], first + t[2]);
      labels.push_back(part);
    }
  }
  const DeformableMesh mesh(all);
  const fcl::CollisionRequestd request(100000);
  using adaptive_bvh::LabelRule;
  const auto count = [&](LabelRule rule, bool within) {
    const auto others = adaptive_bvh::SurfaceNeighbourhood::byLabels(mesh, labels, rule);
    adaptive_bvh::Ignored ignored;
    ignored.surface = &others;
    fcl::CollisionResultd result;
    adaptive_bvh::selfCollide(mesh, ignored, request, result);
    for (std::size_t i = 0; i < result.numContacts(); ++i) {
      const fcl::Contactd& c = result.getContact(i);
      EXPECT_EQ(within, labels[std::size_t(c.b1)] == labels[std::size_t(c.b2)]);
    }
    return result.numContacts();
  };
  const std::size_t within = count(LabelRule::Within, true),
                    between = count(LabelRule::Between, false);
  fcl::CollisionResultd result;
  adaptive_bvh::selfCollide(mesh, request, result);
  EXPECT_GT(within, 0u);
  EXPECT_GT(between, 0u);
  EXPECT_EQ(result.numContacts(), within + between);
}

/// Vertices and edges have the label of their triangle with the smallest index.
TEST_F(SceneTest, FeaturesOfOneMeshAreChosenByLabels) {
  using adaptive_bvh::FeaturePair;
  TriangleMesh mesh = latticeBox(2);
  for (fcl::Vector3d& x : mesh.vertices) x[2] *= 0.25;
  std::vector<unsigned> labels;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) labels.push_back(unsigned(t / 5 % 3));
  const auto labelOfVertex = [&](unsigned v) {
    for (std::size_t t = 0;; ++t)
      for (int k = 0; k < 3; ++k)
        if (mesh.triangles[t][k] == v) return labels[t];
  };
  const DeformableMesh body(mesh);
  adaptive_bvh::FeaturePairs all, found;
  adaptive_bvh::selfFeaturePairsWithin(body, 0.6, all);
  std::size_t total = 0;
  for (const auto rule : {adaptive_bvh::LabelRule::Within, adaptive_bvh::LabelRule::Between}) {
    const bool is_within = rule == adaptive_bvh::LabelRule::Within;
    const auto others = adaptive_bvh::SurfaceNeighbourhood::byLabels(body, labels, rule);
    adaptive_bvh::FeatureProximityRequest request;
    request.distance = 0.6;
    request.ignored.surface = &others;
    adaptive_bvh::selfFeaturePairsWithin(body, request, found);
    std::vector<FeaturePair> faces, edges;
    for (const FeaturePair& pair : all.vertex_face)
      if ((labelOfVertex(pair.first) == labels[pair.second]) == is_within) faces.push_back(pair);
    for (const FeaturePair& pair : all.edge_edge)
      if ((labels[pair.first / 3] == labels[pair.second / 3]) == is_within) edges.push_back(pair);
    EXPECT_EQ(faces, found.vertex_face);
    EXPECT_EQ(edges, found.edge_edge);
    EXPECT_GT(faces.size(), 10u);
    total += found.size();
  }
  EXPECT_EQ(all.size(), total);
}

}  // namespace scene_test
}  // namespace adaptive_bvh_test
