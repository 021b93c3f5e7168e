// What is kept from step to step, against tests of all pairs in long double: whatever sequence of
// updates, repeated indices, snapshots, assignments and moves a pair of meshes goes through.
#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/coherent_distance.h"
#include "adaptive_bvh/proximity.h"
#include "base/rounding.h"
#include "support/exact_geometry.h"
#include "support/fcl_float.h"
#include "support/long_mode.h"
#include "support/random_geometry.h"
#include "support/test_mesh.h"

namespace adaptive_bvh_test {
namespace mesh_history_test {

using adaptive_bvh::CoherentDistance;
using adaptive_bvh::CoherentProximity;
using adaptive_bvh::DeformableMesh;
using exact::Real;

class MeshHistory : public testing::Test {
 protected:
  using Mesh = DeformableMesh;
  using Point = fcl::Vector3d;
  using Points = std::vector<Point>;

  static fcl::Transform3d identity() { return fcl::Transform3d::Identity(); }

  static Mesh triangleAt(double z) {
    return Mesh(Points{Point(0, 0, z), Point(1, 0, z), Point(0, 1, z)}, {{0, 1, 2}});
  }
  static exact::Triangle triangleOf(const Mesh& mesh, const fcl::Triangle& t) {
    return {exact::of(mesh.vertices()[t[0]]), exact::of(mesh.vertices()[t[1]]),
            exact::of(mesh.vertices()[t[2]])};
  }
  static Real distanceOf(const Mesh& a, const Mesh& b) {
    Real least = std::numeric_limits<Real>::max();
    for (const fcl::Triangle& s : a.triangles())
      for (const fcl::Triangle& t : b.triangles())
        least = std::min(least, exact::distance(triangleOf(a, s), triangleOf(b, t)));
    return least;
  }
  /// The farthest that any vertex has come.
  static Real motion(const Points& from, const Points& to) {
    Real most = 0;
    for (std::size_t v = 0; v < from.size(); ++v)
      most = std::max(most, (exact::of(to[v]) - exact::of(from[v])).norm());
    return most;
  }

  /// Positions for random indices, most of them more than once, which lead back and forth or far
  /// away by small steps.
  void someSteps(const Points& from, double step, std::vector<unsigned>& indices, Points& to) {
    indices.clear();
    to.clear();
    const int vertices = 1 + random_.below(3);
    unsigned names[3];
    for (unsigned& name : names) name = unsigned(random_.below(int(from.size())));
    Points now = from;
    const bool leads_away = random_.oneIn(2);
    const Point away = random_.point() * step;
    for (int i = random_.below(12); i >= 0; --i) {
      const unsigned v = names[random_.below(vertices)];
      const Point next = now[v] + (leads_away ? away : Point(random_.point() * step));
      now[v] = leads_away || !random_.oneIn(4) ? next : from[v];
      indices.push_back(v);
      to.push_back(now[v]);
    }
  }

  RandomGeometry random_{20265};
};

/// A vertex that is named four times comes near step by step: the kept bound has to see all of it.
TEST_F(MeshHistory, CountsAllStepsOfARepeatedIndex) {
  using Point = fcl::Vector3d;
  const auto identity = this->identity();
  const auto lower = this->triangleAt(0);
  auto upper = this->triangleAt(3);
  CoherentProximity pair(lower, upper);
  EXPECT_FALSE(pair.isNearer(identity, identity, 0.5));
  upper.update(std::vector<int>{0, 0, 0, 0},
               {Point(0, 0, 2.275), Point(0, 0, 1.55), Point(0, 0, 0.825), Point(0, 0, 0.1)});
  EXPECT_GE(upper.lastUpdate().largest_displacement, 2.9 - 1e-6);
  EXPECT_LE(upper.lastUpdate().largest_displacement, 2.9 + 1e-5);
  EXPECT_TRUE(pair.isNearer(identity, identity, 0.5));
  EXPECT_FALSE(pair.isNearer(identity, identity, 0.05));
}

/// There and back in one call is no motion; and what lies between leaves no trace in the box.
TEST_F(MeshHistory, TakesTheLastPositionOfARepeatedIndexOnly) {
  using Point = fcl::Vector3d;
  auto mesh = this->triangleAt(0);
  const fcl::AABBd box = mesh.aabb_local;
  mesh.update(std::vector<int>{1, 1}, {Point(7, 8, 9), Point(1, 0, 0)});
  EXPECT_EQ(0, mesh.lastUpdate().largest_displacement);
  EXPECT_EQ(box.min_, mesh.aabb_local.min_);
  EXPECT_EQ(box.max_, mesh.aabb_local.max_);
  mesh.update(std::vector<int>{1, 2, 1}, {Point(-7, 8, 9), Point(0, 2, 0), Point(2, 0, 0)});
  EXPECT_EQ(Point(0, 0, 0), mesh.aabb_local.min_);
  EXPECT_EQ(Point(2, 2, 0), mesh.aabb_local.max_);
  EXPECT_EQ(Point(2, 0, 0), mesh.vertices()[1]);
  EXPECT_TRUE(mesh.validate());
}

/// The reported motion is that from before a call to after it, of a mesh and of a model with one.
TEST_F(MeshHistory, ReportsTheMotionOfEachWholeCall) {
  using Model = adaptive_bvh::AdaptiveBVHModel<fcl::RSSd>;
  DeformableMesh mesh(plate(3, 3));
  Model model;
  fillModel(plate(3, 3), model);
  model.mesh();
  std::vector<unsigned> indices;
  std::vector<fcl::Vector3d> to;
  for (int i = 0; i < manySteps(1000); ++i) {
    const auto before = mesh.vertices();
    this->someSteps(before, this->random_.size(-6, 1), indices, to);
    mesh.update(indices, to);
    model.update(indices, to);
    auto expected = before;
    for (std::size_t k = 0; k < indices.size(); ++k) expected[indices[k]] = to[k];
    ASSERT_EQ(expected, mesh.vertices());
    const Real motion = this->motion(before, mesh.vertices());
    for (const double reported :
         {mesh.lastUpdate().largest_displacement, model.lastUpdate().largest_displacement,
          model.mesh().lastUpdate().largest_displacement}) {
      EXPECT_GE(Real(reported), motion);
      EXPECT_LE(Real(reported), motion * (1 + 32 * Real(std::numeric_limits<double>::epsilon())) +
                                    4 * Real(adaptive_bvh::rounding::tiny<double>()));
    }
    std::string reason;
    ASSERT_TRUE(mesh.validate(&reason) && model.validate(&reason)) << reason;
  }
}

/// Two meshes through every kind of change; between any two questions there may be several.
TEST_F(MeshHistory, KeepsNoAnswerTooLong) {
  using Mesh = Mesh;
  auto& random = this->random_;
  const auto identity = this->identity();
  long kept = 0, asked = 0;
  for (int body = 0; body < manySteps(40); ++body) {
    Mesh a(plate(2, 2)), b(plate(1, 2));
    moveVertices(b, [](fcl::Vector3d& p) { p[2] += 1; });
    CoherentProximity proximity(a, b);
    CoherentDistance distance(a, b);
    std::vector<Mesh> snapshots{a, b};
    std::vector<unsigned> indices;
    std::vector<fcl::Vector3d> to;
    const auto change = [&](Mesh& mesh) {
      const double step = random.size(-3, -0.5);
      auto all = mesh.vertices();
      for (auto& p : all) p += random.point() * step;
      switch (random.below(9)) {
        case 0: mesh.update(all); break;
        case 1: mesh.updateTwoFrames(all); break;
        case 2:
        case 3:
          this->someSteps(mesh.vertices(), step, indices, to);
          mesh.update(indices, to);
          break;
        case 4:
          mesh.update(std::vector<fcl::Vector3d>(
              mesh.previousVertices().empty() ? mesh.vertices() : mesh.previousVertices()));
          break;
        case 5: snapshots[&mesh == &b] = mesh; break;
        case 6: mesh = snapshots[&mesh == &b]; break;
        case 7: {  // both go on, and one takes the place of the other
          Mesh other(mesh);
          if (random.oneIn(2)) other.update(all);
          std::swap(other, mesh);
          if (random.oneIn(2)) mesh.update(all);
          if (random.oneIn(2)) snapshots[&mesh == &b] = std::move(other);
          break;
        }
        default:
          all[0][1] = std::numeric_limits<double>::infinity();
          EXPECT_THROW(mesh.update(all), std::invalid_argument);
      }
    };
    for (int i = 0; i < 60; ++i) {
      for (int k = random.below(3); k >= 0; --k) change(random.oneIn(2) ? a : b);
      const Real exactly = this->distanceOf(a, b), rounding = 1e-13L;
      const double limit = double(exactly) * random.uniform(0.6, 1.2);
      const std::size_t before = proximity.searches();
      const bool answer = proximity.isNearer(identity, identity, limit);
      if (std::abs(exactly - limit) > rounding) {
        ASSERT_EQ(exactly <= limit, answer) << double(exactly) << " " << limit;
      }
      fcl::DistanceResultd result;
      distance.distance(identity, identity, fcl::DistanceRequestd(), result);
      EXPECT_NEAR(double(exactly), double(result.min_distance),
                  8 * double(std::numeric_limits<double>::epsilon()) * (1 + double(exactly)));
      kept += before == proximity.searches();
      ++asked;
    }
  }
  EXPECT_GT(kept, asked / 10) << "or nothing was kept that could be wrong";
}

/// One mesh becomes an older snapshot of itself while the other moves on, farther than that.
TEST_F(MeshHistory, SeesAnOlderSnapshotBesideAMotion) {
  const auto identity = this->identity();
  auto lower = this->triangleAt(0), upper = this->triangleAt(3);
  moveVertices(lower, [](auto& p) { p[2] += 1; });
  const auto high = lower;  // at 1, with the way of 1
  moveVertices(lower, [](auto& p) { p[2] -= 1; });
  CoherentProximity pair(lower, upper);
  EXPECT_FALSE(pair.isNearer(identity, identity, 0.75));  // a bound of more than 1.5
  lower = high;
  moveVertices(upper, [](auto& p) { p[2] -= 1.25; });
  EXPECT_TRUE(pair.isNearer(identity, identity, 0.8));
}

}  // namespace mesh_history_test
}  // namespace adaptive_bvh_test
