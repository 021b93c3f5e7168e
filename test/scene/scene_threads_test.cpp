// Snapshots of a scene, queried by other threads while the scene changes: for ThreadSanitizer, and
// with the answers of the steps that they were taken from.
#include <gtest/gtest.h>

#include <mutex>
#include <thread>

#include <fcl/geometry/shape/sphere.h>

#include "adaptive_bvh/scene.h"
#include "support/closed_bodies.h"

namespace adaptive_bvh_test {
namespace scene_threads_test {

using adaptive_bvh::BodyId;
using adaptive_bvh::BodyPair;
using adaptive_bvh::DeformableMesh;
using adaptive_bvh::Scene;

/// What a reader asks.
struct Answers {
  std::vector<BodyPair> touching;
  std::size_t contacts, near_pairs, vertices;
  std::vector<double> nearest;
  int seen;

  bool operator==(const Answers& o) const {
    return touching == o.touching && contacts == o.contacts && near_pairs == o.near_pairs &&
           vertices == o.vertices && nearest == o.nearest && seen == o.seen;
  }
};
Answers ask(const Scene& scene, BodyId body) {
  Answers answers;
  adaptive_bvh::SceneCollisions collisions;
  scene.collide({}, collisions);
  answers.touching = collisions.pairs;
  answers.contacts = collisions.contacts.size();
  adaptive_bvh::ProximityRequest request;
  request.distance = 0.2;
  adaptive_bvh::SceneTrianglePairs pairs;
  answers.near_pairs = scene.pairsWithin(request, pairs);
  adaptive_bvh::SceneVertexContacts contacts;
  answers.vertices = scene.vertexContacts(0.1, contacts);
  std::vector<adaptive_bvh::SceneDistance> nearest;
  scene.nearest(body, 4, nearest);
  nearest.push_back(scene.nearest(body));
  nearest.push_back(scene.distance());
  for (const auto& found : nearest) answers.nearest.push_back(found.distance);
  answers.seen = scene.nearestPoint(fcl::Vector3d(0.1, 0.2, 3)).element;
  return answers;
}

/// Balls in a row that swell and move; two of them share a mesh.
class MovingScene {
 public:
  explicit MovingScene(int threads) {
    for (int i = 0; i < 4; ++i) {
      meshes_.push_back(std::make_unique<DeformableMesh>(gridBall(6, 4)));
      ids_.push_back(scene_.add(*meshes_.back()));
    }
    ids_.push_back(scene_.add(*meshes_.back()));
    scene_.add(std::make_shared<fcl::Sphered>(0.7));
    scene_.setThreads(threads);
    show(0);
  }
  void show(int step) {
    for (std::size_t i = 0; i < ids_.size(); ++i) {
      if (i < meshes_.size()) {
        std::vector<fcl::Vector3d> points = gridBall(6, 4).vertices;
        for (fcl::Vector3d& x : points) x *= 1 + 0.2 * std::sin(step + double(i));
        meshes_[i]->update(points);
      }
      fcl::Transform3d tf = fcl::Transform3d::Identity();
      tf.translation() = fcl::Vector3d(2.1 * double(i) - 4, 0.3 * std::cos(step), 0);
      scene_.setTransform(ids_[i], tf);
    }
    scene_.update();
  }
  const Scene& scene() const { return scene_; }
  BodyId first() const { return ids_[0]; }

 private:
  std::vector<std::unique_ptr<DeformableMesh>> meshes_;
  std::vector<BodyId> ids_;
  Scene scene_;
};

TEST(SceneThreads, QuerySnapshotsWhileTheSceneChanges) {
  constexpr int kSteps = 20, kReaders = 3;
  for (const int threads : {1, 2}) {
    MovingScene moving(threads);
    std::vector<Answers> expected;
    for (int step = 0; step < kSteps; ++step) {
      moving.show(step);
      expected.push_back(ask(moving.scene(), moving.first()));
    }
    EXPECT_FALSE(expected[0] == expected[1]);

    struct Published {
      std::shared_ptr<const Scene> scene;
      int step;
    };
    std::mutex mutex;
    moving.show(0);
    Published newest{std::make_shared<const Scene>(moving.scene().snapshot()), 0};
    std::vector<std::thread> readers;
    std::vector<int> wrong(kReaders, 0);
    for (std::size_t r = 0; r < kReaders; ++r)
      readers.emplace_back([&, r] {
        for (int step = 0; step < kSteps - 1;) {
          std::unique_lock<std::mutex> lock(mutex);
          const Published seen = newest;
          lock.unlock();
          step = seen.step;
          wrong[r] += !(ask(*seen.scene, moving.first()) == expected[std::size_t(step)]);
        }
      });
    for (int step = 1; step < kSteps; ++step) {
      moving.show(step);
      Published next{std::make_shared<const Scene>(moving.scene().snapshot()), step};
      const std::lock_guard<std::mutex> lock(mutex);
      std::swap(newest, next);
    }
    for (std::thread& reader : readers) reader.join();
    EXPECT_EQ(std::vector<int>(kReaders, 0), wrong);
  }
}

TEST(SceneThreads, ASnapshotStaysAsItWas) {
  MovingScene moving(1);
  const Answers before = ask(moving.scene(), moving.first());
  Scene snapshot = moving.scene().snapshot();
  moving.show(3);
  EXPECT_FALSE(before == ask(moving.scene(), moving.first()));
  EXPECT_TRUE(before == ask(snapshot, moving.first()));
  const auto bodies = snapshot.bodies();
  EXPECT_EQ(bodies, moving.scene().bodies());
  EXPECT_EQ(&snapshot.geometry(bodies[3]), &snapshot.geometry(bodies[4])) << "a shared mesh";
  EXPECT_NE(&snapshot.geometry(bodies[3]), &moving.scene().geometry(bodies[3]));
  snapshot.remove(bodies[0]);  // it is a scene of its own
  snapshot.update();
  EXPECT_EQ(bodies.size(), moving.scene().size());
  Scene changed;
  changed.add(std::make_shared<fcl::Sphered>(1));
  EXPECT_THROW(changed.snapshot(), std::logic_error);
}

}  // namespace scene_threads_test
}  // namespace adaptive_bvh_test
