// Code that was written for fcl::BVHModel under `using namespace fcl`, with every header of ours
// included: it compiles, unqualified, and answers as before.
#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/broadphase.h"
#include "adaptive_bvh/coherent_distance.h"
#include "adaptive_bvh/continuous_collision.h"
#include "adaptive_bvh/deformable_mesh.h"
#include "adaptive_bvh/feature_pairs.h"
#include "adaptive_bvh/hierarchy.h"
#include "adaptive_bvh/mesh.h"
#include "adaptive_bvh/mesh_io.h"
#include "adaptive_bvh/point_query.h"
#include "adaptive_bvh/proximity.h"
#include "adaptive_bvh/query.h"
#include "adaptive_bvh/refit_policy.h"
#include "adaptive_bvh/self_collision.h"
#include "adaptive_bvh/tuning.h"
#include "adaptive_bvh/update_report.h"

#include <gtest/gtest.h>

#include <iterator>

#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/broadphase/default_broadphase_callbacks.h>
#include <fcl/geometry/geometric_shape_to_BVH_model.h>
#include <fcl/narrowphase/continuous_collision.h>

#include "support/meshes.h"

using namespace fcl;

namespace namespace_test {

using Adaptive = adaptive_bvh::AdaptiveBVHModeld;
using Plain = BVHModel<RSSd>;

template <typename BV>
int countTriangles(const BVHModel<BV>& model) {
  return model.num_tris;
}

double radiusOf(const CollisionGeometry<double>* geometry) { return geometry->aabb_radius; }

template <typename BV>
double heightOf(BVHModel<BV>* model) {
  double height = 0;
  for (int v = 0; v < model->num_vertices; ++v) height = std::max(height, model->vertices[v][2]);
  return height;
}

Transform3d at(double x, double y, double z) {
  Transform3d pose = Transform3d::Identity();
  pose.translation() = Vector3d(x, y, z);
  return pose;
}

template <typename Model>
std::shared_ptr<Model> makeDome() {
  const auto mesh = adaptive_bvh_test::dome(9, 4);
  auto model = std::make_shared<Model>();
  model->beginModel();
  model->addSubModel(mesh.vertices, mesh.triangles);
  model->endModel();
  model->computeLocalAABB();
  return model;
}

/// Every answer of a program in the user's style, in a row.
template <typename Model>
std::vector<double> answersOf() {
  const std::shared_ptr<Model> first = makeDome<Model>(), second = makeDome<Model>();
  const Model &a = *first, &b = *second;
  const Transform3d near = at(0.3, 0.1, 0.1), far = at(1.4, 0.3, 0.2);
  const DistanceRequestd request(true);
  const CollisionRequestd all(100000, true);
  std::vector<double> answers;

  for (const Transform3d& pose : {near, far}) {
    DistanceResultd result;
    answers.push_back(distance(&a, at(0, 0, 0), &b, pose, request, result));
    CollisionResultd contacts;
    collide(&a, at(0, 0, 0), &b, pose, all, contacts);
    answers.push_back(double(contacts.numContacts()));
    const Boxd box(0.2, 0.3, 0.4);
    DistanceResultd to_box, from_box;
    answers.push_back(distance(&a, pose, &box, at(0, 0, 0), request, to_box));
    answers.push_back(distance(&box, pose, first.get(), at(0, 0, 0), request, from_box));
    CollisionResultd in_box;
    collide(&box, pose, &b, at(0, 0, 0), all, in_box);
    answers.push_back(double(in_box.numContacts()));
  }

  const std::shared_ptr<CollisionGeometryd> geometry = first;
  const std::shared_ptr<const CollisionGeometryd> read_only = second;
  CollisionObjectd one(geometry), other(second, far), third(second, near);
  DistanceResultd between;
  answers.push_back(distance(&one, &other, request, between));
  CollisionResultd common;
  answers.push_back(double(collide(&one, &third, CollisionRequestd(), common)));
  answers.push_back(radiusOf(geometry.get()) + radiusOf(read_only.get()) + radiusOf(&a));

  DynamicAABBTreeCollisionManagerd manager;
  for (CollisionObjectd* object : {&one, &other, &third}) manager.registerObject(object);
  manager.setup();
  DefaultCollisionData<double> collisions;
  collisions.request = all;
  manager.collide(&collisions, DefaultCollisionFunction<double>);
  answers.push_back(double(collisions.result.numContacts()));
  DefaultDistanceData<double> nearest;
  manager.distance(&other, &nearest, DefaultDistanceFunction<double>);
  answers.push_back(nearest.result.min_distance);

  ContinuousCollisionResultd moving;
  ContinuousCollisionRequestd naive(20);
  naive.ccd_solver_type = CCDC_NAIVE;
  answers.push_back(continuousCollide(&a, at(0, 0, 0), at(1.2, 0, 0), &b, far, far, naive, moving));

  Model sphere;
  generateBVHModel(sphere, Sphered(0.4), near, 8, 8);
  answers.push_back(countTriangles(sphere) + countTriangles(a) + heightOf(first.get()));
  const std::vector<const Model*> models = {&a, &b, &sphere};
  answers.push_back(double(std::distance(models.begin(), models.end())));
  using std::distance;
  answers.push_back(double(distance(models.begin(), models.end())));
  RSSd bv = sphere.getBV(0).bv;
  answers.push_back(overlap(Matrix3d::Identity(), Vector3d(5, 0, 0), bv, a.getBV(0).bv));
  BVHModel<RSSd>& base = sphere;
  answers.push_back(base.getNumBVs() > 0);
  return answers;
}

TEST(Namespace, CodeForFclsModelCompilesAndAnswersTheSame) {
  const std::vector<double> expected = answersOf<Plain>(), found = answersOf<Adaptive>();
  ASSERT_EQ(expected.size(), found.size());
  for (std::size_t i = 0; i < expected.size(); ++i)
    EXPECT_NEAR(expected[i], found[i], 1e-12) << "answer " << i;
  EXPECT_GT(expected[1], 0) << "near ones touch";
  EXPECT_GT(expected[5], 0.1) << "far ones do not";
}

/// An unqualified call is FCL's: nothing is recorded. Ours is called by its namespace, with or
/// without the type.
TEST(Namespace, OursIsFoundByItsName) {
  const std::shared_ptr<Adaptive> a = makeDome<Adaptive>(), b = makeDome<Adaptive>();
  const Transform3d origin = at(0, 0, 0), above = at(0.2, 0, 1.2);
  const DistanceRequestd request;
  DistanceResultd by_fcl, by_name, by_type, by_objects, of_queries;
  distance(a.get(), origin, b.get(), above, request, by_fcl);
  EXPECT_EQ(0, a->recordedWork().queries);
  adaptive_bvh::distance(a.get(), origin, b.get(), above, request, by_name);
  adaptive_bvh::distance(a.get(), origin, b.get(), above, DistanceRequestd(), by_type);
  const CollisionObjectd one(a, origin), other(b, above);
  adaptive_bvh::distance(&one, &other, request, by_objects);
  EXPECT_EQ(3, a->recordedWork().queries);
  for (const DistanceResultd& result : {by_name, by_type, by_objects})
    EXPECT_NEAR(by_fcl.min_distance, result.min_distance, 1e-12);

  CollisionResultd contacts;
  EXPECT_EQ(0u,
            adaptive_bvh::collide(a.get(), origin, b.get(), above, CollisionRequestd(), contacts));
  EXPECT_EQ(0u, adaptive_bvh::collide(&one, &other, CollisionRequestd(), contacts));
  EXPECT_EQ(5, a->recordedWork().queries);
  EXPECT_EQ(0u, selfCollide(a->mesh(), CollisionRequestd(100000), contacts));  // FCL has none
}

}  // namespace namespace_test
