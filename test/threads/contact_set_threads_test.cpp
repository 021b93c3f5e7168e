// ContactSets on several threads: each thread updates its own, of the same meshes and the same
// scene; and one set whose updates run on several threads. Run under ThreadSanitizer by CI.
#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <thread>

#include "adaptive_bvh/contact_set.h"
#include "support/random_geometry.h"
#include "support/test_mesh.h"

namespace adaptive_bvh_test {
namespace contact_set_threads_test {

using adaptive_bvh::ContactElements;
using adaptive_bvh::ContactSet;
using adaptive_bvh::ContactSetRequest;
using adaptive_bvh::DeformableMesh;
using adaptive_bvh::FeatureKind;
using adaptive_bvh::NumberedPairs;
using adaptive_bvh::Scene;

/// All that a set holds, by number.
struct Held {
  std::vector<adaptive_bvh::FeaturePair> pairs[4];
  std::vector<unsigned> added[4], removed[4];

  explicit Held(const ContactSet& set) {
    const NumberedPairs* const lists[] = {&set.triangles(), &set.features(FeatureKind::VertexFace),
                                          &set.features(FeatureKind::FaceVertex),
                                          &set.features(FeatureKind::EdgeEdge)};
    for (int i = 0; i < 4; ++i) {
      pairs[i] = lists[i]->pairs;
      added[i] = lists[i]->added;
      removed[i] = lists[i]->removed;
    }
  }
  bool operator==(const Held& other) const {
    for (int i = 0; i < 4; ++i)
      if (pairs[i] != other.pairs[i] || added[i] != other.added[i] ||
          removed[i] != other.removed[i])
        return false;
    return true;
  }
};

class ContactSetThreads : public testing::Test {
 protected:
  static constexpr int kThreads = 4, kSteps = 6;
  using Mesh = DeformableMesh;

  TriangleMesh crumpled(int columns, int rows) {
    TriangleMesh mesh = plate(columns, rows);
    for (fcl::Vector3d& p : mesh.vertices) p += random_.point() * 0.015;
    return mesh;
  }
  static ContactSetRequest request(ContactElements elements) {
    ContactSetRequest request;
    request.distance = 0.02;
    request.elements = elements;
    return request;
  }
  /// A little, or a lot.
  void move(Mesh& mesh, int step) {
    const double by = step % 4 == 3 ? 0.03 : 0.0005;
    moveVertices(mesh, [&](auto& p) { p += random_.point() * by; });
  }
  /// Runs act(i) on a thread for each i.
  template <typename Act>
  static void onThreads(const Act& act) {
    std::vector<std::thread> threads;
    for (int i = 0; i < kThreads; ++i) threads.emplace_back([&act, i] { act(i); });
    for (std::thread& thread : threads) thread.join();
  }
  /// Updates the first set alone, then all others at once: they hold the same.
  void expectSame(std::vector<std::unique_ptr<ContactSet>>& sets) {
    sets[0]->update();
    const Held expected(*sets[0]);
    std::atomic<int> different{0};
    onThreads([&](int i) {
      sets[std::size_t(i) + 1]->update();
      different += !(Held(*sets[std::size_t(i) + 1]) == expected);
    });
    EXPECT_EQ(0, different);
  }

  RandomGeometry random_{5505};
};

TEST_F(ContactSetThreads, HaveSetsOfTheSameMeshes) {
  DeformableMesh first(this->crumpled(18, 18)), second(this->crumpled(15, 15));
  for (const ContactElements elements : {ContactElements::Triangles, ContactElements::Features})
    for (const bool is_self : {true, false}) {
      std::vector<std::unique_ptr<ContactSet>> sets;
      for (int i = 0; i <= this->kThreads; ++i)
        sets.push_back(is_self
                           ? std::make_unique<ContactSet>(first, this->request(elements))
                           : std::make_unique<ContactSet>(first, second, this->request(elements)));
      for (int step = 0; step < this->kSteps; ++step) {
        this->move(first, step);
        first.setThreads(1 + step % 3);
        this->expectSame(sets);
      }
      EXPECT_GT(sets[0]->size(), 200u);
    }
}

TEST_F(ContactSetThreads, HaveSetsOfTheSameScene) {
  Scene scene;
  std::vector<std::shared_ptr<DeformableMesh>> meshes;
  for (int i = 0; i < 5; ++i) {
    meshes.push_back(std::make_shared<DeformableMesh>(this->crumpled(12, 12)));
    fcl::Transform3d tf = fcl::Transform3d::Identity();
    tf.translation() = this->random_.point() * 0.1;
    adaptive_bvh::BodyOptions options;
    options.self_collision = i % 2 == 0;
    scene.add(meshes.back(), tf, options);
  }
  std::vector<std::unique_ptr<ContactSet>> sets;
  for (int i = 0; i <= this->kThreads; ++i)
    sets.push_back(std::make_unique<ContactSet>(scene, this->request(ContactElements::Triangles)));
  for (int step = 0; step < this->kSteps; ++step) {
    this->move(*meshes[std::size_t(step % 5)], step);
    scene.setThreads(1 + step % 3);
    scene.update();
    this->expectSame(sets);
  }
  EXPECT_GT(sets[0]->size(), 1000u);
}

/// Numbers do not depend on the number of threads of an update.
TEST_F(ContactSetThreads, DoNotChangeNumbers) {
  DeformableMesh mesh(this->crumpled(32, 32));
  for (const ContactElements elements : {ContactElements::Triangles, ContactElements::Features}) {
    ContactSet alone(mesh, this->request(elements)), on_many(mesh, this->request(elements));
    for (int step = 0; step < this->kSteps; ++step) {
      this->move(mesh, step);
      mesh.setThreads(1);
      alone.update();
      mesh.setThreads(2 + step);
      on_many.update();
      EXPECT_TRUE(Held(alone) == Held(on_many)) << step;
    }
    EXPECT_GT(alone.size(), 5000u);
  }
}

}  // namespace contact_set_threads_test
}  // namespace adaptive_bvh_test
