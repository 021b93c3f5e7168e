// ContactSet through histories of updates, against new queries in every step, and against all pairs
// in quadruple precision.
#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <set>

#include "adaptive_bvh/contact_set.h"
#include "adaptive_bvh/query.h"
#include "adaptive_bvh/self_collision.h"
#include "support/closed_bodies.h"
#include "support/lattice_features.h"
#include "support/long_mode.h"
#include "support/random_geometry.h"
#include "support/test_mesh.h"

namespace adaptive_bvh_test {
namespace contact_set_test {

using adaptive_bvh::ContactElements;
using adaptive_bvh::ContactSet;
using adaptive_bvh::ContactSetRequest;
using adaptive_bvh::DeformableMesh;
using adaptive_bvh::FeatureKind;
using adaptive_bvh::FeaturePair;
using adaptive_bvh::FeaturePairs;
using adaptive_bvh::NeighbourFilter;
using adaptive_bvh::NumberedPairs;
using adaptive_bvh::Scene;

using Pairs = std::vector<FeaturePair>;
using AllPairs = std::array<Pairs, 3>;  ///< by kind; pairs of triangles are the first

AllPairs sorted(AllPairs pairs) {
  for (Pairs& kind : pairs) std::sort(kind.begin(), kind.end());
  return pairs;
}

/// All pairs of triangles that are at most `limit` apart; of one mesh without those that have a
/// vertex in common.
Pairs trianglePairs(const TriangleMesh& first, const TriangleMesh& second, quad::Real limit,
                    bool is_self) {
  const auto triangle = [](const TriangleMesh& mesh, std::size_t t) -> quad::Triangle {
    const auto& v = mesh.triangles[t];
    return {quad::of(mesh.vertices[v[0]]), quad::of(mesh.vertices[v[1]]),
            quad::of(mesh.vertices[v[2]])};
  };
  const auto areNeighbours = [&](std::size_t s, std::size_t t) {
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        if (first.triangles[s][i] == first.triangles[t][j]) return true;
    return false;
  };
  Pairs pairs;
  for (std::size_t s = 0; s < first.triangles.size(); ++s)
    for (std::size_t t = is_self ? s + 1 : 0; t < second.triangles.size(); ++t) {
      if (is_self && areNeighbours(s, t)) continue;
      if (quad::distance(triangle(first, s), triangle(second, t)) <= limit)
        pairs.push_back({unsigned(s), unsigned(t)});
    }
  return pairs;
}

/// Whether a sorted list has all of one and nothing but the other.
template <typename List>
void expectBetween(const List& least, const List& found, const List& most) {
  EXPECT_TRUE(std::includes(found.begin(), found.end(), least.begin(), least.end()));
  EXPECT_TRUE(std::includes(most.begin(), most.end(), found.begin(), found.end()));
}

/// What a caller knows of a set who reads only what was added and removed.
class Follower {
 public:
  explicit Follower(const ContactSet& set) {
    for (unsigned k = 0; k < 3; ++k) known_[k] = listOf(set, k).pairs;
  }

  static const NumberedPairs& listOf(const ContactSet& set, unsigned kind) {
    return kind == 0 && set.features(FeatureKind::VertexFace).pairs.empty()
               ? set.triangles()
               : set.features(FeatureKind(kind));
  }
  /// Follows an update, and compares.
  void follow(const ContactSet& set) {
    std::size_t size = 0;
    for (unsigned k = 0; k < 3; ++k) {
      const NumberedPairs& list = listOf(set, k);
      Pairs& known = known_[k];
      ASSERT_EQ(list.removed.size(), list.removed_pairs.size());
      for (std::size_t i = 0; i < list.removed.size(); ++i) {
        ASSERT_LT(list.removed[i], known.size());
        FeaturePair& pair = known[list.removed[i]];
        ASSERT_TRUE(pair == list.removed_pairs[i] && pair != kFree);
        pair = kFree;
      }
      std::vector<bool> was_removed(list.pairs.size());
      for (const unsigned number : list.removed) was_removed[number] = true;
      known.resize(list.pairs.size(), kFree);
      for (const unsigned number : list.added) {
        ASSERT_TRUE(known[number] == kFree && !was_removed[number]);
        known[number] = list.pairs[number];
      }
      ASSERT_TRUE(known == list.pairs);
      std::vector<unsigned> numbers;
      list.list(numbers);
      EXPECT_EQ(numbers.size(), list.count);
      size += list.count;
    }
    EXPECT_EQ(size, set.size());
  }
  /// Follows `compact`.
  void renumber(const adaptive_bvh::Renumbering& moved, bool has_features) {
    const std::vector<unsigned>* to[] = {has_features ? &moved.vertex_face : &moved.triangles,
                                         &moved.face_vertex, &moved.edge_edge};
    for (unsigned k = 0; k < 3; ++k) {
      Pairs before = known_[k];
      ASSERT_EQ(before.size(), to[k]->size());
      adaptive_bvh::Renumbering::apply(*to[k], known_[k]);
      for (std::size_t n = 0; n < before.size(); ++n) {
        const unsigned now = (*to[k])[n];
        ASSERT_EQ(before[n] == kFree, now == NumberedPairs::kNone);
        if (before[n] != kFree) {
          ASSERT_TRUE(known_[k][now] == before[n]);
        }
      }
    }
  }
  AllPairs pairs() const {
    AllPairs all;
    for (unsigned k = 0; k < 3; ++k)
      for (const FeaturePair& pair : known_[k])
        if (pair != kFree) all[k].push_back(pair);
    return sorted(all);
  }

 private:
  static constexpr FeaturePair kFree{NumberedPairs::kNone, NumberedPairs::kNone};

  std::array<Pairs, 3> known_;  ///< by number
};

/// Two meshes, or one with itself, where a history has brought them.
struct Bodies {
  DeformableMesh first, second;
  bool is_self;
  fcl::Transform3d tf1 = fcl::Transform3d::Identity(), tf2 = tf1;

  ContactSet set(const ContactSetRequest& request) const {
    return is_self ? ContactSet(first, request) : ContactSet(first, second, request);
  }
  void update(ContactSet& set) const { is_self ? set.update() : set.update(tf1, tf2); }

  /// What a new query finds.
  AllPairs pairs(const ContactSetRequest& request) const {
    if (request.elements == ContactElements::Features) {
      const adaptive_bvh::FeatureProximityRequest of{request.distance, request.ignored};
      FeaturePairs found;
      is_self ? selfFeaturePairsWithin(first, of, found)
              : featurePairsWithin(first, tf1, second, tf2, of, found);
      return sorted({found.vertex_face, found.face_vertex, found.edge_edge});
    }
    adaptive_bvh::ProximityRequest of;
    of.distance = request.distance;
    of.ignored = request.ignored;
    adaptive_bvh::TrianglePairs found;
    is_self ? selfPairsWithin(first, of, found) : pairsWithin(first, tf1, second, tf2, of, found);
    return sorted({found.triangles, {}, {}});
  }
};

class ContactSets : public testing::Test {
 protected:
  using Mesh = DeformableMesh;
  using Point = fcl::Vector3d;
  using Points = std::vector<Point>;

  TriangleMesh sheet(bool on_lattice) {
    TriangleMesh mesh = plate(2 + random_.below(6), 2 + random_.below(6));
    for (Point& p : mesh.vertices) {
      p = Point(std::round(p[0] * 6), std::round(p[1] * 6), 0);
      if (on_lattice)
        p[2] = double(random_.below(3));
      else
        p += random_.point() * 0.3;
    }
    return mesh;
  }
  /// A step of a vertex, by whole numbers on the lattice.
  Point step(bool on_lattice, double speed) {
    if (!on_lattice) return random_.point() * speed;
    return {double(random_.below(3) - 1), double(random_.below(3) - 1),
            double(random_.below(3) - 1)};
  }

  /// Changes a mesh in some way.
  void change(Mesh& mesh, Mesh& snapshot, bool on_lattice, double speed) {
    Points all = mesh.vertices();
    switch (random_.below(10)) {
      case 0:
      case 1:
        for (Point& p : all)
          if (!on_lattice || random_.oneIn(4)) p += step(on_lattice, speed);
        return mesh.update(all), void();
      case 2: {
        const Point by = step(on_lattice, speed);
        for (Point& p : all) p += by;
        return mesh.update(all), void();
      }
      case 3:
      case 4: {
        std::vector<unsigned> indices;
        Points to;
        for (int i = random_.below(4); i >= 0; --i) {
          indices.push_back(unsigned(random_.below(int(all.size()))));
          to.push_back(all[indices.back()] + step(on_lattice, 3 * speed));
        }
        return mesh.update(indices, to), void();
      }
      case 5: snapshot = mesh; return;
      case 6: mesh = snapshot; return;
      case 7:
        if (random_.oneIn(4))
          for (Point& p : all) p = 2 * p + 4 * step(on_lattice, 1);
        return mesh.update(all), void();
      case 8: {
        Mesh other(mesh);
        other.update(all);
        for (Point& p : all) p += step(on_lattice, speed);
        other.update(all);
        std::swap(other, mesh);
        return;
      }
      default:
        all[0][1] = std::numeric_limits<double>::quiet_NaN();
        EXPECT_THROW(mesh.update(all), std::invalid_argument);
    }
  }
  void changeTransforms(Bodies& bodies, bool on_lattice, double speed) {
    fcl::Transform3d move = fcl::Transform3d::Identity();
    move.translation() = step(on_lattice, speed);
    if (!on_lattice)
      move.linear() = Eigen::AngleAxis<double>(speed * random_.uniform(), random_.direction())
                          .toRotationMatrix();
    if (random_.oneIn(3)) bodies.tf1 = move * bodies.tf1;
    bodies.tf2 = move * bodies.tf2;
  }

  ContactSetRequest request(bool on_lattice) {
    ContactSetRequest request;
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    const double distances[] = {0, 1, 2, 0.5, 0.7, 0.1, 1.3, kInfinity};
    request.distance = distances[random_.below(on_lattice ? 3 : random_.oneIn(8) ? 8 : 7)];
    if (random_.oneIn(2)) request.elements = ContactElements::Features;
    const NeighbourFilter filters[] = {NeighbourFilter::SharedVertex, NeighbourFilter::SharedEdge,
                                       NeighbourFilter::None};
    request.ignored.neighbours = filters[random_.below(3)];
    return request;
  }

  RandomGeometry random_{20266};
};

/// Jumps, refused updates, snapshots, assignments, transforms; on lattices with ties.
TEST_F(ContactSets, AreThoseOfNewQueriesInEveryStep) {
  auto& random = this->random_;
  std::size_t tested = 0, candidates = 0;
  for (int history = 0; history < manySteps(150); ++history) {
    const bool on_lattice = random.oneIn(3);
    Bodies bodies{DeformableMesh(this->sheet(on_lattice)), DeformableMesh(this->sheet(on_lattice)),
                  random.oneIn(2)};
    ContactSetRequest request = this->request(on_lattice);
    const Pairs list = {{1, 3}, {2, 9}, {4, 8}};
    if (random.oneIn(3))
      for (auto* ignored : {&request.ignored.triangles, &request.ignored.vertex_face,
                            &request.ignored.face_vertex, &request.ignored.edge_edge}) {
        ignored->list = &list;
        ignored->test = [](unsigned a, unsigned b) { return (7 * a + 3 * b) % 5 == 0; };
      }
    ContactSet set = bodies.set(request);
    Follower follower(set);
    DeformableMesh snapshots[] = {bodies.first, bodies.second};
    const double speed = random.size(-4, 0);
    for (int step = 0; step < 30; ++step) {
      for (int k = random.below(3); k > 0; --k) {
        const bool is_first = random.oneIn(2);
        this->change(is_first ? bodies.first : bodies.second, snapshots[!is_first], on_lattice,
                     speed);
      }
      if (!bodies.is_self && random.oneIn(2)) this->changeTransforms(bodies, on_lattice, speed);
      bodies.update(set);
      follower.follow(set);
      ASSERT_TRUE(bodies.pairs(request) == follower.pairs())
          << "history " << history << ", step " << step << ", distance " << request.distance;
      if (this->HasFailure()) return;
      tested += set.work().tested;
      candidates += set.work().candidates;
      if (random.oneIn(8)) {
        adaptive_bvh::Renumbering moved;
        set.compact(moved);
        follower.renumber(moved, request.elements == ContactElements::Features);
        follower.follow(set);
      }
      if (random.oneIn(8)) set = ContactSet(set);
    }
  }
  EXPECT_LT(tested, candidates * 3 / 4) << "or nothing was kept that could be wrong";
}

/// Coordinates are whole numbers; all pairs are judged in quadruple precision.
TEST_F(ContactSets, AreAllPairsOfALattice) {
  auto& random = this->random_;
  for (int history = 0; history < manySteps(10); ++history) {
    TriangleMesh meshes[] = {this->sheet(true), this->sheet(true)};
    Bodies bodies{DeformableMesh(meshes[0]), DeformableMesh(meshes[1]), random.oneIn(2)};
    ContactSetRequest request = this->request(true);
    request.ignored.neighbours = NeighbourFilter::SharedVertex;
    ContactSet set = bodies.set(request);
    for (int step = 0; step < 12; ++step) {
      for (auto& p : meshes[random.below(2)].vertices)
        if (random.oneIn(3)) p += this->step(true, 1);
      bodies.first.update(meshes[0].vertices);
      bodies.second.update(meshes[1].vertices);
      bodies.update(set);
      const TriangleMesh& second = meshes[bodies.is_self ? 0 : 1];
      // Within the distance 0 are those that touch, exactly. Otherwise rounding decides about pairs
      // that are the distance apart.
      const int limit = int(request.distance);
      const double beyond = 1e-12, within = limit > 0 ? -1e-12 : 1e-12;
      const AllPairs pairs = Follower(set).pairs();
      if (request.elements == ContactElements::Features) {
        const FeatureSet found = featurePairs(FeaturePairs{pairs[0], pairs[1], pairs[2]}, meshes[0],
                                              second, bodies.is_self);
        expectBetween(featurePairs(meshes[0], second, limit, bodies.is_self, within), found,
                      featurePairs(meshes[0], second, limit, bodies.is_self, beyond));
      } else {
        const quad::Real least = quad::Real(limit) + quad::Real(within),
                         most = quad::Real(limit) + quad::Real(beyond);
        expectBetween(trianglePairs(meshes[0], second, least, bodies.is_self), pairs[0],
                      trianglePairs(meshes[0], second, most, bodies.is_self));
      }
      if (this->HasFailure()) return;
    }
  }
}

/// A surface that slides in small steps: most pairs keep their numbers, few are tested.
TEST_F(ContactSets, KeepNumbersAndTestFewPairs) {
  DeformableMesh lower(plate(20, 20)), upper(plate(20, 20));
  ContactSetRequest request;
  request.distance = 0.05;
  ContactSet set(lower, upper, request);
  fcl::Transform3d still = fcl::Transform3d::Identity(), slides = still;
  slides.translation() = fcl::Vector3d(0.011, 0.007, 0.03);
  set.update(still, slides);
  const std::vector<FeaturePair> before = set.triangles().pairs;
  std::size_t tested = 0, kept = 0;
  for (int step = 0; step < 20; ++step) {
    slides.translation() += fcl::Vector3d(0.0003, 0, 0);
    set.update(still, slides);
    tested += set.work().tested;
  }
  for (unsigned n = 0; n < before.size(); ++n) kept += set.triangles().pairs[n] == before[n];
  EXPECT_GT(kept, before.size() * 8 / 10);
  EXPECT_LT(tested / 20, set.work().candidates / 3);
  set.update(still, slides);
  EXPECT_TRUE(set.triangles().added.empty() && set.triangles().removed.empty());
  const std::size_t searches = set.work().searches;
  still.translation() += fcl::Vector3d(3, 4, 5);
  slides.translation() += fcl::Vector3d(3, 4, 5);
  set.update(still, slides);
  EXPECT_EQ(searches, set.work().searches) << "they have moved together";
}

/// Two copies go on alone, and so do copies of the meshes.
TEST_F(ContactSets, CopiesGoOnAlone) {
  auto& random = this->random_;
  Bodies bodies{DeformableMesh(plate(8, 8)), DeformableMesh(plate(8, 8)), true};
  ContactSetRequest request;
  request.distance = 0.2;
  ContactSet set(bodies.first, request);
  set.update();
  ContactSet copy(set);
  const auto before = copy.triangles().pairs;
  moveVertices(bodies.first, [&](auto& p) { p += random.point() * 0.05; });
  set.update();
  EXPECT_EQ(before, copy.triangles().pairs);
  EXPECT_NE(before, set.triangles().pairs);
  copy.update();
  EXPECT_EQ(set.triangles().pairs, copy.triangles().pairs);
  ContactSet moved(std::move(copy));
  moveVertices(bodies.first, [&](auto& p) { p += random.point() * 0.01; });
  moved.update();
  set.update();
  EXPECT_EQ(set.triangles().pairs, moved.triangles().pairs);
}

/// Another mesh with other triangles takes the place of the first.
TEST_F(ContactSets, RemoveThePairsOfOtherTriangles) {
  Bodies bodies{DeformableMesh(plate(5, 5)), DeformableMesh(plate(4, 7)), false};
  ContactSetRequest request;
  request.distance = 0.1;
  ContactSet set = bodies.set(request);
  Follower follower(set);
  bodies.update(set);
  follower.follow(set);
  const std::size_t before = set.size();
  bodies.first = DeformableMesh(plate(6, 3));
  bodies.update(set);
  EXPECT_EQ(before, set.triangles().removed.size());
  follower.follow(set);
  EXPECT_EQ(bodies.pairs(request), follower.pairs());
}

TEST_F(ContactSets, RefuseWhatIsNotARequestAndChangeNothing) {
  const DeformableMesh mesh(plate(4, 4));
  ContactSetRequest request;
  for (const double distance : {-1., std::numeric_limits<double>::quiet_NaN()}) {
    request.distance = distance;
    EXPECT_THROW(ContactSet(mesh, request), std::invalid_argument);
  }
  request.distance = 0.1;
  request.ignored.neighbours = NeighbourFilter::BeyondShared;
  EXPECT_THROW(ContactSet(mesh, request), std::invalid_argument);
  request.ignored.neighbours = NeighbourFilter::SharedVertex;
  const Pairs unsorted = {{2, 3}, {1, 2}}, reversed = {{3, 2}};
  request.ignored.triangles.list = &unsorted;
  EXPECT_THROW(ContactSet(mesh, mesh, request), std::invalid_argument);
  request.ignored.triangles.list = &reversed;
  EXPECT_NO_THROW(ContactSet(mesh, mesh, request));
  EXPECT_THROW(ContactSet(mesh, request), std::invalid_argument);
  request.ignored.triangles.list = nullptr;
  ContactSet set(mesh, mesh, request), own(mesh, request);
  EXPECT_EQ(0u, set.size());
  EXPECT_GT(set.update(), 0u);
  const auto before = set.triangles().added;
  fcl::Transform3d tf = fcl::Transform3d::Identity();
  EXPECT_THROW(own.update(tf, tf), std::logic_error);
  tf.linear() *= 2;
  EXPECT_THROW(set.update(tf, tf), std::invalid_argument);
  EXPECT_EQ(before, set.triangles().added);
  adaptive_bvh::FeatureDetails details;
  EXPECT_THROW(set.details({unsigned(set.triangles().pairs.size())}, details),
               std::invalid_argument);
  EXPECT_THROW(set.details(FeatureKind::EdgeEdge, {0}, details), std::invalid_argument);
}

/// A filter that throws ends the update; the set stays, and the next update is right.
TEST_F(ContactSets, SurviveAFilterThatThrows) {
  auto& random = this->random_;
  Bodies bodies{DeformableMesh(plate(8, 8)), DeformableMesh(plate(8, 8)), true};
  ContactSetRequest request;
  request.distance = 0.1;
  bool throws = false;
  request.ignored.triangles.test = [&](unsigned, unsigned) {
    if (throws) throw std::runtime_error("as the caller wants");
    return false;
  };
  ContactSet set(bodies.first, request);
  Follower follower(set);
  for (int step = 0; step < 20; ++step) {
    moveVertices(bodies.first, [&](auto& p) { p += random.point() * 0.02; });
    const auto before = set.triangles().pairs;
    const auto added = set.triangles().added;
    throws = true;
    EXPECT_THROW(set.update(), std::runtime_error);
    EXPECT_EQ(before, set.triangles().pairs);
    EXPECT_EQ(added, set.triangles().added);
    throws = false;
    set.update();
    follower.follow(set);
    ASSERT_EQ(bodies.pairs(request), follower.pairs());
  }
}

/// Distances and points are those of the queries.
TEST_F(ContactSets, GiveDetailsOfPairs) {
  auto& random = this->random_;
  const DeformableMesh first(gridBall(12, 8)), second(gridBall(10, 9));
  const fcl::Transform3d tf1 = random.pose(1);
  fcl::Transform3d tf2 = tf1;
  tf2.translation() += fcl::Vector3d(0.4, 0.3, 1.6);
  ContactSetRequest request;
  request.distance = 0.3;
  ContactSet set(first, second, request);
  set.update(tf1, tf2);
  std::vector<unsigned> numbers;
  set.triangles().list(numbers);
  std::reverse(numbers.begin(), numbers.end());
  adaptive_bvh::FeatureDetails details;
  set.details(numbers, details);
  adaptive_bvh::ProximityRequest all;
  all.distance = 0.3;
  all.enable_distances = all.enable_nearest_points = true;
  adaptive_bvh::TrianglePairs found;
  ASSERT_GT(pairsWithin(first, tf1, second, tf2, all, found), 10u);
  ASSERT_EQ(found.size(), details.distances.size());
  std::map<FeaturePair, std::size_t> index;
  for (std::size_t i = 0; i < found.size(); ++i) index[found.triangles[i]] = i;
  int touching = 0;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const std::size_t at = index.at(set.triangles().pairs[numbers[i]]);
    EXPECT_EQ(found.distances[at], details.distances[i]);
    EXPECT_EQ(found.nearest_points[at], details.nearest_points[i]);
    EXPECT_NEAR(1, details.normals[i].norm(), 1e-5);
    touching += details.distances[i] == 0;
    if (details.distances[i] < 1e-3) continue;
    const fcl::Vector3d between = details.nearest_points[i][1] - details.nearest_points[i][0];
    EXPECT_LT((between.normalized() - details.normals[i]).norm(), 1e-3);
  }
  EXPECT_GT(touching, 3);
  request.elements = ContactElements::Features;
  request.distance = 0.1;
  ContactSet features(first, second, request);
  features.update(tf1, tf2);
  for (const FeatureKind kind :
       {FeatureKind::VertexFace, FeatureKind::FaceVertex, FeatureKind::EdgeEdge}) {
    features.features(kind).list(numbers);
    ASSERT_GT(numbers.size(), 3u);
    FeaturePairs pairs;
    auto& list = kind == FeatureKind::VertexFace   ? pairs.vertex_face
                 : kind == FeatureKind::FaceVertex ? pairs.face_vertex
                                                   : pairs.edge_edge;
    for (const unsigned n : numbers) list.push_back(features.features(kind).pairs[n]);
    adaptive_bvh::FeaturePairDetails expected;
    featurePairDetails(first, tf1, second, tf2, pairs, expected);
    const auto& of_kind = kind == FeatureKind::VertexFace   ? expected.vertex_face
                          : kind == FeatureKind::FaceVertex ? expected.face_vertex
                                                            : expected.edge_edge;
    features.details(kind, numbers, details);
    EXPECT_EQ(of_kind.distances, details.distances);
    EXPECT_EQ(of_kind.nearest_points, details.nearest_points);
    EXPECT_EQ(of_kind.normals, details.normals);
  }
}

/// Contacts step after step, of a set whose distance is 0 or more.
TEST_F(ContactSets, GiveTheContactsOfCollide) {
  auto& random = this->random_;
  using Contacts = std::set<std::tuple<int, int, double, double, double, double>>;
  const auto read = [](const fcl::CollisionResultd& result) {
    Contacts contacts;
    for (std::size_t i = 0; i < result.numContacts(); ++i) {
      const auto& c = result.getContact(i);
      contacts.insert({int(c.b1), int(c.b2), c.pos[0], c.pos[1], c.normal[2], c.penetration_depth});
    }
    return contacts;
  };
  const fcl::CollisionRequestd all(100000, true);
  for (const double distance : {0., 0.05})
    for (const bool is_self : {false, true}) {
      Bodies bodies{DeformableMesh(gridBall(12, 10)), DeformableMesh(gridBall(9, 9)), is_self};
      bodies.tf2.translation() = fcl::Vector3d(0.1, 0.3, 0.9);
      ContactSetRequest request;
      request.distance = distance;
      ContactSet set = bodies.set(request);
      std::size_t most = 0;
      for (int step = 0; step < 12; ++step) {
        moveVertices(bodies.first, [&](auto& p) { p += random.point() * 0.05; });
        bodies.tf2.translation()[2] -= 0.01;
        bodies.update(set);
        fcl::CollisionResultd expected, found;
        is_self ? selfCollide(bodies.first, all, expected)
                : adaptive_bvh::collide(&bodies.first, bodies.tf1, &bodies.second, bodies.tf2, all,
                                        expected);
        set.contacts(all, found);
        ASSERT_EQ(expected.numContacts(), found.numContacts());
        ASSERT_EQ(read(expected), read(found));
        most = std::max(most, found.numContacts());
      }
      EXPECT_GT(most, 3u);
    }
}

class SceneContactSets : public ContactSets {
 protected:
  /// By pairs of bodies.
  using ByBodies = std::map<std::pair<unsigned, unsigned>, AllPairs>;

  static ByBodies query(const Scene& scene, const ContactSetRequest& request) {
    ByBodies all;
    if (request.elements == ContactElements::Features) {
      adaptive_bvh::SceneFeaturePairs found;
      scene.featurePairsWithin(request.distance, found);
      const Pairs FeaturePairs::*kinds[] = {&FeaturePairs::vertex_face, &FeaturePairs::face_vertex,
                                            &FeaturePairs::edge_edge};
      for (std::size_t i = 0; i < found.pairs.size(); ++i)
        for (std::size_t k = 0; k < 3; ++k) {
          const Pairs& list = found.found.*kinds[k];
          all[{found.pairs[i].first, found.pairs[i].second}][k].assign(
              list.begin() + std::ptrdiff_t(found.begins[i][k]),
              list.begin() + std::ptrdiff_t(found.begins[i + 1][k]));
        }
    } else {
      adaptive_bvh::ProximityRequest of;
      of.distance = request.distance;
      adaptive_bvh::SceneTrianglePairs found;
      scene.pairsWithin(of, found);
      for (std::size_t i = 0; i < found.pairs.size(); ++i)
        all[{found.pairs[i].first, found.pairs[i].second}][0].assign(
            found.found.triangles.begin() + std::ptrdiff_t(found.begins[i]),
            found.found.triangles.begin() + std::ptrdiff_t(found.begins[i + 1]));
    }
    for (auto& entry : all) entry.second = sorted(entry.second);
    return all;
  }
  static ByBodies held(const ContactSet& set) {
    ByBodies all;
    for (unsigned k = 0; k < 3; ++k) {
      const NumberedPairs& list = Follower::listOf(set, k);
      for (unsigned n = 0; n < list.pairs.size(); ++n)
        if (list.contains(n))
          all[{list.bodies[n].first, list.bodies[n].second}][k].push_back(list.pairs[n]);
    }
    for (auto& entry : all) entry.second = sorted(entry.second);
    return all;
  }
};

/// Bodies that move, deform, come and go, are ignored and counted again.
TEST_F(SceneContactSets, AreThoseOfNewQueriesInEveryStep) {
  auto& random = this->random_;
  for (int history = 0; history < manySteps(15); ++history) {
    std::vector<std::shared_ptr<DeformableMesh>> meshes;
    Scene scene;
    std::vector<adaptive_bvh::BodyId> ids;
    const auto addBody = [&] {
      if (meshes.empty() || !random.oneIn(4))
        meshes.push_back(std::make_shared<DeformableMesh>(gridBall(8, 6)));
      adaptive_bvh::BodyOptions options;
      options.self_collision = random.oneIn(3);
      fcl::Transform3d tf = random.pose(0);
      tf.translation() = random.point() * 1.5;
      ids.push_back(scene.add(meshes[std::size_t(random.below(int(meshes.size())))], tf, options));
    };
    for (int i = 0; i < 5; ++i) addBody();
    ContactSetRequest request;
    request.distance = double(random.uniform(0, 0.4));
    if (random.oneIn(2)) request.elements = ContactElements::Features;
    ContactSet set(scene, request);
    EXPECT_THROW(set.update(), std::logic_error) << "the scene was not updated";
    Follower follower(set);
    const double speed = random.size(-3, -0.5);
    for (int step = 0; step < 25; ++step) {
      const auto anyId = [&] { return ids[std::size_t(random.below(int(ids.size())))]; };
      switch (random.below(8)) {
        case 0: addBody(); break;
        case 1:
          if (ids.size() > 3) {
            scene.remove(ids.back());
            ids.pop_back();
          }
          break;
        case 2: scene.ignore(anyId(), anyId()); break;
        case 3: scene.unignore(anyId(), anyId()); break;
        case 4:
        case 5: {
          auto& mesh = *meshes[std::size_t(random.below(int(meshes.size())))];
          moveVertices(mesh, [&](auto& p) { p += random.point() * speed; });
          break;
        }
        case 6: break;
        default:
          for (int k = 0; k < 2; ++k) {
            const auto id = anyId();
            fcl::Transform3d tf = scene.transform(id);
            tf.translation() += random.point() * speed;
            scene.setTransform(id, tf);
          }
      }
      if (random.oneIn(4)) scene.setThreads(1 + random.below(3));
      scene.update();
      set.update();
      follower.follow(set);
      if (this->HasFailure()) return;
      const auto expected = this->query(scene, request);
      ASSERT_EQ(expected, this->held(set)) << history << " " << step;
      set.update();
      EXPECT_TRUE(Follower::listOf(set, 0).added.empty() &&
                  Follower::listOf(set, 0).removed.empty());
      if (random.oneIn(6)) {
        adaptive_bvh::Renumbering moved;
        set.compact(moved);
        follower.renumber(moved, request.elements == ContactElements::Features);
        ASSERT_EQ(expected, this->held(set));
      }
    }
  }
}

}  // namespace contact_set_test
}  // namespace adaptive_bvh_test
