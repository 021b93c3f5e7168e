// Many threads query shared const models and meshes at once, with the results of one thread. Run
// under ThreadSanitizer by CI. Plain FCL crashes in the second test.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstring>
#include <memory>
#include <optional>
#include <shared_mutex>
#include <thread>

#include <fcl/geometry/shape/box.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/distance.h>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/coherent_distance.h"
#include "adaptive_bvh/proximity.h"
#include "adaptive_bvh/query.h"
#include "adaptive_bvh/self_collision.h"
#include "support/long_mode.h"
#include "support/meshes.h"
#include "support/test_volume.h"

namespace adaptive_bvh_test {
namespace shared_objects_test {

using Geometry = fcl::CollisionGeometryd;

constexpr int kThreads = 8;
constexpr int kPoses = 40;

class Threads : public testing::Test {
 protected:
  Threads() {
    const TriangleMesh sheet = plate(8, 8), hose = tube(6, 8);
    fillModel(sheet, a_);
    fillModel(hose, b_);
    Deformation bend_a(sheet, Deformation::Kind::Smooth, 1);
    Deformation bend_b(hose, Deformation::Kind::Smooth, 2);
    for (int frame = 0; frame < 10; ++frame) {
      a_.update(bend_a.next());
      b_.update(bend_b.next());
    }
    last_ = bend_a.positions();
    std::mt19937 random(testSeed(3));
    for (int i = 0; i < kPoses; ++i) {
      poses_.push_back(randomPose(random, 0.5));
      poses_.push_back(randomPose(random, 0.5));
    }
  }

  struct Answers {
    std::vector<double> distances;
    std::vector<std::size_t> contacts;
    bool agree(const Answers& o) const {
      return contacts == o.contacts && distances == o.distances;
    }
  };

  Answers ask() const {
    const Geometry *a = &a_, *b = &b_;
    const fcl::Boxd box(0.4, 0.5, 0.6);
    Answers answers;
    for (int i = 0; i < kPoses; ++i) {
      const fcl::Transform3d &tf1 = poses_[std::size_t(2 * i)],
                             &tf2 = poses_[std::size_t(2 * i + 1)];
      const auto distance = [&](bool recorded, const Geometry* other) {
        fcl::DistanceResultd result;
        const fcl::DistanceRequestd request;
        answers.distances.push_back(
            recorded ? adaptive_bvh::distance(a, tf1, other, tf2, request, result)
                     : fcl::distance(a, tf1, other, tf2, request, result));
      };
      const auto collide = [&](bool recorded, const Geometry* other) {
        fcl::CollisionResultd result;
        const fcl::CollisionRequestd request(1000);
        answers.contacts.push_back(recorded
                                       ? adaptive_bvh::collide(a, tf1, other, tf2, request, result)
                                       : fcl::collide(a, tf1, other, tf2, request, result));
      };
      for (bool recorded : {true, false}) {
        distance(recorded, b);
        distance(recorded, &box);
        collide(recorded, b);
        collide(recorded, &box);
      }
    }
    return answers;
  }

  std::vector<Answers> askInParallel() const {
    std::vector<Answers> answers(kThreads);
    std::vector<std::thread> threads;
    for (Answers& mine : answers) threads.emplace_back([this, &mine] { mine = ask(); });
    for (std::thread& thread : threads) thread.join();
    return answers;
  }

  AdaptiveModel a_, b_;
  std::vector<fcl::Vector3d> last_;
  std::vector<fcl::Transform3d> poses_;
};

TEST_F(Threads, GetTheAnswersOfOneThread) {
  const Answers serial = ask();
  const int queries = a_.recordedWork().queries;
  for (const Answers& answers : askInParallel()) EXPECT_TRUE(answers.agree(serial));
  EXPECT_EQ(queries * (1 + kThreads), a_.recordedWork().queries);
}

/// Parallel queries record the statistics of the same queries one after the other.
TEST_F(Threads, RecordTheStatisticsOfOneThread) {
  using adaptive_bvh::FitnessCriterion;
  a_.setRefitPolicy(adaptive_bvh::RefitPolicy::thesis(FitnessCriterion::RefitNone));
  ask();
  std::vector<bool> serial;
  for (int i = 0; i < a_.getNumBVs(); ++i) serial.push_back(a_.traversed(i));
  a_.update(last_);  // nothing moves, nothing is refitted; the statistics are cleared
  askInParallel();
  for (int i = 0; i < a_.getNumBVs(); ++i) EXPECT_EQ(serial[std::size_t(i)], a_.traversed(i)) << i;
}

/// A tree changed through a base reference is repaired by whichever query comes first.
TEST_F(Threads, RepairAChangedTreeOnce) {
  const Answers expected = ask();
  for (int round = 0; round < 5; ++round) {
    PlainModel& base = a_;
    base.beginReplaceModel();
    base.replaceSubModel(last_);
    base.endReplaceModel();  // FCL's wrong default
    for (const Answers& answers : askInParallel()) {
      ASSERT_EQ(expected.distances.size(), answers.distances.size());
      for (std::size_t i = 0; i < expected.distances.size(); ++i)
        EXPECT_NEAR(expected.distances[i], answers.distances[i], 1e-9);
      EXPECT_EQ(expected.contacts, answers.contacts);
    }
    EXPECT_TRUE(a_.validate());
  }
}

/// A thread that finds a tree repaired by another thread may read all of it without a lock: nothing
/// is written after the flag of the repair. (ThreadSanitizer checks that.)
TEST_F(Threads, SeeAllThatAnotherHasRepaired) {
  PlainModel& base = a_;
  base.beginReplaceModel();
  base.replaceSubModel(last_);
  base.endReplaceModel();
  double first = 0, later = 1;
  std::thread repairs([&] { first = a_.originalRadius(0); });
  std::thread finds([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    later = a_.originalRadius(0);
  });
  repairs.join();
  finds.join();
  EXPECT_EQ(first, later);
}

/// What only looks into a model may do so while a query of another thread repairs it.
TEST_F(Threads, LookIntoAModelThatAnotherRepairs) {
  for (int round = 0; round < 5; ++round) {
    PlainModel& base = a_;
    base.beginReplaceModel();
    base.replaceSubModel(last_);
    base.endReplaceModel();
    std::vector<std::thread> threads;
    for (int t = 0; t < kThreads; ++t)
      threads.emplace_back([this, t] {
        std::string reason;
        switch (t % 4) {
          case 0: a_.validate(&reason); break;  // true or not, as it comes before the repair or not
          case 1: a_.refittedNodes(); break;
          case 2: EXPECT_TRUE(AdaptiveModel(a_).validate(&reason)) << reason; break;
          default: EXPECT_GE(a_.originalRadius(0), 0); a_.traversed(0);
        }
      });
    ask();
    for (std::thread& thread : threads) thread.join();
    EXPECT_TRUE(a_.validate());
  }
}

/// A copy of a DeformableMesh is a snapshot. Threads query it while the original is updated, in its
/// vertices all or some, and is destroyed in the end. They get the answers for the positions at
/// which the copy was made.
TEST_F(Threads, QueryASnapshotWhileTheOriginalIsUpdated) {
  using adaptive_bvh::DeformableMesh;
  constexpr int kFrames = 24, kReaders = 3;
  const TriangleMesh sheet = plate(12, 12);
  const DeformableMesh hose(tube(6, 8));
  const fcl::Transform3d still = fcl::Transform3d::Identity();
  fcl::Transform3d above = still;
  above.translation() = fcl::Vector3d(-0.5, 0.4, 0.3);

  struct Found {
    double distance;
    std::size_t contacts, own_contacts, pairs;
    bool operator==(const Found& o) const {
      return distance == o.distance && contacts == o.contacts && own_contacts == o.own_contacts &&
             pairs == o.pairs;
    }
  };
  const auto find = [&](const DeformableMesh& mesh) -> Found {
    fcl::DistanceResultd distance;
    fcl::CollisionResultd contacts, own_contacts;
    const fcl::CollisionRequestd all(1000);
    adaptive_bvh::ProximityRequest request;
    request.distance = 0.2;
    adaptive_bvh::TrianglePairs pairs;
    adaptive_bvh::distance(&mesh, still, &hose, above, fcl::DistanceRequestd(), distance);
    adaptive_bvh::collide(&mesh, still, &hose, above, all, contacts);
    selfCollide(mesh, {adaptive_bvh::NeighbourFilter::SharedEdge}, all, own_contacts);
    pairsWithin(mesh, still, hose, above, request, pairs);
    return {distance.min_distance, contacts.numContacts(), own_contacts.numContacts(),
            pairs.size()};
  };

  std::vector<std::vector<fcl::Vector3d>> positions;
  Deformation bend(sheet, Deformation::Kind::Smooth, 1);
  for (int frame = 0; frame < kFrames; ++frame) positions.push_back(bend.next());
  std::vector<unsigned> some;
  for (unsigned v = 0; v < 20; ++v) some.push_back(v);

  auto original = std::make_unique<DeformableMesh>(sheet);
  for (std::size_t frame = 0; frame < positions.size(); ++frame) {
    original->update(positions[frame]);
    const DeformableMesh snapshot(*original);
    const Found expected = find(snapshot);
    std::atomic<int> done{0}, wrong{0};
    std::vector<std::thread> threads;
    for (int reader = 0; reader < kReaders; ++reader)
      threads.emplace_back([&] {
        for (int i = 0; i < 4; ++i) wrong += !(find(snapshot) == expected);
        ++done;
      });
    const bool is_last = frame + 1 == positions.size();
    for (std::size_t i = 1; done < kReaders && !is_last; ++i) {
      const auto& other = positions[(frame + i) % positions.size()];
      if (i % 3 == 0)
        original->update(some, {other.begin(), other.begin() + int(some.size())});
      else
        original->update(other);
    }
    if (is_last) original.reset();
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(0, wrong);
    EXPECT_TRUE(snapshot.validate());
    EXPECT_EQ(positions[frame], snapshot.vertices());
  }
}

/// The documented way to deform what others look at: a std::shared_mutex. Two threads update the
/// model in turns. Every reader gets the answers that one thread alone gets in that frame,
/// whichever way it asks.
TEST(ReadersAndWriters, ShareAModel) {
  constexpr int kFrames = 60, kReaders = 4, kWriters = 2;
  const TriangleMesh sheet = plate(8, 8), hose = tube(6, 8);
  const fcl::Transform3d still = fcl::Transform3d::Identity();
  fcl::Transform3d above = still;
  above.translation() = fcl::Vector3d(-0.5, 0.4, 0.3);
  const fcl::Boxd box(0.4, 0.5, 0.6);
  const fcl::CollisionRequestd all(1000);

  struct Frame {
    double distance, to_box;
    std::size_t contacts, own_contacts;
  };
  const auto ask = [&](const AdaptiveModel& a, const AdaptiveModel& b,
                       adaptive_bvh::CoherentDistance* pair) -> Frame {
    fcl::DistanceResultd distance, to_box;
    fcl::CollisionResultd contacts, own_contacts;
    const fcl::DistanceRequestd request;
    if (pair)
      pair->distance(still, above, request, distance);
    else
      adaptive_bvh::distance(&a, still, &b, above, request, distance);
    adaptive_bvh::distance(&a, still, &box, above, request, to_box);
    adaptive_bvh::collide(&a, still, &b, above, all, contacts);
    selfCollide(a.mesh(), {adaptive_bvh::NeighbourFilter::SharedEdge}, all, own_contacts);
    return {distance.min_distance, to_box.min_distance, contacts.numContacts(),
            own_contacts.numContacts()};
  };

  AdaptiveModel a, b;
  fillModel(sheet, a);
  fillModel(hose, b);
  a.mesh();
  b.mesh();
  std::vector<std::vector<fcl::Vector3d>> positions;
  std::vector<Frame> expected;
  {
    AdaptiveModel alone(a);
    Deformation bend(sheet, Deformation::Kind::Smooth, 1);
    for (int frame = 0; frame < kFrames; ++frame) {
      positions.push_back(bend.next());
      alone.update(positions.back());
      expected.push_back(ask(alone, b, nullptr));
    }
    a.update(positions[0]);
  }

  std::shared_mutex mutex;
  int now = 0;
  std::atomic<int> asked{0}, wrong{0};
  std::atomic<bool> done{false};
  std::vector<std::thread> threads;
  for (int reader = 0; reader < kReaders; ++reader)
    threads.emplace_back([&, reader] {
      std::optional<adaptive_bvh::CoherentDistance> pair;
      {
        const std::shared_lock<std::shared_mutex> lock(mutex);
        const AdaptiveModel &first = a, &second = b;
        pair.emplace(first.mesh(), second.mesh());
      }
      while (!done) {
        {
          const std::shared_lock<std::shared_mutex> lock(mutex);
          const Frame found = ask(a, b, reader % 2 ? &*pair : nullptr);
          const Frame& right = expected[std::size_t(now)];
          wrong += std::abs(found.distance - right.distance) > 1e-9 ||
                   std::abs(found.to_box - right.to_box) > 1e-6 ||
                   found.contacts != right.contacts || found.own_contacts != right.own_contacts;
          ++asked;
        }
        std::this_thread::sleep_for(std::chrono::microseconds(200));  // lets the writer in
      }
    });
  std::vector<std::thread> writers;
  for (int writer = 0; writer < kWriters; ++writer)
    writers.emplace_back([&] {
      for (;;) {
        int before;
        {
          const std::unique_lock<std::shared_mutex> lock(mutex);
          if (now + 1 == kFrames) return;
          const auto frame = std::size_t(++now);
          before = asked;
          if (frame % 3) {
            a.update(positions[frame]);
          } else {
            std::vector<unsigned> every;
            for (unsigned v = 0; v < unsigned(a.num_vertices); ++v) every.push_back(v);
            a.update(every, positions[frame]);
          }
        }
        while (asked < before + kReaders) std::this_thread::yield();
      }
    });
  for (std::thread& thread : writers) thread.join();
  done = true;
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(0, wrong);
  EXPECT_GE(asked, kFrames);  // one of two writers may write while the other is blocked by readers
}

/// Updates on several threads leave the bits of updates on one.
TEST(UpdateThreads, GiveTheSameBits) {
  const TriangleMesh mesh = plate(160, 160);  // 51,200 triangles: above the limit
  AdaptiveModel one, three;
  fillModel(mesh, one);
  fillModel(mesh, three);
  three.setThreads(3);
  for (AdaptiveModel* model : {&one, &three}) model->mesh();
  EXPECT_THROW(three.setThreads(0), std::invalid_argument);
  Deformation bend(mesh, Deformation::Kind::Smooth, 6);
  int refitted = 0;
  for (int frame = 0; frame < 6; ++frame) {
    const auto& positions = bend.next();
    if (frame == 4) {  // the frame before is kept
      for (AdaptiveModel* model : {&one, &three}) {
        model->beginUpdateModel();
        model->updateSubModel(positions);
        ASSERT_EQ(fcl::BVH_OK, model->endUpdateModel());
      }
    } else {
      one.update(positions);
      three.update(positions);
    }
    refitted += three.lastUpdate().refitted();
    EXPECT_EQ(one.lastUpdate().refitted(), three.lastUpdate().refitted());
    EXPECT_EQ(one.lastUpdate().refitted_primitives, three.lastUpdate().refitted_primitives);
    EXPECT_EQ(one.lastUpdate().moved, three.lastUpdate().moved);
    EXPECT_EQ(one.lastUpdate().inflated, three.lastUpdate().inflated);
    EXPECT_EQ(one.lastUpdate().largest_displacement, three.lastUpdate().largest_displacement);
    EXPECT_EQ(one.aabb_radius, three.aabb_radius);
    EXPECT_EQ(one.aabb_local.min_, three.aabb_local.min_);
    EXPECT_EQ(one.aabb_local.max_, three.aabb_local.max_);
    EXPECT_EQ(one.mesh().aabb_radius, three.mesh().aabb_radius);
    EXPECT_EQ(one.mesh().vertices(), three.mesh().vertices());
    int different = 0;
    for (int i = 0; i < one.getNumBVs(); ++i) {
      const TestVolume<double>&a = one.getBV(i).bv, &b = three.getBV(i).bv;
      different += std::memcmp(&a, &b, sizeof(a)) != 0;  // without padding: obbrss_test
    }
    EXPECT_EQ(0, different);
  }
  EXPECT_GT(refitted, 0);
  std::string reason;
  EXPECT_TRUE(three.validate(&reason)) << reason;
}

}  // namespace shared_objects_test
}  // namespace adaptive_bvh_test
