// Recorded queries return FCL's results in every field, for every pair that they take.
#include "adaptive_bvh/query.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <iostream>
#include <sstream>

#include <fcl/geometry/shape/halfspace.h>
#include <fcl/geometry/shape/plane.h>
#include <fcl/narrowphase/detail/gjk_solver_libccd.h>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "support/brute_force.h"
#include "support/fcl_float.h"
#include "support/shapes.h"
#include "support/test_volume.h"

namespace adaptive_bvh_test {
namespace query_test {

using adaptive_bvh::AdaptiveBVHModel;

using Geometry = fcl::CollisionGeometryd;

void expectEqual(const fcl::DistanceResultd& a, const fcl::DistanceResultd& b,
                 bool with_points = true) {
  EXPECT_NEAR(a.min_distance, b.min_distance, 64 * std::numeric_limits<double>::epsilon());
  EXPECT_EQ(a.o1, b.o1);
  EXPECT_EQ(a.o2, b.o2);
  EXPECT_EQ(a.b1, b.b1);
  EXPECT_EQ(a.b2, b.b2);
  if (a.min_distance <= 0 || !with_points) return;  // FCL leaves the points unset then
  EXPECT_EQ(a.nearest_points[0], b.nearest_points[0]);
  EXPECT_EQ(a.nearest_points[1], b.nearest_points[1]);
}

void expectEqual(const fcl::CollisionResultd& a, const fcl::CollisionResultd& b) {
  ASSERT_EQ(a.numContacts(), b.numContacts());
  for (std::size_t i = 0; i < a.numContacts(); ++i) {
    const fcl::Contactd &x = a.getContact(i), &y = b.getContact(i);
    EXPECT_EQ(x.o1, y.o1);
    EXPECT_EQ(x.o2, y.o2);
    EXPECT_EQ(x.b1, y.b1);
    EXPECT_EQ(x.b2, y.b2);
    EXPECT_EQ(x.pos, y.pos);
    EXPECT_EQ(x.normal, y.normal);
    EXPECT_EQ(x.penetration_depth, y.penetration_depth);
  }
  fcl::CollisionResultd copy_a(a), copy_b(b);
  std::vector<fcl::CostSourced> costs_a, costs_b;
  copy_a.getCostSources(costs_a);
  copy_b.getCostSources(costs_b);
  ASSERT_EQ(costs_a.size(), costs_b.size());
  for (std::size_t i = 0; i < costs_a.size(); ++i) {
    EXPECT_EQ(costs_a[i].aabb_min, costs_b[i].aabb_min);
    EXPECT_EQ(costs_a[i].aabb_max, costs_b[i].aabb_max);
    EXPECT_EQ(costs_a[i].total_cost, costs_b[i].total_cost);
  }
}

/// A mesh of one triangle of another.
std::shared_ptr<fcl::BVHModel<TestVolume<double>>> triangleOf(
    const fcl::BVHModel<TestVolume<double>>& mesh, int triangle) {
  const fcl::Triangle& t = mesh.tri_indices[triangle];
  auto one = std::make_shared<fcl::BVHModel<TestVolume<double>>>();
  fillModel(TriangleMesh{{mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]},
                         {fcl::Triangle(0, 1, 2)}},
            *one);
  return one;
}

class Query : public testing::Test {
 protected:
  using Model = AdaptiveBVHModel<TestVolume<double>>;

  Query() : deformation_(dome(9, 4), Deformation::Kind::Smooth, 5) {
    fillModel(dome(9, 4), model_);
    fillModel(tube(5, 5), other_);
  }

  void deform() {
    model_.update(deformation_.next());
    ASSERT_TRUE(model_.validate());
  }

  Model model_;
  fcl::BVHModel<TestVolume<double>> other_;
  Deformation deformation_;
  std::mt19937 random_{3};
};

/// FCL's solvers end somewhat too far away; shape_distance_test.cpp is exact.
TEST_F(Query, MeshShapeDistanceIsNearFcls) {
  int touching = 0, apart = 0, queries = 0, traversed = 0;
  for (const auto& shape : boundedShapes())
    for (int frame = 0; frame < 12; ++frame) {
      this->deform();
      const fcl::Transform3d tf1 = randomPose(this->random_, 0.3);
      const fcl::Transform3d tf2 = randomPose(this->random_, 0.9);
      const Geometry* mesh = &this->model_;
      const fcl::DistanceRequestd request(true);
      for (bool mesh_first : {true, false}) {
        fcl::DistanceResultd by_fcl, recorded;
        const auto* o1 = mesh_first ? mesh : shape.get();
        const auto* o2 = mesh_first ? shape.get() : mesh;
        const double a = fcl::distance(o1, tf1, o2, tf2, request, by_fcl);
        const double b = adaptive_bvh::distance(o1, tf1, o2, tf2, request, recorded);
        EXPECT_EQ(b, recorded.min_distance);
        // FCL leaves the distance of a sphere that touches uninitialised.
        if (shape->getNodeType() != fcl::GEOM_SPHERE || b > 1e-3) {
          EXPECT_NEAR(std::max(a, 0.), b, 1e-3);
        }
        EXPECT_EQ(mesh, recorded.o1);
        EXPECT_EQ(shape.get(), recorded.o2);
        EXPECT_EQ(-1, recorded.b2);
        ++(b > 0 ? apart : touching);
        // Several triangles may be as near, or touch: the one that is named is.
        const auto named = triangleOf(this->model_, int(recorded.b1));
        fcl::DistanceResultd of_named;
        EXPECT_NEAR(b,
                    adaptive_bvh::distance(named.get(), mesh_first ? tf1 : tf2, shape.get(),
                                           mesh_first ? tf2 : tf1, request, of_named),
                    1e-6);
      }
      EXPECT_GE(this->model_.recordedWork().queries, 1);
      ++queries;
      traversed +=
          this->model_.traversed(0);  // not where the first triangle touches, or is nearest
    }
  EXPECT_GT(traversed, queries / 2);
  EXPECT_GT(touching, 10);
  EXPECT_GT(apart, 50);
}

TEST_F(Query, MeshShapeCollisionHasFclsTrianglesAndCosts) {
  std::vector<std::shared_ptr<Geometry>> shapes = boundedShapes();
  shapes.push_back(std::make_shared<fcl::Halfspaced>(fcl::Vector3d(0, 0, 1), 0.1));
  int colliding = 0, costs = 0;
  for (const auto& shape : shapes)
    for (int frame = 0; frame < 8; ++frame) {
      this->deform();
      const fcl::Transform3d tf1 = randomPose(this->random_, 0.2);
      const fcl::Transform3d tf2 = randomPose(this->random_, 0.6);
      const fcl::CollisionRequestd request(frame % 2 ? 1 : 1000, frame % 4 < 3, 10, frame % 3 == 0,
                                           frame % 6 == 0);
      const Geometry* mesh = &this->model_;
      for (bool mesh_first : {true, false}) {
        fcl::CollisionResultd by_fcl, recorded;
        const auto* o1 = mesh_first ? mesh : shape.get();
        const auto* o2 = mesh_first ? shape.get() : mesh;
        const std::size_t a = fcl::collide(o1, tf1, o2, tf2, request, by_fcl);
        const std::size_t b = adaptive_bvh::collide(o1, tf1, o2, tf2, request, recorded);
        EXPECT_EQ(a, b);
        std::vector<fcl::CostSourced> costs_a, costs_b;
        by_fcl.getCostSources(costs_a);
        recorded.getCostSources(costs_b);
        EXPECT_EQ(costs_a.size(), costs_b.size());
        if (frame % 2) continue;  // of several contacts, another one may be the only one
        for (std::size_t i = 0; i < std::min(costs_a.size(), costs_b.size()); ++i) {
          EXPECT_NEAR(costs_a[i].total_cost, costs_b[i].total_cost, 1e-4 * costs_a[i].total_cost);
          ++costs;
        }
        colliding += a > 0;
      }
    }
  EXPECT_GT(colliding, 20);
  EXPECT_GT(costs, 10);
}

/// FCL's RSS of a plane is perpendicular to it, so its traversal misses most contacts. The oracle
/// is the solver, called for every triangle.
TEST_F(Query, PlanesTouchWhatTheSolverSays) {
  int touching = 0, missed = 0;
  for (int frame = 0; frame < 60; ++frame) {
    this->deform();
    const fcl::Transform3d tf1 = randomPose(this->random_, 0.2);
    const fcl::Transform3d tf2 = randomPose(this->random_, 0.6);
    const fcl::Planed plane(fcl::Vector3d(1, frame % 3, frame % 5).normalized(), 0.1);
    std::vector<long> expected, found;
    for (int t = 0; t < this->model_.num_tris; ++t) {
      const fcl::Triangle& c = this->model_.tri_indices[t];
      const fcl::Vector3d* v = this->model_.vertices;
      if (fcl::detail::GJKSolver_libccd<double>().shapeTriangleIntersect(
              plane, tf2, v[c[0]], v[c[1]], v[c[2]], tf1, nullptr, nullptr, nullptr))
        expected.push_back(t);
    }
    const fcl::CollisionRequestd all(100000, frame % 2 == 0);
    fcl::CollisionResultd ours, by_fcl;
    adaptive_bvh::collide(&this->model_, tf1, &plane, tf2, all, ours);
    fcl::collide(&this->model_, tf1, &plane, tf2, all, by_fcl);
    for (std::size_t i = 0; i < ours.numContacts(); ++i) found.push_back(ours.getContact(i).b1);
    std::sort(found.begin(), found.end());
    EXPECT_EQ(expected, found);
    touching += !expected.empty();
    missed += by_fcl.numContacts() < expected.size();
  }
  EXPECT_GT(touching, 30);
  if (std::is_same_v<TestVolume<double>, fcl::RSSd>) {
    EXPECT_GT(missed, 20);
  }
}

/// fcl::collide copies, moves and rebuilds the models: other trees, the same set of contacts.
TEST_F(Query, MeshMeshCollisionHasFclsContacts) {
  using Key = std::tuple<int, int>;
  int colliding = 0;
  for (int frame = 0; frame < 60; ++frame) {
    this->deform();
    const fcl::Transform3d tf1 = randomPose(this->random_, 0.2);
    const fcl::Transform3d tf2 = randomPose(this->random_, 0.6);
    const fcl::CollisionRequestd request(100000, true);
    fcl::CollisionResultd by_fcl, recorded;
    const Geometry *o1 = &this->model_, *o2 = &this->other_;
    fcl::collide(o1, tf1, o2, tf2, request, by_fcl);
    adaptive_bvh::collide(o1, tf1, o2, tf2, request, recorded);
    ASSERT_EQ(by_fcl.numContacts(), recorded.numContacts());
    const auto sorted = [](const fcl::CollisionResultd& result) {
      std::multimap<Key, fcl::Contactd> contacts;
      for (std::size_t i = 0; i < result.numContacts(); ++i) {
        const fcl::Contactd& c = result.getContact(i);
        contacts.emplace(Key(c.b1, c.b2), c);
      }
      return contacts;
    };
    const double close = 1e-9;
    const auto expected = sorted(by_fcl), found = sorted(recorded);
    for (auto x = expected.begin(), y = found.begin(); x != expected.end(); ++x, ++y) {
      EXPECT_EQ(x->first, y->first);
      EXPECT_TRUE(x->second.pos.isApprox(y->second.pos, close));
      EXPECT_TRUE(x->second.normal.isApprox(y->second.normal, close));
      EXPECT_NEAR(x->second.penetration_depth, y->second.penetration_depth, close);
      EXPECT_EQ(o1, y->second.o1) << "fcl::collide names its temporary copy here";
    }
    colliding += !expected.empty();

    fcl::CollisionResultd first_contact;
    EXPECT_EQ(expected.empty() ? 0u : 1u,
              adaptive_bvh::collide(o1, tf1, o2, tf2, fcl::CollisionRequestd(), first_contact));
    EXPECT_EQ(0u,
              adaptive_bvh::collide(o1, tf1, o2, tf2, fcl::CollisionRequestd(0), first_contact));
  }
  EXPECT_GT(colliding, 15);
  EXPECT_LT(colliding, 55);
}

TEST_F(Query, KeepsASmallerDistanceThatTheResultBrought) {
  const Geometry *o1 = &this->model_, *o2 = &this->other_;
  const fcl::Transform3d tf = fcl::Transform3d::Identity();
  fcl::Transform3d far = tf;
  far.translation()[0] = 5;
  fcl::DistanceResultd by_fcl(0.5), recorded(0.5);
  fcl::distance(o1, tf, o2, far, fcl::DistanceRequestd(), by_fcl);
  adaptive_bvh::distance(o1, tf, o2, far, fcl::DistanceRequestd(), recorded);
  EXPECT_EQ(0.5, recorded.min_distance);
  expectEqual(by_fcl, recorded, false);
}

TEST_F(Query, TakesCollisionObjectsAndEitherOrder) {
  auto adaptive = std::make_shared<AdaptiveBVHModel<TestVolume<double>>>(this->model_);
  auto plain = std::make_shared<fcl::BVHModel<TestVolume<double>>>(this->other_);
  const fcl::CollisionObjectd a(adaptive, randomPose(this->random_, 0.1));
  const fcl::CollisionObjectd b(plain, randomPose(this->random_, 2.));
  fcl::DistanceResultd ab, ba, expected;
  adaptive_bvh::distance(&a, &b, fcl::DistanceRequestd(), ab);
  adaptive_bvh::distance(&b, &a, fcl::DistanceRequestd(), ba);
  fcl::distance(adaptive.get(), a.getTransform(), plain.get(), b.getTransform(),
                fcl::DistanceRequestd(), expected);
  expectEqual(expected, ab, false);
  EXPECT_NEAR(ab.min_distance, ba.min_distance, 1e-5);
  EXPECT_EQ(2, adaptive->recordedWork().queries);
  fcl::CollisionResultd collision;
  EXPECT_EQ(expected.min_distance <= 0,
            adaptive_bvh::collide(&a, &b, fcl::CollisionRequestd(), collision) > 0);
}

TEST_F(Query, HandsOtherPairsToFcl) {
  const fcl::Boxd box(1, 1, 1);
  const fcl::Sphered sphere(0.3);
  fcl::Transform3d tf = fcl::Transform3d::Identity(), far = tf;
  far.translation()[0] = 3;
  fcl::DistanceResultd by_fcl, recorded;
  fcl::distance(&box, tf, &sphere, far, fcl::DistanceRequestd(), by_fcl);
  adaptive_bvh::distance(&box, tf, &sphere, far, fcl::DistanceRequestd(), recorded);
  EXPECT_EQ(by_fcl.min_distance, recorded.min_distance);
  fcl::CollisionResultd collision;
  EXPECT_EQ(0u, adaptive_bvh::collide(&box, tf, &sphere, far, fcl::CollisionRequestd(), collision));
  fcl::DistanceResultd plain_pair;  // two plain meshes
  EXPECT_GT(adaptive_bvh::distance(&this->other_, tf, &this->other_, far, fcl::DistanceRequestd(),
                                   plain_pair),
            0);
}

TEST_F(Query, RefusesTheDistancesOnWhichFclCrashes) {
  fcl::BVHModel<fcl::AABBd> aligned;
  fillModel(dome(5, 3), aligned);
  const fcl::Planed plane(fcl::Vector3d(0, 0, 1), 0);
  const fcl::Halfspaced halfspace(fcl::Vector3d(0, 0, 1), 0);
  const fcl::Transform3d tf = fcl::Transform3d::Identity();
  fcl::DistanceResultd result;
  for (const Geometry* shape :
       {static_cast<const Geometry*>(&plane), static_cast<const Geometry*>(&halfspace)})
    EXPECT_THROW(adaptive_bvh::distance(&aligned, tf, shape, tf, fcl::DistanceRequestd(), result),
                 std::invalid_argument);
}

/// A model with itself at another place: statistics of both sides go to the one tree.
TEST_F(Query, AModelMayMeetItself) {
  fcl::Transform3d tf = fcl::Transform3d::Identity(), beside = tf;
  beside.translation()[0] = 1.7;
  this->deform();
  fcl::DistanceResultd result;
  adaptive_bvh::distance(&this->model_, tf, &this->model_, beside, fcl::DistanceRequestd(), result);
  EXPECT_NEAR(BruteForce(this->model_, tf, this->model_, beside).distance(), result.min_distance,
              1e-5);
  EXPECT_EQ(1, this->model_.recordedWork().queries);
}

/// The end of the chain: what the query saw decides what the next update refits.
TEST(StatisticsInUse, OnlyTraversedNodesAreRefitted) {
  adaptive_bvh::RefitPolicy policy =
      adaptive_bvh::RefitPolicy::thesis(adaptive_bvh::FitnessCriterion::B);
  AdaptiveModel model(policy);
  const TriangleMesh mesh = plate(12, 12);
  fillModel(mesh, model);
  AdaptiveModel tool;
  fillModel(dome(6, 3), tool);
  const fcl::Transform3d tf = fcl::Transform3d::Identity();
  fcl::Transform3d over_corner = tf;
  over_corner.translation() = Eigen::Vector3d(1.6, 1.6, 0.2);

  Deformation deformation(mesh, Deformation::Kind::Smooth, 8);
  model.update(deformation.next());
  fcl::DistanceResultd result;
  adaptive_bvh::distance(&model, tf, &tool, over_corner, fcl::DistanceRequestd(), result);
  std::vector<bool> traversed;
  for (int i = 0; i < model.getNumBVs(); ++i) traversed.push_back(model.traversed(i));
  const auto count = std::count(traversed.begin(), traversed.end(), true);
  EXPECT_GT(count, 5);
  EXPECT_LT(count, model.getNumBVs() / 3);

  model.update(deformation.next());
  EXPECT_EQ(count, model.lastUpdate().refitted());
  for (int i = 0; i < model.getNumBVs(); ++i) {
    const bool refitted = radiusOf(model.getBV(i).bv) == model.originalRadius(i);
    EXPECT_EQ(traversed[std::size_t(i)], refitted) << "node " << i;
  }
  EXPECT_EQ(0, model.recordedWork().queries) << "an update clears the statistics";

  model.update(deformation.next());  // no query in between: B counts as true everywhere
  EXPECT_EQ(model.getNumBVs(), model.lastUpdate().refitted());
}

TEST(StatisticsInUse, WithoutQueriesTheDefaultBecomesTestA) {
  AdaptiveModel by_default, by_a;
  adaptive_bvh::RefitPolicy a;
  a.criterion = adaptive_bvh::FitnessCriterion::A;
  by_a.setRefitPolicy(a);
  const TriangleMesh mesh = plate(8, 8);
  fillModel(mesh, by_default);
  fillModel(mesh, by_a);
  Deformation deformation(mesh, Deformation::Kind::Smooth, 9);
  int refitted = 0;
  for (int frame = 0; frame < 20; ++frame) {
    by_default.update(deformation.next());
    by_a.update(deformation.positions());
    EXPECT_EQ(by_a.lastUpdate().refitted(), by_default.lastUpdate().refitted());
    refitted += by_a.lastUpdate().refitted();
  }
  EXPECT_GT(refitted, 0);
}

}  // namespace query_test
}  // namespace adaptive_bvh_test
