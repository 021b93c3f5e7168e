// ContactSet when memory fails: every allocation of an update once. And a steady step allocates
// nothing.
#include <gtest/gtest.h>

#include <algorithm>
#include <new>

#include "adaptive_bvh/contact_set.h"
#include "support/closed_bodies.h"
#include "support/failing.h"
#include "support/meshes.h"
#include "support/random_geometry.h"

namespace adaptive_bvh_test {
namespace contact_set_memory_test {

using adaptive_bvh::ContactElements;
using adaptive_bvh::ContactSet;
using adaptive_bvh::DeformableMesh;
using adaptive_bvh::FeatureKind;
using adaptive_bvh::FeaturePair;
using adaptive_bvh::NumberedPairs;
using Request = adaptive_bvh::ContactSetRequest;

/// All that can be seen of a set.
struct Seen {
  explicit Seen(const ContactSet& set) {
    for (const NumberedPairs* list :
         {&set.triangles(), &set.features(FeatureKind::VertexFace),
          &set.features(FeatureKind::FaceVertex), &set.features(FeatureKind::EdgeEdge)}) {
      lists.push_back(list->pairs);
      lists.push_back(list->removed_pairs);
      numbers.push_back(list->added);
      numbers.push_back(list->removed);
      numbers.push_back({unsigned(list->count)});
    }
  }
  friend bool operator==(const Seen& a, const Seen& b) {
    return a.lists == b.lists && a.numbers == b.numbers;
  }
  /// The pairs without their numbers.
  std::vector<std::vector<FeaturePair>> pairs() const {
    std::vector<std::vector<FeaturePair>> all;
    for (std::size_t i = 0; i < lists.size(); i += 2) {
      all.emplace_back();
      for (const FeaturePair& pair : lists[i])
        if (pair.first != NumberedPairs::kNone) all.back().push_back(pair);
      std::sort(all.back().begin(), all.back().end());
    }
    return all;
  }

  std::vector<std::vector<FeaturePair>> lists;
  std::vector<std::vector<unsigned>> numbers;
};

class ContactSetMemory : public testing::TestWithParam<ContactElements> {
 protected:
  std::vector<fcl::Vector3d> moved(std::vector<fcl::Vector3d> points, double by) {
    for (auto& p : points) p += random_.point() * by;
    return points;
  }
  Request request() const {
    Request request;
    request.distance = 0.25;
    request.elements = GetParam();
    return request;
  }
  /// Lets each allocation of `update` fail, of sets of `make`.
  template <typename Make>
  static void failEach(const Make& make, bool allocates = false) {
    int failures = 0;
    std::vector<std::vector<FeaturePair>> after;
    for (long n = 0;; ++n) {
      ContactSet set = make();
      const Seen before(set);
      bool was_reached = false, succeeds = true;
      onNewThread([&] {
        if (n > 0) {
          const FailingAllocation failing(n);
          try {
            set.update();
          } catch (const std::bad_alloc&) {
            succeeds = false;
          }
          was_reached = FailingAllocation::wasReached();
        }
        if (!succeeds) {
          ++failures;
          EXPECT_TRUE(before == Seen(set)) << "allocation " << n;
        }
        set.update();
      });
      if (n == 0) after = Seen(set).pairs();
      ASSERT_EQ(after, Seen(set).pairs()) << "allocation " << n;
      if ((n > 0 && !was_reached) || HasFailure()) break;
    }
    EXPECT_GE(failures, int(allocates));
  }

  RandomGeometry random_{77};
};
INSTANTIATE_TEST_SUITE_P(Both, ContactSetMemory,
                         testing::Values(ContactElements::Triangles, ContactElements::Features));

TEST_P(ContactSetMemory, AFailedUpdateLeavesTheSet) {
  DeformableMesh mesh(gridBall(7, 5)), other(mesh);
  other.update(moved(other.vertices(), 0.3));
  failEach([&] { return ContactSet(mesh, other, request()); }, true);
  const auto start = mesh.vertices();
  for (const double by : {0.004, 0.05, 0.5}) {
    const auto then = moved(start, by);
    const auto started = [&](auto... meshes) {
      mesh.update(start);
      ContactSet set(*meshes..., request());
      set.update();
      mesh.update(then);
      return set;
    };
    failEach([&] { return started(&mesh); });
    failEach([&] { return started(&mesh, &other); });
  }
  const DeformableMesh before = mesh;
  failEach([&] {
    mesh = before;
    ContactSet set(mesh, request());
    set.update();
    mesh = DeformableMesh(gridBall(6, 5));
    return set;
  });
}

TEST_P(ContactSetMemory, AFailedUpdateOfASceneLeavesTheSet) {
  adaptive_bvh::Scene scene;
  std::vector<DeformableMesh> meshes(4, DeformableMesh(gridBall(6, 4)));
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    fcl::Transform3d tf = fcl::Transform3d::Identity();
    tf.translation() = 0.8 * random_.point();
    scene.add(meshes[i], tf);
  }
  const auto start = meshes[1].vertices(), then = moved(start, 0.05);
  scene.update();
  failEach([&] { return ContactSet(scene, request()); }, true);
  failEach([&] {
    scene.setTransform(0, fcl::Transform3d::Identity());
    meshes[1].update(start);
    scene.update();
    ContactSet set(scene, request());
    set.update();
    meshes[1].update(then);
    fcl::Transform3d away = fcl::Transform3d::Identity();
    away.translation() = fcl::Vector3d(9, 9, 9);
    scene.setTransform(0, away);
    scene.update();
    return set;
  });
}

TEST_P(ContactSetMemory, ASteadyStepAllocatesNothing) {
  DeformableMesh mesh(plate(14, 14)), ball(gridBall(12, 10));
  adaptive_bvh::Scene scene;
  scene.add(mesh);
  scene.add(ball);
  Request request = this->request();
  ContactSet self(mesh, request), both(mesh, ball, request), of_scene(scene, request);
  const auto start = mesh.vertices();
  for (const double by : {0.002, 0.1})
    for (int step = 0; step < 120; ++step) {
      auto now = start;
      for (auto& p : now) p[2] += by * std::sin(0.5 * step + 5 * p[0]);
      mesh.update(now);
      scene.update();
      const long before = allocationCount();
      self.update();
      both.update();
      of_scene.update();
      if (step >= 100) {
        ASSERT_EQ(before, allocationCount()) << by << ", step " << step;
      }
    }
  EXPECT_GT(self.size() * both.size() * of_scene.size(), 0u);
}

}  // namespace contact_set_memory_test
}  // namespace adaptive_bvh_test
