// Scenes of bodies of size 0 and of sizes up to 1e12 times as large as others: distances of all
// pairs in quadruple precision.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "adaptive_bvh/scene.h"
#include "support/long_mode.h"
#include "support/quad_geometry.h"
#include "support/random_geometry.h"

namespace adaptive_bvh_test {
namespace mixed_sizes_test {

using adaptive_bvh::BodyId;
using adaptive_bvh::DeformableMesh;
using adaptive_bvh::Scene;
using adaptive_bvh::SceneClearance;
using adaptive_bvh::SceneDistance;
using Points = std::vector<fcl::Vector3d>;

class MixedSizes : public testing::Test {
 protected:
  void clear() {
    scene_ = Scene();
    meshes_.clear();
    triangles_.clear();
    ids_.clear();
  }
  /// Adds triangles of three corners each, moved to `at`.
  void add(const Points& corners, const fcl::Vector3d& at) {
    std::vector<fcl::Triangle> triangles;
    triangles_.emplace_back();
    for (std::size_t c = 0; c + 2 < corners.size(); c += 3) {
      triangles.emplace_back(c, c + 1, c + 2);
      triangles_.back().emplace_back();
      for (std::size_t k = 0; k < 3; ++k)
        triangles_.back().back()[k] = quad::of(corners[c + k]) + quad::of(at);
    }
    meshes_.push_back(std::make_unique<DeformableMesh>(corners, triangles));
    fcl::Transform3d tf = fcl::Transform3d::Identity();
    tf.translation() = at;
    ids_.push_back(scene_.add(*meshes_.back(), tf));
  }
  /// A point, a segment, a triangle, or several, on a lattice or not.
  Points body(double size) {
    const bool is_lattice = random_.oneIn(2);
    const auto vector = [&]() -> fcl::Vector3d {
      if (!is_lattice) return random_.point() * size;
      return size * fcl::Vector3d(random_.below(5) - 2, random_.below(5) - 2, random_.below(5) - 2);
    };
    const fcl::Vector3d u = vector(), zero = fcl::Vector3d::Zero();
    Points corners;
    switch (random_.below(4)) {
      case 0: return {zero, zero, zero};
      case 1: return {zero, u, 2 * u};
      case 2: return {zero, u, vector()};
      default:
        for (int i = 0; i < 6; ++i) {
          const fcl::Vector3d at = 3 * vector();
          corners.insert(corners.end(), {at, at + 1e-3 * vector(), at + vector()});
        }
        return corners;
    }
  }
  void addRandom(double ratio) {
    const auto size = [&] { return random_.oneIn(2) ? 1 : ratio; };
    const Points corners = body(size());
    add(corners, 5 * size() * random_.point());
  }

  double distanceOf(std::size_t a, std::size_t b) const {
    quad::Real least = std::numeric_limits<double>::infinity();
    for (const quad::Triangle& p : triangles_[a])
      for (const quad::Triangle& q : triangles_[b]) least = std::min(least, quad::distance(p, q));
    return static_cast<double>(least);
  }
  /// The largest coordinate of two bodies.
  double extentOf(std::size_t a, std::size_t b) const {
    quad::Real extent = 0;
    for (const std::size_t body : {a, b})
      for (const quad::Triangle& t : triangles_[body])
        for (const quad::Point& p : t) extent = std::max(extent, quad::size(p));
    return static_cast<double>(extent);
  }
  /// What the judge finds of two bodies.
  struct Judged {
    double distance, extent;

    /// By docs/bounds.md, section 5: C is up to 6 extents, L up to 3.5.
    double error() const { return 128 * std::numeric_limits<double>::epsilon() * extent; }
  };
  /// Of a body and each other one; of itself, nothing.
  std::vector<Judged> judge(std::size_t a) const {
    std::vector<Judged> judged;
    for (std::size_t b = 0; b < ids_.size(); ++b)
      judged.push_back(b == a ? Judged{std::numeric_limits<double>::infinity(), 0}
                              : Judged{distanceOf(a, b), extentOf(a, b)});
    return judged;
  }
  static Judged nearestOf(const std::vector<Judged>& judged) {
    return *std::min_element(judged.begin(), judged.end(), [](const Judged& a, const Judged& b) {
      return a.distance < b.distance;
    });
  }
  static double extentOf(const std::vector<Judged>& judged) {
    double extent = 0;
    for (const Judged& pair : judged) extent = std::max(extent, pair.extent);
    return extent;
  }
  std::size_t indexOf(BodyId body) const {
    return std::size_t(std::find(ids_.begin(), ids_.end(), body) - ids_.begin());
  }
  void expectNear(const Judged& judged, double distance) const {
    EXPECT_NEAR(judged.distance, distance, judged.error());
  }
  /// All questions about distances from a body.
  void expectDistances(std::size_t a, const std::vector<Judged>& judged) {
    const SceneDistance nearest = std::as_const(scene_).nearest(ids_[a]);
    ASSERT_TRUE(nearest.exists());
    expectNear(judged[indexOf(nearest.bodies.second)], nearest.distance);
    for (const Judged& other : judged) EXPECT_LE(nearest.distance, other.distance + other.error());
    std::vector<SceneDistance> found;
    scene_.nearest(ids_[a], ids_.size(), found);
    ASSERT_EQ(ids_.size() - 1, found.size());
    for (const SceneDistance& pair : found)
      expectNear(judged[indexOf(pair.bodies.second)], pair.distance);
    expectLeastDistance(a, judged);
  }
  /// Bodies meet where they are nearer than 1e-10 of their coordinates: of the sum of three.
  void expectLeastDistance(std::size_t a, const std::vector<Judged>& judged) {
    const double extent = extentOf(judged);
    const SceneClearance least = scene_.leastDistance(ids_[a], 1e-9 * extent);
    const Judged& found = judged[indexOf(least.bodies.second)];
    if (least.clearance.meet()) {
      EXPECT_LE(found.distance, 3e-10 * found.extent);
      return;
    }
    EXPECT_GE(least.clearance.upper, found.distance - found.error());
    for (const Judged& other : judged)
      EXPECT_LE(least.clearance.lower, other.distance + other.error());
  }
  /// All questions about distances.
  void expectDistances() {
    scene_.update();
    std::vector<Judged> all;
    for (std::size_t a = 0; a < ids_.size(); ++a) {
      const std::vector<Judged> judged = judge(a);
      expectDistances(a, judged);
      all.insert(all.end(), judged.begin(), judged.end());
    }
    const Judged least = {nearestOf(all).distance, extentOf(all)};
    expectNear(least, scene_.distance().distance);
    EXPECT_TRUE(scene_.isNearer(least.distance + 2 * least.error()));
    if (least.distance > 2 * least.error()) {
      EXPECT_FALSE(scene_.isNearer(least.distance - 2 * least.error()));
    }
  }

  RandomGeometry random_{67};
  Scene scene_;
  std::vector<std::unique_ptr<DeformableMesh>> meshes_;
  std::vector<std::vector<quad::Triangle>> triangles_;
  std::vector<BodyId> ids_;
};

/// A body of size 0 far from its neighbour, in its own unit.
TEST_F(MixedSizes, OfAPointAndATriangle) {
  const fcl::Vector3d zero = fcl::Vector3d::Zero();
  for (double size = 1; size < 1e12; size *= 8) {
    clear();
    add({zero, zero, zero}, {0, 0, 5 * size});
    add({zero, {size, 0, 0}, {0, size, 0}}, zero);
    expectDistances();
    EXPECT_EQ(5 * size, std::as_const(scene_).nearest(ids_[0]).distance);
  }
}

TEST_F(MixedSizes, OfAnyBodies) {
  for (int step = 0; step < manySteps(100); ++step) {
    SCOPED_TRACE(step);
    clear();
    const double ratio = random_.size(0, 12);
    for (int bodies = 2 + random_.below(4); bodies > 0; --bodies) addRandom(ratio);
    expectDistances();
  }
}

}  // namespace mixed_sizes_test
}  // namespace adaptive_bvh_test
