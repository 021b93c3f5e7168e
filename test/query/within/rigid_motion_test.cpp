// RigidMotion: sums over many steps of all sizes, in which no step is lost.
#include "query/within/rigid_motion.h"

#include <gtest/gtest.h>

#include "adaptive_bvh/deformable_mesh.h"
#include "query/placed_mesh.h"
#include "support/exact_geometry.h"
#include "support/long_mode.h"
#include "support/meshes.h"
#include "support/random_geometry.h"

namespace adaptive_bvh_test {
namespace rigid_motion_test {

using adaptive_bvh::DeformableMesh;
using adaptive_bvh::RigidMotion;
using exact::Real;
namespace rounding = adaptive_bvh::rounding;

class RigidMotions : public testing::Test {
 protected:
  using P = fcl::Vector3d;
  using Pose = fcl::Transform3d;
  static TriangleMesh hose() {
    TriangleMesh mesh = tube(3, 2);
    for (auto& p : mesh.vertices) p += P(3, -1, 2);
    return mesh;
  }

  adaptive_bvh::PlacedMesh first(const Pose& tf) { return {first_, tf}; }
  adaptive_bvh::PlacedMesh second(const Pose& tf) { return {second_, tf}; }
  /// The second's vertices seen from the first, exactly, and as a query computes it.
  std::vector<exact::Point> seen(const Pose& tf1, const Pose& tf2, bool as_computed) const {
    const fcl::Transform3d computed = tf1.inverse(Eigen::Isometry) * tf2;
    std::vector<exact::Point> points;
    for (const P& vertex : hose_.vertices) {
      const exact::Point p = exact::of(vertex);
      const exact::Placement in_first = exact::placement(computed);
      const exact::Point world = exact::of(tf2.linear()) * p +
                                 (exact::of(tf2.translation()) - exact::of(tf1.translation()));
      points.push_back(as_computed ? in_first(p)
                                   : exact::Point(exact::of(tf1.linear()).transpose() * world));
    }
    return points;
  }

  /// A shift, a turn or both, of one of the two, of any size.
  void move(Pose& tf) {
    const double size = random_.size(-12, 3);
    if (!random_.oneIn(3)) tf.translation() = random_.vectorOfSize(size);
    if (random_.oneIn(3)) tf.translation() += random_.vectorOfSize(size);
    if (random_.oneIn(2)) {
      const Eigen::AngleAxis<double> turn(std::min(random_.size(-12, 1), 3.), random_.direction());
      tf.linear() = fcl::Quaternion<double>(fcl::Matrix3d(turn.toRotationMatrix() * tf.linear()))
                        .normalized()
                        .toRotationMatrix();
    }
  }

  const TriangleMesh hose_ = hose();
  DeformableMesh first_{plate(1, 1)}, second_{hose_};
  RandomGeometry random_{17};
};

/// The sum is never less than the way of any vertex of the second model, seen from the first, over
/// moves of either of 1e-12 to 1e3, turns included; both exactly and as a query rounds it.
TEST_F(RigidMotions, AreNeverLessThanAnyVertexsWay) {
  RigidMotion motion;
  fcl::Transform3d tf1 = fcl::Transform3d::Identity(), tf2 = tf1;
  motion.moveTo(this->first(tf1), this->second(tf2));
  std::vector<exact::Point> last[2];
  std::vector<Real> way[2];
  for (const bool computed : {false, true}) {
    last[computed] = this->seen(tf1, tf2, computed);
    way[computed].assign(last[computed].size(), Real(motion.sum()));
  }
  int restarts = 0;
  const int steps = manySteps(100000);
  for (int step = 0; step < steps; ++step) {
    this->move(step % 5 < 2 ? tf1 : tf2);
    const bool goes_on = motion.moveTo(this->first(tf1), this->second(tf2));
    restarts += !goes_on;
    for (const bool computed : {false, true}) {
      const auto now = this->seen(tf1, tf2, computed);
      for (std::size_t v = 0; v < now.size(); ++v) {
        way[computed][v] += (now[v] - last[computed][v]).norm();
        if (!goes_on) way[computed][v] = 0;
        ASSERT_LE(way[computed][v], Real(motion.sum())) << step << (computed ? " computed" : "");
      }
      last[computed] = now;
    }
  }
  EXPECT_GT(restarts, 0) << "the sum begins anew on the way";
  EXPECT_LT(restarts, steps / 1000);
}

/// One step among steps of the same size, and no larger: so none is taken for free by the others.
TEST_F(RigidMotions, EachStepIsBoundedByItself) {
  for (int round = 0; round < 20000; ++round) {
    fcl::Transform3d tf1 = this->random_.pose(this->random_.size(-6, 3)), tf2 = tf1;
    tf2.linear() = this->random_.rotation();
    RigidMotion motion;
    motion.moveTo(this->first(tf1), this->second(tf2));
    const double before = motion.sum();
    std::vector<exact::Point> was[2];
    for (const bool computed : {false, true}) was[computed] = this->seen(tf1, tf2, computed);
    this->move(tf1);
    if (!motion.moveTo(this->first(tf1), this->second(tf2))) continue;
    Real farthest = 0;
    for (const bool computed : {false, true}) {
      const auto now = this->seen(tf1, tf2, computed);
      for (std::size_t v = 0; v < now.size(); ++v)
        farthest = std::max(farthest, (now[v] - was[computed][v]).norm());
    }
    const Real step = Real(motion.sum()) - Real(before);
    ASSERT_GE(step, farthest * (1 - 1e-15L)) << round;
    const Real size =
        exact::of(tf1.translation()).norm() + exact::of(tf2.translation()).norm() + 10;
    ASSERT_LE(step, 10 * farthest + Real(before) * 1e-14L +
                        1000 * Real(rounding::epsilon<double>()) * (size + Real(before)))
        << "no larger than it must be";
  }
}

/// Where nothing moves the sum stays, bit by bit; the least move shows in it, however large it is.
TEST_F(RigidMotions, GrowWithEveryMoveAndOnlyThen) {
  RigidMotion motion;
  fcl::Transform3d tf1 = fcl::Transform3d::Identity(), tf2 = tf1;
  for (const double away : {1e5, 0.}) {  // and back: a large sum to begin with
    tf2.translation()[0] = away;
    EXPECT_TRUE(motion.moveTo(this->first(tf1), this->second(tf2)));
  }
  for (int step = 0; step < 20000; ++step) {
    const double before = motion.sum();
    EXPECT_TRUE(motion.moveTo(this->first(tf1), this->second(tf2)));
    ASSERT_EQ(before, motion.sum());
    double& moved = (step % 2 ? tf1 : tf2).translation()[step % 3];
    moved = std::nextafter(moved, 1.);
    EXPECT_TRUE(motion.moveTo(this->first(tf1), this->second(tf2)));
    ASSERT_GT(motion.sum(), before);
  }
  tf1.translation()[0] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(motion.moveTo(this->first(tf1), this->second(tf2))) << "no number";
  EXPECT_EQ(0, motion.sum());
}

}  // namespace rigid_motion_test
}  // namespace adaptive_bvh_test
