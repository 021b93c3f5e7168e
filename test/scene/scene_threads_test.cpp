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
using adaptive_bvh::DeformableMeshd;
using adaptive_bvh::Scened;

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
Answers ask(const Scened& scene, BodyId body) {
  Answers answers;
  adaptive_bvh::SceneCollisions<double> collisions;
  scene.collisions({}, collisions);
  answers.touching = collisions.pairs;
  answers.contacts = collisions.contacts.size();
  adaptive_bvh::ProximityRequest<double> request;
  request.distance = 0.2;
  adaptive_bvh::SceneTrianglePairs<double> pairs;
  answers.near_pairs = scene.pairsWithin(request, pairs);
  adaptive_bvh::SceneVertexContacts<double> contacts;
  answers.vertices = scene.vertexContacts(0.1, contacts);
  std::vector<adaptive_bvh::SceneDistance<double>> nearest;
  scene.nearest(body, 4, nearest);
  nearest.push_back(scene.nearest(body));
  nearest.push_back(scene.distance());
  for (const auto& found : nearest) answers.nearest.push_back(found.distance);
  answers.seen = scene.nearestPoint(Vector3<double>(0.1, 0.2, 3)).triangle;
  return answers;
}

/// Balls in a row that swell and move; two of them share a mesh.
class MovingScene {
 public:
  explicit MovingScene(int threads) {
    for (int i = 0; i < 4; ++i) {
      meshes_.push_back(std::make_unique<DeformableMeshd>(gridBall<double>(6, 4)));
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
        std::vector<Vector3<double>> points = gridBall<double>(6, 4).vertices;
        for (Vector3<double>& x : points) x *= 1 + 0.2 * std::sin(step + double(i));
        meshes_[i]->update(points);
      }
      fcl::Transform3d tf = fcl::Transform3d::Identity();
      tf.translation() = Vector3<double>(2.1 * double(i) - 4, 0.3 * std::cos(step), 0);
      scene_.setTransform(ids_[i], tf);
    }
    scene_.update();
  }
  const Scened& scene() const { return scene_; }
  BodyId first() const { return ids_[0]; }

 private:
  std::vector<std::unique_ptr<DeformableMeshd>> meshes_;
  std::vector<BodyId> ids_;
  Scened scene_;
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
      std::shared_ptr<const Scened> scene;
      int step;
    };
    std::mutex mutex;
    moving.show(0);
    Published newest{std::make_shared<const Scened>(moving.scene().snapshot()), 0};
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
      Published next{std::make_shared<const Scened>(moving.scene().snapshot()), step};
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
  Scened snapshot = moving.scene().snapshot();
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
  Scened changed;
  changed.add(std::make_shared<fcl::Sphered>(1));
  EXPECT_THROW(changed.snapshot(), std::logic_error);
}

}  // namespace scene_threads_test
}  // namespace adaptive_bvh_test
