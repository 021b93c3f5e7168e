// Long runs on one model: it stays sound, its memory stays what it was, and queries cost at the end
// what they cost on a model that was built anew.
#include <gtest/gtest.h>
#include <malloc.h>

#include <fcl/narrowphase/detail/traversal/collision_node.h>
#include <fcl/narrowphase/detail/traversal/distance/mesh_distance_traversal_node.h>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/coherent_distance.h"
#include "adaptive_bvh/query.h"
#include "support/brute_force.h"
#include "support/long_mode.h"

namespace adaptive_bvh_test {
namespace soak_test {

using adaptive_bvh::AdaptiveBVHModeld;
using Plain = fcl::BVHModel<fcl::RSSd>;
using Points = std::vector<fcl::Vector3<double>>;

const int kFrames = isLongMode() ? 200000 : 40000;

/// Vibration: every vertex swings by some per cent of the size.
Points vibration(const Points& rest, int frame) {
  Points now = rest;
  for (fcl::Vector3<double>& p : now) {
    const double phase = 3 * p[0] - 2 * p[1] + 5 * p[2];
    p += 0.02 * std::sin(0.7 * frame + phase) * fcl::Vector3<double>(0.3, 0.5, 0.8);
  }
  return now;
}

/// Tumbling: turned as a whole, never the same way, and carried about.
Points tumbling(const Points& rest, int frame) {
  const Eigen::AngleAxisd turn(
      0.05 * frame,
      fcl::Vector3<double>(std::sin(1e-3 * frame), 1, std::cos(3e-4 * frame)).normalized());
  const fcl::Vector3<double> away =
      fcl::Vector3<double>(std::sin(0.01 * frame), std::cos(0.013 * frame), 0);
  Points now = rest;
  for (fcl::Vector3<double>& p : now) p = turn * p + away;
  return now;
}

/// Tests of two volumes and of two triangles that FCL's own query of the pair takes.
long costOfFclsQuery(const Plain& a, const Plain& b, const fcl::Transform3d& tf) {
  fcl::DistanceResultd result;
  fcl::detail::MeshDistanceTraversalNodeRSSd node;
  node.enable_statistics = true;
  fcl::detail::initialize(node, a, fcl::Transform3d(fcl::Transform3d::Identity()), b, tf,
                          fcl::DistanceRequestd(), result);
  fcl::detail::distance(&node);
  return node.num_bv_tests + node.num_leaf_tests;
}

long costOfOurQuery(const AdaptiveBVHModeld& a, const AdaptiveBVHModeld& b,
                    const fcl::Transform3d& tf) {
  const long before = a.recordedWork().bv_tests + a.recordedWork().leaf_tests;
  fcl::DistanceResultd result;
  adaptive_bvh::distance(&a, fcl::Transform3d::Identity(), &b, tf, fcl::DistanceRequestd(), result);
  return a.recordedWork().bv_tests + a.recordedWork().leaf_tests - before;
}

struct Case {
  const char* name;
  Points (*motion)(const Points& rest, int frame);
  bool ask;  ///< queries run along; else there is none until the end

  friend void PrintTo(const Case& tested, std::ostream* out) { *out << tested.name; }
};

class Soak : public testing::TestWithParam<Case> {};

TEST_P(Soak, LeavesNoTrace) {
  TriangleMesh mesh = dome(9, 5);
  const Points rest = mesh.vertices;
  AdaptiveBVHModeld model, obstacle;
  fillModel(mesh, model);
  fillModel(tube(5, 6), obstacle);
  fcl::Transform3d tf = fcl::Transform3d::Identity();
  tf.translation() = fcl::Vector3<double>(1.4, 0.8, 0.6);
  adaptive_bvh::CoherentDistance pair(model.mesh(), obstacle.mesh());

  std::size_t tracking = 0, heap = 0;
  for (int frame = 1; frame <= kFrames; ++frame) {
    mesh.vertices = GetParam().motion(rest, frame);
    model.update(mesh.vertices);
    if (GetParam().ask) {
      fcl::DistanceResultd recorded, result;
      adaptive_bvh::distance(&model, fcl::Transform3d::Identity(), &obstacle, tf,
                             fcl::DistanceRequestd(), recorded);
      pair.distance(fcl::Transform3d::Identity(), tf, fcl::DistanceRequestd(), result);
      if (frame % 1000 == 0) {
        const BruteForce all(model, fcl::Transform3d::Identity(), obstacle, tf);
        ASSERT_NEAR(all.distance(), result.min_distance, 1e-12);
        ASSERT_NEAR(all.distance(), recorded.min_distance, 1e-12);
      }
    }
    if (frame % 1000 == 0) {
      std::string reason;
      ASSERT_TRUE(model.validate(&reason)) << "frame " << frame << ": " << reason;
    }
    if (frame == kFrames / 10) {
      tracking = model.trackingBytes();
      heap = mallinfo2().uordblks;
    }
  }
  EXPECT_EQ(tracking, model.trackingBytes());
#if !defined(__SANITIZE_ADDRESS__)
  EXPECT_LE(mallinfo2().uordblks, heap + 65536);
#endif

  // Queries from all around, of volumes that nothing kept tight.
  AdaptiveBVHModeld fresh;
  fillModel(mesh, fresh);
  std::mt19937 random(3);
  double fcls = 0, fcls_fresh = 0;
  for (int i = 0; i < 200; ++i) {
    const fcl::Transform3d pose = randomPose(random, 2.5);
    fcls += double(costOfFclsQuery(model, obstacle, pose));
    fcls_fresh += double(costOfFclsQuery(fresh, obstacle, pose));
  }

  // The query that went along, for some frames more.
  double own = 0, own_fresh = 0;
  for (int frame = kFrames + 1; frame <= kFrames + 200; ++frame) {
    mesh.vertices = GetParam().motion(rest, frame);
    model.update(mesh.vertices);
    AdaptiveBVHModeld built;
    fillModel(mesh, built);
    const long cost = costOfOurQuery(model, obstacle, tf);
    if (frame <= kFrames + 10) continue;  // there may have been no query before
    own += double(cost);
    own_fresh += double(costOfOurQuery(built, obstacle, tf));
  }
  std::printf("tests of the pair's query against a fresh model's: %.3f; from all around: %.3f\n",
              own / own_fresh, fcls / fcls_fresh);
  EXPECT_LE(own, 1.3 * own_fresh);
  EXPECT_LE(fcls, (GetParam().ask ? 8 : 1.2) * fcls_fresh);
}

INSTANTIATE_TEST_SUITE_P(ManyFrames, Soak,
                         testing::Values(Case{"VibrationAsked", vibration, true},
                                         Case{"Vibration", vibration, false},
                                         Case{"TumblingAsked", tumbling, true},
                                         Case{"Tumbling", tumbling, false}),
                         [](const auto& info) { return std::string(info.param.name); });

}  // namespace soak_test
}  // namespace adaptive_bvh_test
