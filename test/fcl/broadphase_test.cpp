// All of FCL's broad-phase managers over deforming frames: after refresh they find every pair that
// brute force over the objects finds, and the least distance.
#include "adaptive_bvh/broadphase.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <set>
#include <tuple>

#include <fcl/broadphase/broadphase_SSaP.h>
#include <fcl/broadphase/broadphase_bruteforce.h>
#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/broadphase/broadphase_dynamic_AABB_tree_array.h>
#include <fcl/broadphase/broadphase_interval_tree.h>
#include <fcl/broadphase/broadphase_spatialhash.h>
#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/query.h"
#include "support/long_mode.h"
#include "support/meshes.h"
#include "support/test_volume.h"

/// These managers of FCL's leak, whatever is registered.
extern "C" const char* __lsan_default_suppressions() {
  return "leak:IntervalTreeCollisionManager\nleak:DynamicAABBTreeCollisionManager_Array\n"
         "leak:implementation_array\n";
}

namespace adaptive_bvh_test {
namespace broadphase_test {

using adaptive_bvh::refresh;
using Object = fcl::CollisionObjectd;
using Manager = fcl::BroadPhaseCollisionManagerd;
using Pairs = std::set<std::pair<Object*, Object*>>;

std::pair<Object*, Object*> ordered(Object* a, Object* b) { return std::minmax(a, b); }

bool touches(Object* a, Object* b) {
  fcl::CollisionResultd result;
  return adaptive_bvh::collide(a, b, fcl::CollisionRequestd(), result) > 0;
}

double distanceOf(Object* a, Object* b) {
  fcl::DistanceResultd result;
  return adaptive_bvh::distance(a, b, fcl::DistanceRequestd(), result);
}

bool gatherPairs(Object* a, Object* b, void* pairs) {
  if (touches(a, b)) static_cast<Pairs*>(pairs)->insert(ordered(a, b));
  return false;
}

bool gatherDistance(Object* a, Object* b, void* least, double& bound) {
  auto& distance = *static_cast<double*>(least);
  distance = std::min(distance, distanceOf(a, b));
  bound = distance;
  return distance <= 0;
}

std::unique_ptr<Manager> make(const std::string& name) {
  using fcl::Vector3d;
  if (name == "Naive") return std::make_unique<fcl::NaiveCollisionManagerd>();
  if (name == "SaP") return std::make_unique<fcl::SaPCollisionManagerd>();
  if (name == "SSaP") return std::make_unique<fcl::SSaPCollisionManagerd>();
  if (name == "IntervalTree") return std::make_unique<fcl::IntervalTreeCollisionManagerd>();
  if (name == "SpatialHashing")
    return std::make_unique<fcl::SpatialHashingCollisionManager<double>>(
        0.4, Vector3d::Constant(-3), Vector3d::Constant(3));
  if (name == "DynamicAABBTree") return std::make_unique<fcl::DynamicAABBTreeCollisionManagerd>();
  return std::make_unique<fcl::DynamicAABBTreeCollisionManager_Arrayd>();
}

/// A body that deforms, of either type.
struct Body {
  std::shared_ptr<fcl::CollisionGeometryd> geometry;
  std::function<void(const std::vector<fcl::Vector3d>&)> update;
};

Body makeDeforming(const TriangleMesh& mesh, bool is_mesh) {
  if (is_mesh) {
    const auto body = std::make_shared<adaptive_bvh::DeformableMesh>(mesh);
    return {body, [body](const auto& positions) { body->update(positions); }};
  }
  const auto body = std::make_shared<AdaptiveModel>();
  fillModel(mesh, *body);
  body->mesh();  // for pairs with the other type
  return {body, [body](const auto& positions) { body->update(positions); }};
}

Pairs touchingPairs(const std::vector<Object*>& objects) {
  Pairs pairs;
  for (std::size_t i = 0; i < objects.size(); ++i)
    for (std::size_t j = i + 1; j < objects.size(); ++j)
      if (touches(objects[i], objects[j])) pairs.insert(ordered(objects[i], objects[j]));
  return pairs;
}

double leastDistance(const std::vector<Object*>& objects) {
  double least = std::numeric_limits<double>::max();
  for (std::size_t i = 0; i < objects.size(); ++i)
    for (std::size_t j = i + 1; j < objects.size(); ++j)
      least = std::min(least, distanceOf(objects[i], objects[j]));
  return least;
}

Pairs pairsFound(const Manager& manager) {
  Pairs found;
  manager.collide(&found, gatherPairs);
  return found;
}

/// Which manager, and of which types bodies are.
using Case = std::tuple<const char*, const char*>;
class Broadphase : public testing::TestWithParam<Case> {};

TEST_P(Broadphase, FindsWhatBruteForceFindsInEveryFrame) {
  std::mt19937 random(testSeed(5));
  std::vector<Body> models;
  std::vector<Deformation> deformations;
  std::vector<Object> storage;
  const std::vector<TriangleMesh> meshes = {dome(9, 4), tube(5, 7), plate(6, 6)};
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    const std::string types = std::get<1>(GetParam());
    models.push_back(makeDeforming(meshes[i], types == "Meshes" || (types == "Mixed" && i != 1)));
    deformations.emplace_back(meshes[i], Deformation::Kind::Smooth, unsigned(i) + 1);
    storage.emplace_back(models.back().geometry, randomPose(random, 0.6));
  }
  for (int i = 0; i < 5; ++i) {
    storage.emplace_back(std::make_shared<fcl::Boxd>(0.2, 0.3, 0.1), randomPose(random, 0.9));
    storage.emplace_back(std::make_shared<fcl::Capsuled>(0.1, 0.4), randomPose(random, 0.9));
  }
  std::vector<Object*> objects;
  for (Object& object : storage) objects.push_back(&object);
  const std::vector<Object*> deforming(objects.begin(), objects.begin() + 3);

  const std::unique_ptr<Manager> manager = make(std::get<0>(GetParam()));
  manager->registerObjects(objects);
  manager->setup();
  std::size_t touching = 0, apart = 0;
  Pairs seen;
  for (int frame = 0; frame < 40; ++frame) {
    for (std::size_t i = 0; i < models.size(); ++i) models[i].update(deformations[i].next());
    if (frame % 4 == 3)  // one at a time does as well
      for (Object* object : deforming) refresh(*object, *manager);
    else
      refresh(deforming, *manager);

    const Pairs expected = touchingPairs(objects), found = pairsFound(*manager);
    const double least = leastDistance(objects);
    EXPECT_TRUE(expected == found)
        << "frame " << frame << ": " << expected.size() << " touch, " << found.size() << " found";
    double distance = std::numeric_limits<double>::max();
    manager->distance(&distance, gatherDistance);
    if (least > 0)
      EXPECT_NEAR(least, distance, 1e-5);  // of two shapes FCL's depends on their order
    else
      EXPECT_LE(distance, 0);
    touching += expected.size();
    apart += objects.size() * (objects.size() - 1) / 2 - expected.size();
    seen.insert(expected.begin(), expected.end());
  }
  EXPECT_GT(touching, 40u);
  EXPECT_GT(apart, 40u);
  EXPECT_GT(seen.size(), 2u);
}

/// Boxes that move, leave and come back, in every order of unregisterObject, registerObject and
/// refresh.
class ChangingScene {
 public:
  explicit ChangingScene(const std::string& name) : manager_(make(name)) {
    storage_.reserve(kObjects);
    for (int i = 0; i < kObjects; ++i)
      storage_.emplace_back(std::make_shared<fcl::Boxd>(0.3, 0.4, 0.5), randomPose(random_, 0.8));
    for (Object& object : storage_) inside_.push_back(&object);
    manager_->registerObjects(inside_);
    manager_->setup();
  }

  void step(int frame) {
    if (frame % 2 == 0) leave();
    if (frame % 3 == 0) leave();
    if (frame % 4 == 0) enter();
    for (Object* object : inside_) object->setTransform(randomPose(random_, 0.8));
    refresh(inside_, *manager_);
    if (frame % 5 == 0) {
      leave();
      refresh(std::vector<Object*>(), *manager_);
    }
    if (frame % 6 == 5)
      while (!outside_.empty()) enter();
    refresh(inside_, *manager_);
  }
  const std::vector<Object*>& inside() const { return inside_; }
  const Manager& manager() const { return *manager_; }

 private:
  static constexpr int kObjects = 24;

  void leave() {
    const std::size_t i = random_() % inside_.size();
    manager_->unregisterObject(inside_[i]);
    outside_.push_back(inside_[i]);
    inside_.erase(inside_.begin() + std::ptrdiff_t(i));
  }
  void enter() {
    if (outside_.empty()) return;
    outside_.back()->setTransform(randomPose(random_, 0.8));
    outside_.back()->computeAABB();
    manager_->registerObject(outside_.back());
    inside_.push_back(outside_.back());
    outside_.pop_back();
  }

  std::mt19937 random_{testSeed(7)};
  std::vector<Object> storage_;
  std::vector<Object*> inside_, outside_;
  std::unique_ptr<Manager> manager_;
};

class ChangingBroadphase : public testing::TestWithParam<const char*> {};

TEST_P(ChangingBroadphase, FindsWhatBruteForceFinds) {
  ChangingScene scene(GetParam());
  std::size_t touching = 0;
  for (int frame = 0; frame < 60; ++frame) {
    scene.step(frame);
    const Pairs expected = touchingPairs(scene.inside());
    EXPECT_TRUE(expected == pairsFound(scene.manager())) << "frame " << frame;
    touching += expected.size();
  }
  EXPECT_GT(touching, 300u);
}

constexpr const char* kManagers[] = {"Naive",
                                     "SaP",
                                     "SSaP",
                                     "IntervalTree",
                                     "SpatialHashing",
                                     "DynamicAABBTree",
                                     "DynamicAABBTreeArray"};
INSTANTIATE_TEST_SUITE_P(All, ChangingBroadphase, testing::ValuesIn(kManagers),
                         [](const auto& info) { return std::string(info.param); });

INSTANTIATE_TEST_SUITE_P(All, Broadphase,
                         testing::Combine(testing::ValuesIn(kManagers),
                                          testing::Values("Models", "Meshes", "Mixed")),
                         [](const auto& info) {
                           return std::string(std::get<0>(info.param)) + std::get<1>(info.param);
                         });

}  // namespace broadphase_test
}  // namespace adaptive_bvh_test
