// Queries for contacts on several threads: the contacts of one thread, in its order, field by
// field.
#include <gtest/gtest.h>

#include <atomic>
#include <cstring>
#include <thread>

#include "adaptive_bvh/distance_derivatives.h"
#include "adaptive_bvh/penetration.h"
#include "adaptive_bvh/point_query.h"
#include "adaptive_bvh/proximity.h"
#include "adaptive_bvh/query.h"
#include "adaptive_bvh/self_collision.h"
#include "deformable/mesh_state.h"
#include "query/contacts/contacts.h"
#include "query/tree_pair.h"
#include "support/closed_bodies.h"
#include "support/fcl_float.h"
#include "support/random_geometry.h"
#include "support/test_mesh.h"

namespace adaptive_bvh_test {
namespace query_threads_test {

using adaptive_bvh::DeformableMesh;
using adaptive_bvh::NeighbourFilter;

bool sameBits(const fcl::Vector3d& a, const fcl::Vector3d& b) {
  return std::memcmp(a.data(), b.data(), 3 * sizeof(double)) == 0;
}

/// Of a number that is not computed, NaN, too.
bool same(const fcl::Contactd& a, const fcl::Contactd& b) {
  return a.o1 == b.o1 && a.o2 == b.o2 && a.b1 == b.b1 && a.b2 == b.b2 && sameBits(a.pos, b.pos) &&
         sameBits(a.normal, b.normal) &&
         std::memcmp(&a.penetration_depth, &b.penetration_depth, sizeof(double)) == 0;
}

class QueryThreads : public testing::Test {
 protected:
  using Model = DeformableMesh;
  using Request = fcl::CollisionRequestd;
  using Result = fcl::CollisionResultd;

  /// Crumpled sheets, of 9,800 and of 5,000 triangles, through each other.
  QueryThreads() {
    tf1_ = random_.pose(1);
    tf2_ = tf1_;
    tf2_.rotate(Eigen::AngleAxis<double>(0.02, fcl::Vector3d::UnitX()));
  }

  TriangleMesh crumpled(int columns, int rows) {
    TriangleMesh mesh = plate(columns, rows);
    for (fcl::Vector3d& p : mesh.vertices) p += random_.point() * 0.015;
    return mesh;
  }

  void self(const Request& request, NeighbourFilter filter, Result& result) {
    selfCollide(first_, tf1_, {filter}, request, result);
  }
  void both(const Request& request, Result& result) {
    adaptive_bvh::collide(&first_, tf1_, &second_, tf2_, request, result);
  }

  /// What `ask` finds on one, two, three and eight threads.
  template <typename Ask>
  void expectSame(const Ask& ask, std::size_t least = 1) {
    Result expected;
    first_.setThreads(1);
    ask(expected);
    EXPECT_GE(expected.numContacts(), least);
    for (int threads : {2, 3, 8}) {
      Result result;
      first_.setThreads(threads);
      ask(result);
      ASSERT_EQ(expected.numContacts(), result.numContacts());
      int different = 0;
      for (std::size_t i = 0; i < result.numContacts(); ++i)
        different += !same(expected.getContact(i), result.getContact(i));
      EXPECT_EQ(0, different) << threads << " threads";
    }
  }

  const Request all_{1000000}, with_fields_{1000000, true};
  RandomGeometry random_{5};
  Model first_{crumpled(70, 70)}, second_{crumpled(50, 50)};
  fcl::Transform3d tf1_, tf2_;
};

TEST_F(QueryThreads, NearPairsAndPointsAreThoseOfOneThreadInItsOrder) {
  struct Answers {
    adaptive_bvh::TrianglePairs own, both;
    adaptive_bvh::FeaturePairs features;
    std::vector<double> clearance;
  };
  const auto ask = [this](int threads) {
    this->first_.setThreads(threads);
    this->second_.setThreads(threads);
    adaptive_bvh::ProximityRequest request;
    request.distance = 0.02;
    request.enable_distances = request.enable_nearest_points = true;
    Answers answers;
    selfPairsWithin(this->first_, request, answers.own);
    pairsWithin(this->first_, this->tf1_, this->second_, this->tf2_, request, answers.both);
    featurePairsWithin(this->first_, this->tf1_, this->second_, this->tf2_, 0.01, answers.features);
    vertexDistances(this->first_, this->tf1_, this->second_, this->tf2_, 1., answers.clearance);
    return answers;
  };
  const Answers expected = ask(1);
  EXPECT_GT(expected.own.size(), 1000u);
  EXPECT_GT(expected.both.size(), 1000u);
  for (const int threads : {2, 3, 8}) {
    const Answers now = ask(threads);
    for (const auto part : {&Answers::own, &Answers::both}) {
      EXPECT_EQ((expected.*part).triangles, (now.*part).triangles);
      EXPECT_EQ((expected.*part).distances, (now.*part).distances);
      EXPECT_EQ((expected.*part).nearest_points, (now.*part).nearest_points);
    }
    EXPECT_EQ(expected.features.vertex_face, now.features.vertex_face);
    EXPECT_EQ(expected.features.face_vertex, now.features.face_vertex);
    EXPECT_EQ(expected.features.edge_edge, now.features.edge_edge);
    EXPECT_EQ(expected.clearance, now.clearance);
  }
}

/// Contacts of vertices, and answers about points.
TEST_F(QueryThreads, VertexContactsAndPointsAreThoseOfOneThread) {
  DeformableMesh a(gridBall(90, 60)), b(gridBall(80, 50)), open(dome(30, 12));
  fcl::Transform3d tf = fcl::Transform3d::Identity(), above = tf;
  above.translation() = fcl::Vector3d(0.1, 0.2, 0.4);
  adaptive_bvh::VertexContacts expected, now;
  std::vector<double> distances, numbers, distances_now, numbers_now;
  std::vector<adaptive_bvh::ClosestFeature> features, features_now;
  adaptive_bvh::DistanceDerivatives derivatives, derivatives_now;
  vertexContacts(a, tf, b, above, 0.1, expected);
  distanceDerivatives(a, tf, b, above, expected, derivatives);
  signedDistances(b, a.vertices(), distances);
  windingNumbers(open, a.vertices(), numbers);
  closestFeatures(b, a.vertices(), 1., features);
  EXPECT_GT(expected.size(), 2000u) << "several batches";
  for (const int threads : {2, 3, 8}) {
    a.setThreads(threads);
    b.setThreads(threads);
    open.setThreads(threads);
    vertexContacts(a, tf, b, above, 0.1, now);
    EXPECT_EQ(expected.vertices, now.vertices);
    EXPECT_EQ(expected.distances, now.distances);
    EXPECT_EQ(expected.nearest_points, now.nearest_points);
    EXPECT_EQ(expected.normals, now.normals);
    EXPECT_EQ(expected.triangles, now.triangles);
    EXPECT_EQ(expected.barycentric, now.barycentric);
    EXPECT_EQ(expected.areas, now.areas);
    distanceDerivatives(a, tf, b, above, expected, derivatives_now);
    EXPECT_EQ(derivatives.first.gradients, derivatives_now.first.gradients);
    EXPECT_EQ(derivatives.second.gradients, derivatives_now.second.gradients);
    EXPECT_EQ(derivatives.second.vertices, derivatives_now.second.vertices);
    signedDistances(b, a.vertices(), distances_now);
    windingNumbers(open, a.vertices(), numbers_now);
    closestFeatures(b, a.vertices(), 1., features_now);
    EXPECT_EQ(distances, distances_now);
    EXPECT_EQ(numbers, numbers_now);
    for (std::size_t i = 0; i < features.size(); ++i) {
      EXPECT_EQ(features[i].triangle, features_now[i].triangle);
      EXPECT_EQ(features[i].normal, features_now[i].normal);
    }
  }
}

/// Results may be used again: of queries with more pairs, or with fields that are not wanted now.
TEST_F(QueryThreads, OverwriteNearPairsOfBefore) {
  using Pairs = adaptive_bvh::TrianglePairs;
  using Features = adaptive_bvh::FeaturePairs;
  const auto ask = [this](int threads, double distance, bool fields, Pairs& pairs,
                          Features& features) {
    this->first_.setThreads(threads);
    adaptive_bvh::ProximityRequest request;
    request.distance = double(distance);
    request.enable_distances = request.enable_nearest_points = fields;
    selfPairsWithin(this->first_, request, pairs);
    featurePairsWithin(this->first_, this->tf1_, this->second_, this->tf2_, double(distance),
                       features);
  };
  for (const int threads : {1, 3}) {
    Pairs reused;
    Features reused_features;
    for (const double distance : {0.02, 0.01, 0., 0.03, 0.005}) {
      const bool fields = distance >= 0.02;
      Pairs expected;
      Features expected_features;
      ask(1, distance, fields, expected, expected_features);
      ask(threads, distance, fields, reused, reused_features);
      EXPECT_EQ(expected.triangles, reused.triangles);
      EXPECT_EQ(expected.distances, reused.distances);
      EXPECT_EQ(expected.nearest_points, reused.nearest_points);
      EXPECT_EQ(expected_features.vertex_face, reused_features.vertex_face);
      EXPECT_EQ(expected_features.face_vertex, reused_features.face_vertex);
      EXPECT_EQ(expected_features.edge_edge, reused_features.edge_edge);
    }
    EXPECT_GT(reused.size(), 0u);
  }
}

TEST_F(QueryThreads, GiveTheContactsOfOne) {
  for (NeighbourFilter filter :
       {NeighbourFilter::SharedVertex, NeighbourFilter::SharedEdge, NeighbourFilter::None})
    for (const auto* request : {&this->all_, &this->with_fields_})
      this->expectSame([&](Result& result) { this->self(*request, filter, result); }, 2000);
  for (const auto* request : {&this->all_, &this->with_fields_})
    this->expectSame([&](Result& result) { this->both(*request, result); }, 2000);
}

/// The first of them, where fewer are wanted; also after those of an older query.
TEST_F(QueryThreads, StopWhereOneDoes) {
  using Request = Request;
  for (std::size_t most : {1, 2, 3, 17, 400, 2000}) {
    const Request request(most, true), more(most + 5, true);
    const auto self = [&](Result& result) {
      this->self(request, NeighbourFilter::SharedVertex, result);
    };
    const auto both = [&](Result& result) { this->both(request, result); };
    this->expectSame(self, most);
    this->expectSame(both, most);
    this->expectSame(
        [&](Result& result) {
          self(result);
          this->both(more, result);
        },
        most + 5);
  }
}

/// Costs are found, too, and a search of little.
TEST_F(QueryThreads, TakeEveryRequest) {
  using Request = Request;
  std::vector<std::size_t> costs;
  this->expectSame([&](Result& result) {
    this->both(Request(20, false, 10, true), result);
    std::vector<fcl::CostSourced> sources;
    result.getCostSources(sources);
    costs.push_back(sources.size());
  });
  EXPECT_EQ(std::vector<std::size_t>(4, 10), costs);
  this->tf2_.translation() += fcl::Vector3d(1, 1, 1) * 0.9;
  this->expectSame([&](Result& result) { this->both(this->all_, result); }, 0);
}

/// The number belongs to the mesh, goes along with it, and is checked.
TEST_F(QueryThreads, AreASettingOfTheMesh) {
  EXPECT_THROW(this->first_.setThreads(0), std::invalid_argument);
  EXPECT_THROW(this->first_.setThreads(-3), std::invalid_argument);
  this->first_.setThreads(2);
  const Model copy(this->first_);
  EXPECT_EQ(2, adaptive_bvh::detail::MeshAccess::state(copy).threads);
  Result expected, result;
  this->self(this->all_, NeighbourFilter::SharedVertex, expected);
  selfCollide(copy, this->tf1_, {}, this->all_, result);
  EXPECT_EQ(expected.numContacts(), result.numContacts());
}

/// One tree is turned by the threads of either mesh: what it keeps for each part of the work shows
/// it.
TEST(AlignedTrees, TakeTheThreadsOfEitherMesh) {
  const auto bytesWith = [](int first_threads, int second_threads) {
    DeformableMesh first(plate(20, 20)), second(plate(20, 20));
    first.setThreads(first_threads);
    second.setThreads(second_threads);
    fcl::Transform3d turned = fcl::Transform3d::Identity();
    turned.rotate(Eigen::AngleAxisd(0.3, fcl::Vector3d::UnitZ()));
    const adaptive_bvh::PlacedMesh one(first, fcl::Transform3d::Identity()), two(second, turned);
    adaptive_bvh::TreePair trees(one, two);
    trees.align();
    EXPECT_TRUE(trees.frame().isSame());
    return trees.first().bytes() + trees.second().bytes();
  };
  const std::size_t alone = bytesWith(1, 1), most = bytesWith(1, 2);
  if (most == alone) GTEST_SKIP() << "without threads";
  std::size_t found = 0;
  std::thread([&] { found = bytesWith(2, 1); }).join();  // with memory of its own
  EXPECT_EQ(most, found);
}

/// Users' threads query shared meshes at once, each of them on several.
TEST_F(QueryThreads, ServeManyUsers) {
  Result self, both;
  this->self(this->with_fields_, NeighbourFilter::SharedVertex, self);
  this->both(this->with_fields_, both);
  this->first_.setThreads(3);
  std::atomic<int> different{0};
  const auto compare = [&](const Result& expected, const Result& result) {
    different += expected.numContacts() != result.numContacts();
    for (std::size_t i = 0; i < std::min(expected.numContacts(), result.numContacts()); ++i)
      different += !same(expected.getContact(i), result.getContact(i));
  };
  std::vector<std::thread> users;
  for (int user = 0; user < 4; ++user)
    users.emplace_back([&, user] {
      for (int query = 0; query < 4; ++query) {
        Result result;
        if ((user + query) % 2)
          this->self(this->with_fields_, NeighbourFilter::SharedVertex, result);
        else
          this->both(this->with_fields_, result);
        compare((user + query) % 2 ? self : both, result);
      }
    });
  for (std::thread& user : users) user.join();
  EXPECT_EQ(0, different);
}

/// Tasks behind the tasks with enough contacts are not needed, whatever the order in which they
/// end.
class ContactLimits : public testing::Test {
 protected:
  /// How many of the first tasks are needed; the others are not.
  static int needed(const adaptive_bvh::ContactLimit& limit, int tasks) {
    int count = 0;
    while (count < tasks && limit.needs(std::size_t(count))) ++count;
    for (int task = count; task < tasks; ++task) EXPECT_FALSE(limit.needs(std::size_t(task)));
    return count;
  }
};

TEST_F(ContactLimits, LeaveOutWhatComesAfterEnough) {
  adaptive_bvh::ContactLimit limit(5, 7, 1);
  constexpr std::size_t kMany = 5;  // of the worker so far
  EXPECT_EQ(7, needed(limit, 7));
  limit.finish(5, 7, kMany);
  EXPECT_EQ(6, needed(limit, 7)) << "one that has all alone is the last";
  limit.finish(0, 2, kMany);
  limit.finish(3, 4, kMany);
  limit.finish(2, 1, kMany);
  EXPECT_EQ(6, needed(limit, 7)) << "the second may have none";
  limit.finish(1, 2, kMany);
  EXPECT_EQ(3, needed(limit, 7)) << "2 + 2 + 1";
  limit.finish(4, 9, kMany);
  EXPECT_EQ(3, needed(limit, 7));
}

TEST_F(ContactLimits, CountOnceAWorkerHasItsShare) {
  adaptive_bvh::ContactLimit limit(10, 5, 2);
  limit.finish(0, 4, 4);
  limit.finish(2, 3, 3);
  EXPECT_EQ(5, needed(limit, 5)) << "two with fewer than 5 each have fewer than 10";
  limit.finish(1, 3, 7);
  EXPECT_EQ(3, needed(limit, 5)) << "4 + 3 + 3";
}

}  // namespace query_threads_test
}  // namespace adaptive_bvh_test
