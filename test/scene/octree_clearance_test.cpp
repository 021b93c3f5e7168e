// Octrees over a step of a scene: least distances, intervals and first impacts against all cells as
// boxes, whose distances a judge computes in quadruple precision.
#include <gtest/gtest.h>

#include <fcl/config.h>
#if FCL_HAVE_OCTOMAP
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <tuple>
#include <vector>

#include <fcl/geometry/octree/octree.h>
#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/halfspace.h>
#include <fcl/geometry/shape/plane.h>
#include <fcl/geometry/shape/sphere.h>

#include "adaptive_bvh/scene.h"
#include "support/long_mode.h"
#include "support/quad_motion.h"
#include "support/random_geometry.h"

namespace adaptive_bvh_test {
namespace octree_clearance_test {

using adaptive_bvh::BodyId;
using adaptive_bvh::DeformableMesh;
using adaptive_bvh::FramePath;
using adaptive_bvh::MotionInterval;
using adaptive_bvh::Scene;
using adaptive_bvh::SceneClearance;
using adaptive_bvh::SceneImpact;
using adaptive_bvh::SceneIntervals;
using quad::Real;
using P = fcl::Vector3d;
using Pose = fcl::Transform3d;

const Pose kIdentity = Pose::Identity();

/// A body of the scene, and its parts for the judge: triangles on which all points of its surface
/// lie, or are `radius` away.
struct Judged {
  std::shared_ptr<const fcl::CollisionGeometryd> geometry;
  std::vector<int> numbers = {};  ///< of the part of each triangle
  std::vector<P> start = {}, end = {};
  std::vector<fcl::Triangle> triangles = {};
  double radius = 0;
  Pose from = kIdentity, to = kIdentity;

  void addBox(const P& middle, const P& half, int number) {
    const std::size_t first = start.size();
    for (int i = 0; i < 8; ++i)
      start.push_back(middle +
                      P(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1).cwiseProduct(half));
    for (const auto& [a, b, c, d] : {std::array<int, 4>{0, 1, 3, 2},
                                     {4, 5, 7, 6},
                                     {0, 1, 5, 4},
                                     {2, 3, 7, 6},
                                     {0, 2, 6, 4},
                                     {1, 3, 7, 5}}) {
      const auto corner = [&](int i) { return first + static_cast<std::size_t>(i); };
      triangles.emplace_back(corner(a), corner(b), corner(c));
      triangles.emplace_back(corner(a), corner(c), corner(d));
      numbers.insert(numbers.end(), 2, number);
    }
    end = start;
  }
};

class Bodies : public RandomGeometry {
 public:
  explicit Bodies(unsigned seed) : RandomGeometry(seed) {}

  Judged octree(int cells) {
    auto tree = std::make_shared<octomap::OcTree>(0.25);
    for (int k = 0; k < cells; ++k) {
      const P x = 0.6 * point();
      tree->updateNode(octomap::point3d(float(x[0]), float(x[1]), float(x[2])), true);
    }
    Judged body{std::make_shared<fcl::OcTreed>(tree)};
    for (auto leaf = tree->begin_leafs(); leaf != tree->end_leafs(); ++leaf)
      body.addBox(P(double(leaf.getX()), double(leaf.getY()), double(leaf.getZ())),
                  P::Constant(double(leaf.getSize()) / 2), int(&*leaf - tree->getRoot()));
    return body;
  }
  /// `kind`: a mesh, a box, a ball, an octree.
  Judged body(int kind) {
    if (kind == 3) return octree(2);
    if (kind == 2) {
      Judged ball{std::make_shared<fcl::Sphered>(0.2)};
      ball.start = ball.end = {P::Zero()};
      ball.triangles = {fcl::Triangle(0, 0, 0)};
      ball.radius = 0.2;
      ball.numbers = {-1};
      return ball;
    }
    if (kind == 1) {
      Judged box{std::make_shared<fcl::Boxd>(0.2, 0.4, 0.6)};
      box.addBox(P::Zero(), P(0.1, 0.2, 0.3), -1);
      return box;
    }
    Judged cloth{nullptr};
    for (int i = 0; i < 6; ++i) cloth.start.push_back(0.5 * point());
    for (const P& x : cloth.start) cloth.end.push_back(x + 0.3 * point());
    cloth.triangles = {fcl::Triangle(0, 1, 2), fcl::Triangle(3, 4, 5)};
    cloth.numbers = {0, 1};
    auto mesh = std::make_shared<DeformableMesh>(cloth.start, cloth.triangles);
    mesh->updateTwoFrames(cloth.end);
    cloth.geometry = mesh;
    return cloth;
  }
  /// Poses around a place; not half a turn, where rounding decides the direction.
  void place(const P& start, const P& end, Judged& body) {
    do {
      body.from = pose(0.4), body.to = pose(0.4);
    } while (Eigen::AngleAxisd(body.to.linear() * body.from.linear().transpose()).angle() > 3);
    if (body.radius > 0) body.to.linear() = body.from.linear();  // a ball that turns shrinks
    body.from.translation() += start;
    body.to.translation() += end;
  }
};

/// The triangles of two bodies at a time, and their distances.
class Judge {
 public:
  Judge(const Judged& a, const Judged& b, FramePath path)
      : bodies_{&a, &b}, radii_(a.radius + b.radius) {
    for (const Judged* body : bodies_)
      moving_.push_back({body->start, body->end, body->triangles,
                         quad::FramePair(body->from, body->to, path == FramePath::Screw)});
  }

  /// Of parts with these numbers; of all parts without.
  Real distance(Real t, const std::array<int, 2>* numbers = nullptr) const {
    std::vector<Placed> placed[2];
    for (std::size_t i = 0; i < 2; ++i) {
      std::vector<quad::Point> x;
      for (std::size_t v = 0; v < moving_[i].start.size(); ++v)
        x.push_back(moving_[i].vertex(v, t));
      for (std::size_t k = 0; k < moving_[i].triangles.size(); ++k) {
        const fcl::Triangle& corners = moving_[i].triangles[k];
        if (!numbers || bodies_[i]->numbers[k] == (*numbers)[i])
          placed[i].emplace_back(quad::Triangle{x[corners[0]], x[corners[1]], x[corners[2]]});
      }
    }
    std::vector<std::tuple<double, const Placed*, const Placed*>> pairs;  // by a lower bound
    for (const Placed& x : placed[0])
      for (const Placed& y : placed[1])
        pairs.emplace_back((x.middle - y.middle).norm() - x.radius - y.radius, &x, &y);
    std::sort(pairs.begin(), pairs.end());
    Real exact = 1e9;
    for (const auto& [bound, x, y] : pairs) {
      if (bound > double(exact) + 1e-9) break;
      exact = std::min(exact, quad::distance(x->triangle, y->triangle));
    }
    return exact < radii_ ? 0 : exact - radii_;
  }
  /// The largest distance by which a vertex moves in a unit of time.
  Real speed() const {
    Real sum = 0;
    for (const quad::MovingTriangles& body : moving_) {
      Real most = 0;
      for (std::size_t v = 0; v < body.start.size(); ++v)
        for (int i = 0; i < 16; ++i) {
          const quad::Point step = body.vertex(v, Real(i + 1) / 16) - body.vertex(v, Real(i) / 16);
          most = std::max(most, quad::dot(step, step));
        }
      sum += quad::root(most) * 16 * Real(1.05);
    }
    return sum;
  }

 private:
  struct Placed {
    explicit Placed(const quad::Triangle& placed) : triangle(placed) {
      P corners[3];
      for (std::size_t k = 0; k < 3; ++k)
        corners[k] = P(double(placed[k].x), double(placed[k].y), double(placed[k].z));
      middle = (corners[0] + corners[1] + corners[2]) / 3;
      for (const P& x : corners) radius = std::max(radius, (x - middle).norm());
    }
    quad::Triangle triangle;
    P middle;
    double radius = 0;
  };

  const std::array<const Judged*, 2> bodies_;
  std::vector<quad::MovingTriangles> moving_;
  const Real radii_;
};

/// Two bodies in a scene, in either order.
class Pair {
 public:
  Pair(const Judged& a, const Judged& b) {
    for (const Judged* body : {&a, &b}) scene.add(body->geometry, body->from);
    scene.beginStep();
    scene.setTransform(0, a.to);
    scene.setTransform(1, b.to);
    scene.update();
  }
  Scene scene;
};

void judgeLeast(const SceneClearance& least, const Judge& judge, double tolerance) {
  const auto& found = least.clearance;
  ASSERT_TRUE(least.exists());
  EXPECT_LE(found.upper - found.lower, tolerance * (1 + 1e-12));
  const double there = double(judge.distance(found.time, &found.elements));
  if (found.meet()) {
    EXPECT_LE(there, 1e-7);
    for (int i = 0; i < 16; ++i)
      EXPECT_GT(double(judge.distance(Real(found.time) * i / 16)), 0) << "an earlier impact";
    return;
  }
  const quad::Least exact = quad::leastOf([&](Real t) { return judge.distance(t); }, judge.speed(),
                                          Real(tolerance / 4), 60);
  EXPECT_LE(found.lower, double(exact.upper) + 1e-10);
  EXPECT_GE(found.upper, double(exact.lower) - 1e-10);
  EXPECT_NEAR(there, found.upper, 1e-9);
  EXPECT_NEAR((found.points[0] - found.points[1]).norm(), found.upper, 1e-9);
}

void judgeIntervals(const std::vector<MotionInterval>& found, const Judge& judge, double distance,
                    double tolerance) {
  for (std::size_t i = 0; i < found.size(); ++i) {
    EXPECT_LE(found[i].begin, found[i].end);
    if (i > 0) {
      EXPECT_LT(found[i - 1].end, found[i].begin);
    }
  }
  for (int k = 0; k <= 20; ++k) {
    const double t = k / 20.;
    const bool is_inside = std::any_of(found.begin(), found.end(), [&](const MotionInterval& i) {
      return i.begin <= t && t <= i.end;
    });
    const double there = double(judge.distance(t));
    if (is_inside) {
      EXPECT_LE(there, distance + tolerance + 1e-9) << t;
    } else {
      EXPECT_GE(there, distance - 1e-9) << t;
    }
  }
}

/// Octrees against meshes that deform, boxes, balls and octrees.
TEST(OctreeClearance, IsThatOfAllCells) {
  int apart = 0, meeting = 0, impacts = 0;
  for (int i = 0; i < manySteps(16) && !testing::Test::HasFailure(); ++i) {
    SCOPED_TRACE(i);
    Bodies random(unsigned(i) + 1);
    Judged a = random.octree(3), b = random.body(i % 4);
    random.place(P::Zero(), P::Zero(), a);
    random.place(P(2.2, 1, 0), i % 8 < 4 ? P(2.2, -1, 0) : P(-2, -1, 0), b);
    if (i / 4 % 2) std::swap(a, b);
    for (const FramePath path : {FramePath::Straight, FramePath::Screw}) {
      Pair pair(a, b);
      const Judge judge(a, b, path);
      const double tolerance = 1e-3;
      const SceneClearance least = pair.scene.leastDistance(0, tolerance, path);
      const bool starts_inside = least.clearance.meet() && least.clearance.time == 0;
      if (starts_inside) continue;  // the judge compares surfaces
      judgeLeast(least, judge, tolerance);
      ++(least.clearance.meet() ? meeting : apart);
      const double clearance = least.clearance.upper + 0.1;
      SceneIntervals intervals;
      ASSERT_EQ(pair.scene.intervalsBelow(clearance, tolerance, path, intervals), 1u);
      judgeIntervals(intervals.found, judge, clearance, tolerance);
      EXPECT_EQ(pair.scene.intervalsBelow(least.clearance.lower / 2, tolerance, path, intervals),
                least.clearance.meet());
      if (path == FramePath::Screw) continue;
      const SceneImpact impact = pair.scene.earliestImpact();
      EXPECT_EQ(impact.exists(), least.clearance.meet());
      if (!impact.exists()) continue;
      ++impacts;
      EXPECT_NEAR(impact.impact.time, least.clearance.time, 1e-7);
      const std::array<int, 2> numbers = {int(impact.impact.pair.first),
                                          int(impact.impact.pair.second)};
      EXPECT_LE(double(judge.distance(impact.impact.time, &numbers)), 1e-7);
    }
  }
  EXPECT_GT(apart, 8);
  EXPECT_GT(meeting, 4);
  EXPECT_GT(impacts, 2);
}

/// Several bodies, some of which are octrees, by increasing distance; from each of them.
TEST(OctreeClearance, OrdersOctreesAmongOthers) {
  const double tolerance = 1e-4;
  for (unsigned seed = 0; seed < 6; ++seed)
    for (const FramePath path : {FramePath::Straight, FramePath::Screw}) {
      Bodies random(seed + 100);
      std::vector<Judged> bodies;
      for (int i = 0; i < 6; ++i) {
        bodies.push_back(i == 0 ? random.octree(40) : random.body(i % 4));
        const P place = 1.5 * random.point();
        random.place(place, place, bodies.back());
      }
      Scene scene;
      for (const Judged& body : bodies) scene.add(body.geometry, body.from);
      scene.beginStep();
      for (BodyId i = 0; i < bodies.size(); ++i) scene.setTransform(i, bodies[i].to);
      scene.update();
      for (const BodyId body : {BodyId(0), BodyId(3), BodyId(4)}) {
        std::vector<double> uppers;
        for (BodyId other = 0; other < bodies.size(); ++other)
          if (other != body)
            uppers.push_back(Pair(bodies[body], bodies[other])
                                 .scene.leastDistance(0, tolerance, path)
                                 .clearance.upper);
        std::sort(uppers.begin(), uppers.end());
        EXPECT_NEAR(scene.leastDistance(body, tolerance, path).clearance.upper, uppers[0],
                    tolerance);
        std::vector<SceneClearance> nearest;
        scene.leastDistances(body, 5, tolerance, path, nearest);
        ASSERT_EQ(nearest.size(), 5u);
        for (std::size_t k = 0; k < 5; ++k)
          EXPECT_NEAR(nearest[k].clearance.upper, uppers[k], 2 * tolerance);
      }
    }
}

/// A floor that sinks below an octree, and the empty octree, which is near nothing.
TEST(OctreeClearance, OverAFloorAndOfNoCells) {
  Bodies random(3);
  const Judged octree = random.octree(5);
  const auto floor = std::make_shared<fcl::Halfspaced>(P::UnitZ(), -1);
  double lowest = 1;
  for (const P& x : octree.start) lowest = std::min(lowest, x[2]);
  for (const FramePath path : {FramePath::Straight, FramePath::Screw}) {
    Scene scene;
    const BodyId cells = scene.add(octree.geometry), below = scene.add(floor),
                 none = scene.add(std::make_shared<fcl::OcTreed>(0.1));
    scene.beginStep();
    scene.setTransform(below, Pose(Eigen::Translation3d(0, 0, -2)));
    scene.update();
    const SceneClearance least = scene.leastDistance(cells, 1e-6, path);
    EXPECT_NEAR(least.clearance.upper, lowest + 1, 1e-6);
    EXPECT_EQ(least.bodies.second, below);
    EXPECT_NEAR(scene.leastDistance(below, 1e-6, path).clearance.upper, lowest + 1, 1e-6);
    EXPECT_FALSE(scene.leastDistance(none, 1e-6, path).exists());
    SceneIntervals found;
    EXPECT_EQ(scene.intervalsBelow(lowest + 2, 1e-6, path, found), 1u);
    ASSERT_EQ(found.found.size(), 1u);
    EXPECT_EQ(found.found[0].begin, 0);
    EXPECT_NEAR(found.found[0].end, 0.5, 1e-5);
    EXPECT_FALSE(scene.earliestImpact().exists());
  }
}

/// Two planes or half-spaces are no pair of a step, whatever they do.
TEST(OctreeClearance, PairsOfPlanesAreLeftOut) {
  Scene scene;
  const BodyId a = scene.add(std::make_shared<fcl::Planed>(P::UnitZ(), 0)),
               b = scene.add(std::make_shared<fcl::Halfspaced>(P::UnitZ(), -1));
  scene.beginStep();
  scene.setTransform(a, Pose(Eigen::AngleAxisd(0.5, P::UnitX())));
  scene.setTransform(b, Pose(Eigen::Translation3d(0, 0, 3)));
  scene.update();
  EXPECT_FALSE(scene.earliestImpact(0.1).exists());
  EXPECT_FALSE(scene.leastDistance(a, 1e-3).exists());
  std::vector<SceneClearance> several;
  scene.leastDistances(b, 3, 1e-3, several);
  EXPECT_TRUE(several.empty());
  SceneIntervals found;
  EXPECT_EQ(scene.intervalsBelow(1, 1e-3, found), 0u);
}

/// Options and ignored pairs hold for octrees; a tolerance is refused.
TEST(OctreeClearance, LeavesOutWhatThePairsLeaveOut) {
  Bodies random(4);
  const Judged octree = random.octree(4);
  const auto ball = std::make_shared<fcl::Sphered>(0.5);
  Scene scene;
  const BodyId a = scene.add(ball, Pose(Eigen::Translation3d(3, 0, 0))),
               cells = scene.add(octree.geometry),
               b = scene.add(ball, Pose(Eigen::Translation3d(9, 0, 0)));
  scene.update();
  EXPECT_EQ(scene.leastDistance(a, 1e-3).bodies.second, cells);
  SceneIntervals found;
  for (const double bad : {0., -1., std::nan(""), HUGE_VAL}) {
    EXPECT_THROW(scene.leastDistance(cells, bad), std::invalid_argument);
    EXPECT_THROW(scene.intervalsBelow(9, bad, found), std::invalid_argument);
  }
  scene.ignore(a, cells);
  EXPECT_EQ(scene.leastDistance(a, 1e-3).bodies.second, b);
  EXPECT_EQ(scene.leastDistance(cells, 1e-3).bodies.second, b);
}

}  // namespace octree_clearance_test
}  // namespace adaptive_bvh_test
#endif
