// Whatever of FCL takes a BVHModel takes ours, over deforming frames: judged by brute force,
// or by the same call on a plain model that is built anew in every frame.
#include <gtest/gtest.h>

#include <fcl/geometry/geometric_shape_to_BVH_model.h>
#include <fcl/geometry/octree/octree.h>
#include <fcl/geometry/shape/halfspace.h>
#include <fcl/narrowphase/continuous_collision.h>
#include <fcl/narrowphase/detail/gjk_solver_libccd.h>
#include <fcl/narrowphase/detail/traversal/collision/mesh_collision_traversal_node.h>
#include <fcl/narrowphase/detail/traversal/collision_node.h>
#include <octomap/octomap.h>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/query.h"
#include "support/brute_force.h"
#include "support/shapes.h"
#include "support/test_volume.h"

namespace adaptive_bvh_test {
namespace fcl_consumers_test {

using Geometry = fcl::CollisionGeometryd;
using Plain = PlainModel;
using Transform = fcl::Transform3d;

constexpr int kFrames = 25;

template <typename BV>
struct OrientedNode {
  using Type = fcl::detail::MeshCollisionTraversalNodeRSSd;
};
template <>
struct OrientedNode<fcl::OBBRSSd> {
  using Type = fcl::detail::MeshCollisionTraversalNodeOBBRSSd;
};

/// A deforming dome, and the same built anew by FCL in every frame.
class FclConsumers : public testing::Test {
 protected:
  FclConsumers() : mesh_(dome(9, 5)), deformation_(mesh_, Kind::Smooth, 3) {
    fillModel(mesh_, model_);
  }
  using Kind = Deformation::Kind;

  void nextFrame() {
    mesh_.vertices = deformation_.next();
    model_.update(mesh_.vertices);
    fresh_ = std::make_unique<Plain>();
    fillModel(mesh_, *fresh_);
  }

  TriangleMesh mesh_;
  Deformation deformation_;
  AdaptiveModel model_;
  std::unique_ptr<Plain> fresh_;
  std::mt19937 random_{21};
};

/// The triangles of `mesh` that a collision names, whichever object it is.
std::set<long> trianglesIn(const fcl::CollisionResultd& result, const Geometry* mesh) {
  std::set<long> triangles;
  for (std::size_t i = 0; i < result.numContacts(); ++i) {
    const fcl::Contactd& contact = result.getContact(i);
    triangles.insert(contact.o1 == mesh ? contact.b1 : contact.b2);
  }
  return triangles;
}

/// Each pair is queried four times: by FCL and by this library, in both orders.
template <typename Ask>
void eachWay(const Geometry* mesh, const Transform& mesh_tf, const Geometry* other,
             const Transform& other_tf, Ask&& ask) {
  for (bool recorded : {false, true}) {
    ask(recorded, mesh, mesh_tf, other, other_tf);
    ask(recorded, other, other_tf, mesh, mesh_tf);
  }
}

double distance(bool recorded, const Geometry* o1, const Transform& tf1, const Geometry* o2,
                const Transform& tf2) {
  fcl::DistanceResultd result;
  const fcl::DistanceRequestd request;
  return recorded ? adaptive_bvh::distance(o1, tf1, o2, tf2, request, result)
                  : fcl::distance(o1, tf1, o2, tf2, request, result);
}

std::set<long> touched(bool recorded, const Geometry* mesh, const Geometry* o1,
                       const Transform& tf1, const Geometry* o2, const Transform& tf2) {
  fcl::CollisionResultd result;
  const fcl::CollisionRequestd all(100000);
  if (recorded)
    adaptive_bvh::collide(o1, tf1, o2, tf2, all, result);
  else
    fcl::collide(o1, tf1, o2, tf2, all, result);
  return trianglesIn(result, mesh);
}

TEST_F(FclConsumers, Shapes) {
  int apart = 0, touching = 0;
  for (int frame = 0; frame < kFrames; ++frame) {
    nextFrame();
    for (const auto& shape : boundedShapes()) {
      const Transform tf1 = randomPose(random_, 0.3), tf2 = randomPose(random_, 0.8);
      const double expected = distance(false, fresh_.get(), tf1, shape.get(), tf2);
      const std::set<long> hit = touched(false, fresh_.get(), fresh_.get(), tf1, shape.get(), tf2);
      ++(hit.empty() ? apart : touching);
      eachWay(&model_, tf1, shape.get(), tf2, [&](bool recorded, auto... pair) {
        EXPECT_EQ(hit, touched(recorded, &model_, pair...));
        if (hit.empty()) {
          // FCL's solvers end somewhat too far away.
          EXPECT_NEAR(expected, distance(recorded, pair...), 1e-4);
        } else if (shape->getNodeType() != fcl::GEOM_SPHERE) {  // which FCL leaves open
          EXPECT_LE(distance(recorded, pair...), 0);
        }
      });
    }
    const fcl::Halfspaced below(fcl::Vector3d(0.2, 0.3, 1).normalized(), 0);
    const Transform tf = randomPose(random_, 0.4), still = Transform::Identity();
    const std::set<long> hit = touched(false, fresh_.get(), fresh_.get(), tf, &below, still);
    eachWay(&model_, tf, &below, still, [&](bool recorded, auto... pair) {
      EXPECT_EQ(hit, touched(recorded, &model_, pair...));
    });
  }
  EXPECT_GT(apart, 40);
  EXPECT_GT(touching, 40);
}

std::shared_ptr<fcl::OcTreed> voxels(std::mt19937& random) {
  auto tree = std::make_shared<octomap::OcTree>(0.12);
  std::uniform_real_distribution<float> where(-1, 1);
  for (int i = 0; i < 60; ++i)
    tree->updateNode(octomap::point3d(where(random), where(random), where(random)), i % 4 != 0);
  tree->updateInnerOccupancy();
  return std::make_shared<fcl::OcTreed>(tree);
}

TEST_F(FclConsumers, Octrees) {
  const std::shared_ptr<fcl::OcTreed> octree = voxels(random_);
  const fcl::detail::GJKSolver_libccd<double> solver;
  int apart = 0, touching = 0;
  for (int frame = 0; frame < kFrames; ++frame) {
    nextFrame();
    const Transform tf1 = randomPose(random_, 0.9), tf2 = randomPose(random_, 0.9);
    // Every occupied cell with every triangle, by the solver that FCL takes.
    double least = std::numeric_limits<double>::max();
    std::set<long> hit;
    for (const std::array<double, 6>& cell : octree->toBoxes()) {
      const fcl::Boxd box(cell[3], cell[3], cell[3]);
      Transform box_tf = tf2;
      box_tf.translate(fcl::Vector3d(cell[0], cell[1], cell[2]));
      for (int t = 0; t < model_.num_tris; ++t) {
        const fcl::Triangle& corners = model_.tri_indices[t];
        const fcl::Vector3d &a = model_.vertices[corners[0]], &b = model_.vertices[corners[1]],
                            &c = model_.vertices[corners[2]];
        double d;
        solver.shapeTriangleDistance(box, box_tf, a, b, c, tf1, &d, nullptr, nullptr);
        least = std::min(least, d);
        if (solver.shapeTriangleIntersect(box, box_tf, a, b, c, tf1, nullptr, nullptr, nullptr))
          hit.insert(t);
      }
    }
    ++(hit.empty() ? apart : touching);
    eachWay(&model_, tf1, octree.get(), tf2, [&](bool recorded, auto... pair) {
      EXPECT_EQ(hit, touched(recorded, &model_, pair...));
      EXPECT_NEAR(std::max(0., least), std::max(0., distance(recorded, pair...)), 2e-6);
    });
  }
  EXPECT_GT(apart, 3);
  EXPECT_GT(touching, 3);
}

TEST_F(FclConsumers, OctreesWithBothSolvers) {
  const std::shared_ptr<fcl::OcTreed> octree = voxels(random_);
  for (auto solver : {fcl::GST_LIBCCD, fcl::GST_INDEP})
    for (int frame = 0; frame < kFrames; ++frame) {
      nextFrame();
      const Transform tf1 = randomPose(random_, 0.9), tf2 = randomPose(random_, 0.9);
      fcl::DistanceRequestd request(true);
      request.gjk_solver_type = solver;
      fcl::DistanceResultd by_fcl, recorded;
      fcl::distance(&model_, tf1, octree.get(), tf2, request, by_fcl);
      adaptive_bvh::distance(&model_, tf1, octree.get(), tf2, request, recorded);
      EXPECT_EQ(by_fcl.o1, recorded.o1);
      EXPECT_EQ(by_fcl.o2, recorded.o2);
      EXPECT_NEAR(std::max(0., by_fcl.min_distance), recorded.min_distance, 2e-6);
      if (recorded.min_distance > 0) {
        EXPECT_NEAR((recorded.nearest_points[0] - recorded.nearest_points[1]).norm(),
                    recorded.min_distance, 1e-12);
      }

      fcl::CollisionRequestd with_contacts(100000, true);
      with_contacts.gjk_solver_type = solver;
      std::set<std::tuple<const Geometry*, const Geometry*, long, long>> seen[2];
      for (int k = 0; k < 2; ++k) {
        fcl::CollisionResultd contacts;
        if (k == 0)
          fcl::collide(&model_, tf1, octree.get(), tf2, with_contacts, contacts);
        else
          adaptive_bvh::collide(&model_, tf1, octree.get(), tf2, with_contacts, contacts);
        for (std::size_t i = 0; i < contacts.numContacts(); ++i) {
          const fcl::Contactd& c = contacts.getContact(i);
          seen[k].emplace(c.o1, c.o2, c.b1, c.b2);
        }
      }
      // FCL's own solver overlooks a contact now and then.
      if (solver == fcl::GST_LIBCCD) {
        EXPECT_EQ(seen[0], seen[1]);
      }
    }
  // TraversalStatistics is left, and it is used.
  EXPECT_GT(model_.recordedWork().queries, 0);
  EXPECT_GT(model_.recordedWork().bv_tests, 0);
}

TEST_F(FclConsumers, AnEmptyOctreeIsFarAway) {
  const fcl::OcTreed nothing(0.1);
  const Transform still = Transform::Identity();
  fcl::DistanceResultd result;
  EXPECT_EQ(
      std::numeric_limits<double>::max(),
      adaptive_bvh::distance(&model_, still, &nothing, still, fcl::DistanceRequestd(), result));
}

TEST_F(FclConsumers, NaiveContinuousCollision) {
  const auto box = std::make_shared<fcl::Boxd>(0.3, 0.2, 0.4);
  int hits = 0, misses = 0;
  for (int frame = 0; frame < 2 * kFrames; ++frame) {
    nextFrame();
    const Transform begin = randomPose(random_, 1.5), end = randomPose(random_, 1.5);
    const Transform still = randomPose(random_, 0.5);
    fcl::ContinuousCollisionRequestd request(20);
    request.ccd_solver_type = fcl::CCDC_NAIVE;
    request.ccd_motion_type = fcl::CCDM_LINEAR;
    fcl::ContinuousCollisionResultd expected, result;
    fcl::continuousCollide<double>(fresh_.get(), begin, end, box.get(), still, still, request,
                                   expected);
    fcl::continuousCollide<double>(&model_, begin, end, box.get(), still, still, request, result);
    EXPECT_EQ(expected.is_collide, result.is_collide);
    if (expected.is_collide) {
      EXPECT_EQ(expected.time_of_contact, result.time_of_contact);
    }
    ++(expected.is_collide ? hits : misses);
  }
  EXPECT_GT(hits, 3);
  EXPECT_GT(misses, 3);
}

/// FCL goes on from where the last traversal stopped; the tree keeps its shape, so that holds over
/// updates. FCL names a pair more than once then, and so it does here.
TEST_F(FclConsumers, FrontLists) {
  const TriangleMesh hose = tube(6, 6);
  AdaptiveModel other;
  fillModel(hose, other);
  const Transform tf1 = randomPose(random_, 0.2), tf2 = randomPose(random_, 0.2);
  Deformation bend(hose, Kind::Smooth, 4);
  fcl::detail::BVHFrontList front;
  std::size_t contacts = 0;
  for (int frame = 0; frame < kFrames; ++frame) {
    nextFrame();
    other.update(bend.next());
    fcl::CollisionResultd result;
    OrientedNode<TestVolume<double>>::Type node;
    fcl::detail::initialize(node, std::as_const(static_cast<Plain&>(model_)), tf1,
                            std::as_const(static_cast<Plain&>(other)), tf2,
                            fcl::CollisionRequestd(100000), result);
    fcl::detail::collide(static_cast<fcl::detail::CollisionTraversalNodeBased*>(&node), &front);
    std::set<std::pair<int, int>> found;
    for (std::size_t i = 0; i < result.numContacts(); ++i)
      found.emplace(result.getContact(i).b1, result.getContact(i).b2);
    EXPECT_EQ(BruteForce(model_, tf1, other, tf2).contacts(), found);
    contacts += found.size();
    EXPECT_FALSE(front.empty());
  }
  EXPECT_GT(contacts, 50u);
}

template <typename Shape>
void generatesInto(const Shape& shape, std::mt19937& random) {
  AdaptiveModel model;
  Plain plain;
  const Transform pose = randomPose(random, 0.5);
  const auto generate = [&](auto& into) {
    if constexpr (std::is_same_v<Shape, fcl::Boxd>)
      fcl::generateBVHModel(into, shape, pose);
    else
      fcl::generateBVHModel(into, shape, pose, 8, 8);
  };
  generate(model);
  generate(plain);
  ASSERT_TRUE(model.validate());
  ASSERT_EQ(plain.num_tris, model.num_tris);
  TriangleMesh mesh;
  mesh.vertices.assign(model.vertices, model.vertices + model.num_vertices);
  mesh.triangles.assign(model.tri_indices, model.tri_indices + model.num_tris);
  const fcl::Boxd box(0.3, 0.4, 0.5);
  Deformation bend(mesh, Deformation::Kind::Smooth, 9);
  for (int frame = 0; frame < 8; ++frame) {
    model.update(bend.next());
    ASSERT_TRUE(model.validate());
    mesh.vertices = bend.positions();
    Plain fresh;
    fillModel(mesh, fresh);
    const Transform tf = randomPose(random, 1.5);
    EXPECT_NEAR(std::max(0., distance(false, &fresh, Transform::Identity(), &box, tf)),
                std::max(0., distance(true, &model, Transform::Identity(), &box, tf)), 2e-6);
  }
}

TEST_F(FclConsumers, GeneratedModels) {
  generatesInto(fcl::Boxd(0.5, 0.6, 0.7), random_);
  generatesInto(fcl::Sphered(0.5), random_);
  generatesInto(fcl::Ellipsoidd(0.3, 0.4, 0.5), random_);
  generatesInto(fcl::Cylinderd(0.3, 0.8), random_);
  generatesInto(fcl::Coned(0.3, 0.8), random_);
}

}  // namespace fcl_consumers_test
}  // namespace adaptive_bvh_test
