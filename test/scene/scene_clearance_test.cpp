// Least distances of a scene's bodies over a step against those of all pairs.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/halfspace.h>
#include <fcl/geometry/shape/sphere.h>

#include "adaptive_bvh/scene.h"
#include "support/meshes.h"
#include "support/random_geometry.h"

namespace adaptive_bvh_test {
namespace scene_clearance_test {

using adaptive_bvh::BodyId;
using adaptive_bvh::DeformableMesh;
using adaptive_bvh::FramePath;
using adaptive_bvh::intervalsBelow;
using adaptive_bvh::leastDistance;
using adaptive_bvh::Motion;
using adaptive_bvh::MotionClearance;
using adaptive_bvh::MotionInterval;
using adaptive_bvh::Scene;
using adaptive_bvh::SceneClearance;
using adaptive_bvh::SceneIntervals;
using P = fcl::Vector3d;
using Pose = fcl::Transform3d;

/// A hose that bends, and parts around it, some of which move.
class Bay {
 public:
  explicit Bay(unsigned seed) : random_(seed) {
    const TriangleMesh hose = tube(8, 30);
    hose_ = std::make_unique<DeformableMesh>(hose.vertices, hose.triangles);
    scene.add(*hose_);
    from.push_back(Pose::Identity());
    const TriangleMesh part = dome(8, 4);
    part_ = std::make_unique<DeformableMesh>(part.vertices, part.triangles);
    for (int i = 0; i < 12; ++i) {
      from.push_back(random_.pose(2));
      if (i % 4 == 3)
        scene.add(i % 8 == 3 ? static_cast<fcl::CollisionGeometryd&>(box_) : ball_, from.back());
      else
        scene.add(*part_, from.back());
    }
    from.push_back(Pose::Identity());
    scene.add(floor_, from.back());
    scene.beginStep();
    to = from;
    for (std::size_t i = 1; i + 1 < to.size(); i += 3) {
      to[i] = random_.pose(2);
      scene.setTransform(BodyId(i), to[i]);
    }
    std::vector<P> end = hose.vertices;
    for (P& x : end) x += P(0, 0.3 * std::sin(3 * x[0]), 0.2 * x[0] * x[0]);
    hose_->updateTwoFrames(end);
    scene.update();
  }

  Motion motionOf(BodyId body, FramePath path) const {
    if (body == 0) return Motion(*hose_, from[0], to[0], path);
    return Motion::rigid(scene.geometry(body), from[body], to[body], path);
  }

  Scene scene;
  std::vector<Pose> from, to;

 private:
  RandomGeometry random_;
  std::unique_ptr<DeformableMesh> hose_, part_;
  fcl::Boxd box_{0.5, 0.2, 0.3};
  fcl::Sphered ball_{0.3};
  fcl::Halfspaced floor_{P::UnitZ(), -2.5};
};

TEST(SceneClearance, IsThatOfAllPairs) {
  const double tolerance = 1e-4;
  for (unsigned seed = 0; seed < 4; ++seed)
    for (const FramePath path : {FramePath::Straight, FramePath::Screw}) {
      const Bay bay(seed);
      for (const BodyId body : {BodyId(0), BodyId(1), BodyId(4), BodyId(13)}) {
        std::vector<double> uppers;
        for (const BodyId other : bay.scene.bodies())
          if (other != body)
            uppers.push_back(
                leastDistance(bay.motionOf(body, path), bay.motionOf(other, path), tolerance)
                    .upper);
        std::sort(uppers.begin(), uppers.end());
        const SceneClearance best = bay.scene.leastDistance(body, tolerance, path);
        EXPECT_EQ(best.bodies.first, body);
        EXPECT_LE(best.clearance.lower, uppers[0]);
        EXPECT_NEAR(best.clearance.upper, uppers[0], tolerance);
        std::vector<SceneClearance> nearest;
        bay.scene.leastDistances(body, 5, tolerance, path, nearest);
        ASSERT_EQ(nearest.size(), 5u);
        for (std::size_t k = 0; k < 5; ++k) {
          EXPECT_NEAR(nearest[k].clearance.upper, uppers[k], 2 * tolerance);
          const MotionClearance again = leastDistance(
              bay.motionOf(body, path), bay.motionOf(nearest[k].bodies.second, path), tolerance);
          EXPECT_NEAR(nearest[k].clearance.upper, again.upper, tolerance);
          if (!again.meet()) {
            EXPECT_FALSE(nearest[k].clearance.meet());
          }
        }
      }
    }
}

TEST(SceneClearance, FindsAllPairsBelow) {
  const double clearance = 0.2, tolerance = 1e-3;
  for (const FramePath path : {FramePath::Straight, FramePath::Screw}) {
    const Bay bay(7);
    SceneIntervals found;
    bay.scene.intervalsBelow(clearance, tolerance, path, found);
    std::size_t next = 0;
    for (const BodyId a : bay.scene.bodies())
      for (const BodyId b : bay.scene.bodies()) {
        if (b <= a) continue;
        std::vector<MotionInterval> intervals;
        intervalsBelow(bay.motionOf(a, path), bay.motionOf(b, path), clearance, tolerance,
                       intervals);
        if (intervals.empty()) continue;
        ASSERT_LT(next, found.pairs.size());
        EXPECT_EQ(found.pairs[next].first, a);
        EXPECT_EQ(found.pairs[next].second, b);
        ASSERT_EQ(found.begins[next + 1] - found.begins[next], intervals.size());
        for (std::size_t k = 0; k < intervals.size(); ++k)
          EXPECT_EQ(found.found[found.begins[next] + k].begin, intervals[k].begin);
        ++next;
      }
    EXPECT_EQ(next, found.pairs.size());
    EXPECT_GT(next, 0u);
  }
}

/// A scene remembers the pair; one that cannot keep it finds the same distance.
TEST(SceneClearance, StartsFromThePairThatWasKept) {
  const double tolerance = 1e-4;
  for (unsigned seed = 0; seed < 6; ++seed) {
    Bay bay(seed);
    const Scene& fixed = bay.scene;
    for (const BodyId body : {BodyId(0), BodyId(1), BodyId(2), BodyId(4)}) {
      const SceneClearance first = fixed.leastDistance(body, tolerance);
      if (body == 0) bay.scene.nearest(body);  // keeps the pair at the end
      for (int call = 0; call < 3; ++call) {
        const SceneClearance again = bay.scene.leastDistance(body, tolerance);
        EXPECT_NEAR(again.clearance.upper, first.clearance.upper, tolerance);
        EXPECT_LE(again.clearance.lower, first.clearance.upper);
        EXPECT_LE(again.clearance.upper - again.clearance.lower, tolerance * (1 + 1e-12));
        EXPECT_EQ(again.clearance.meet(), first.clearance.meet());
        if (again.clearance.meet()) {
          EXPECT_NEAR(again.clearance.time, first.clearance.time, 1e-6);
        }
        if (call == 2 && first.clearance.elements[1] >= 0 && !first.clearance.meet()) {
          EXPECT_LE(again.clearance.box_tests, first.clearance.box_tests);
        }
      }
      for (const double bad : {0., 1e-15, -1., std::nan(""), HUGE_VAL})
        EXPECT_THROW(bay.scene.leastDistance(body, bad), std::invalid_argument);
    }
  }
}

TEST(SceneClearance, LeavesOutWhatThePairsLeaveOut) {
  Bay bay(1);
  const SceneClearance before = bay.scene.leastDistance(0, 1e-4);
  bay.scene.ignore(0, before.bodies.second);
  EXPECT_NE(bay.scene.leastDistance(0, 1e-4).bodies.second, before.bodies.second);
  bay.scene.setFilter([](BodyId, BodyId) { return false; });
  EXPECT_FALSE(bay.scene.leastDistance(0, 1e-4).exists());
  std::vector<SceneClearance> none;
  bay.scene.leastDistances(0, 3, 1e-4, none);
  EXPECT_TRUE(none.empty());
  EXPECT_THROW(bay.scene.leastDistance(99, 1e-4), std::invalid_argument);
  bay.scene.setFilter({});
  EXPECT_THROW(bay.scene.leastDistance(0, 0), std::invalid_argument);
  bay.scene.setTransform(1, Pose::Identity());
  EXPECT_THROW(bay.scene.leastDistance(0, 1e-4), std::logic_error);
}

}  // namespace scene_clearance_test
}  // namespace adaptive_bvh_test
