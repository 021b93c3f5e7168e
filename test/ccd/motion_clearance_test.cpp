// Least distances over motions against quadruple precision: sampling, and bisection by the largest
// speeds.
#include "adaptive_bvh/motion_clearance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <ctime>
#include <memory>

#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/halfspace.h>
#include <fcl/geometry/shape/plane.h>
#include <fcl/geometry/shape/sphere.h>

#include "ccd/moving_boxes.h"
#include "support/closed_bodies.h"
#include "support/meshes.h"
#include "support/quad_motion.h"
#include "support/random_geometry.h"

namespace adaptive_bvh_test {
namespace motion_clearance_test {

using adaptive_bvh::DeformableMesh;
using adaptive_bvh::FramePath;
using adaptive_bvh::intervalsBelow;
using adaptive_bvh::leastDistance;
using adaptive_bvh::Motion;
using adaptive_bvh::MotionClearance;
using adaptive_bvh::MotionInterval;
using P = fcl::Vector3d;
using Pose = fcl::Transform3d;
using quad::Real;

const Pose kIdentity = Pose::Identity();

/// A few triangles that move: at random, or on a lattice with parallel edges.
struct Body {
  quad::MovingTriangles exact;
  std::unique_ptr<DeformableMesh> mesh;
  Pose from, to;
  FramePath path;

  Motion motion() const { return {*mesh, exact.start, exact.end, from, to}; }
  Motion moving() const { return {*mesh, exact.start, exact.end, from, to, path}; }
  /// The largest displacement of a vertex in a part of a unit of time, times the number of parts.
  Real speed() const {
    const int parts = 16;
    Real most = 0;
    for (std::size_t v = 0; v < exact.start.size(); ++v)
      for (int i = 0; i < parts; ++i) {
        const quad::Point step =
            exact.vertex(v, Real(i + 1) / parts) - exact.vertex(v, Real(i) / parts);
        most = std::max(most, quad::dot(step, step));
      }
    return quad::root(most) * parts * Real(1.05);
  }
};

class Bodies : public RandomGeometry {
 public:
  explicit Bodies(unsigned seed) : RandomGeometry(seed) {}

  P position(bool on_lattice, double reach) {
    return on_lattice ? P(below(5) - 2, below(5) - 2, below(5) - 2) * (reach / 2)
                      : P(point() * reach);
  }
  Pose poseOf(bool on_lattice, double reach) {
    Pose tf = on_lattice ? kIdentity : pose(reach);
    if (on_lattice && oneIn(3))
      tf.linear() = Eigen::AngleAxisd(M_PI / 2 * below(4), P::Unit(below(3)))
                        .toRotationMatrix()
                        .array()
                        .round();
    tf.translation() = position(on_lattice, reach);
    return tf;
  }
  /// Whether rounding decides the direction of a screw.
  static bool isHalfTurn(const Pose& from, const Pose& to) {
    return Eigen::AngleAxisd(to.linear() * from.linear().transpose()).angle() > M_PI - 1e-6;
  }
  /// `kind`: 0 still, 1 translated, 2 rigid, 3 deforming.
  Body body(int triangles, bool on_lattice, int kind, FramePath path) {
    std::vector<P> start, end;
    std::vector<fcl::Triangle> faces;
    for (int i = 0; i < triangles; ++i) {
      faces.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
      const P corner = position(on_lattice, 0.5);
      for (const P& x : on_lattice ? std::array<P, 3>{corner, position(true, 1), position(true, 1)}
                                   : triangleAt(corner, 0.5))
        start.push_back(x);
    }
    for (const P& x : start) end.push_back(kind == 3 ? P(x + position(on_lattice, 0.5)) : x);
    const Pose from = poseOf(on_lattice, 1);
    Pose to = kind == 0 ? from : poseOf(on_lattice, 1);
    if (kind == 1 || isHalfTurn(from, to)) to.linear() = from.linear();
    auto mesh = std::make_unique<DeformableMesh>(start, faces);
    return {{start, end, faces, quad::FramePair(from, to, path == FramePath::Screw)},
            std::move(mesh),
            from,
            to,
            path};
  }
};

Real distanceAt(const Body& a, const Body& b, Real t) {
  Real least = -1;
  for (std::size_t i = 0; i < a.exact.triangles.size(); ++i)
    for (std::size_t j = 0; j < b.exact.triangles.size(); ++j) {
      const Real d = quad::distance(a.exact.triangle(i, t), b.exact.triangle(j, t));
      if (least < 0 || d < least) least = d;
    }
  return least;
}

/// Checks an answer against the judge, whose distances are `distance`.
void judge(const MotionClearance& found, const std::function<Real(Real)>& distance, Real speed,
           double tolerance, double rounding = 1e-12) {
  const double there = static_cast<double>(distance(found.time));
  const quad::Least exact = quad::leastOf(distance, speed, Real(tolerance / 8), 150);
  EXPECT_LE(found.lower, static_cast<double>(exact.upper) + rounding)
      << "at " << static_cast<double>(exact.time);
  EXPECT_GE(found.upper, static_cast<double>(exact.lower) - rounding);
  EXPECT_LE(found.upper - found.lower, tolerance * (1 + 1e-12) + 1e-15);  // both are rounded
  if (found.meet()) {
    EXPECT_LE(there, 1e-9);
    EXPECT_EQ(found.lower, 0);
    for (int i = 0; i < 16 && found.time > 0; ++i)  // before the impact they are apart
      EXPECT_GT(static_cast<double>(distance(Real(found.time) * i / 16)), 0);
  } else {
    EXPECT_LE(there, found.upper + rounding);  // another pair may be nearer, within the tolerance
    EXPECT_GE(there, found.lower - rounding);
    EXPECT_NEAR((found.points[0] - found.points[1]).norm(), found.upper, 1e-10);
    EXPECT_FALSE(exact.upper == 0 && exact.lower == 0 && found.lower > 0);
  }
}

TEST(MotionClearance, OfTrianglesIsThatOfTheJudge) {
  Bodies random(1);
  for (int i = 0; i < manySteps(100); ++i) {
    SCOPED_TRACE(i);
    const bool on_lattice = random.oneIn(2);
    const auto any = [&] { return random.oneIn(2) ? FramePath::Straight : FramePath::Screw; };
    const Body a = random.body(1 + random.below(2), on_lattice, random.below(4), any()),
               b = random.body(1 + random.below(2), on_lattice, random.below(4), any());
    const double tolerance = random.size(-4, -1);
    const MotionClearance found = leastDistance(a.moving(), b.moving(), tolerance);
    judge(
        found, [&](Real t) { return distanceAt(a, b, t); }, a.speed() + b.speed(), tolerance);
    if (HasFailure()) return;
  }
}

/// A limit changes the answer only where the bodies stay that far apart.
TEST(MotionClearance, WithinALimitIsTheSame) {
  Bodies random(5);
  for (int i = 0; i < manySteps(200); ++i) {
    SCOPED_TRACE(i);
    const bool on_lattice = random.oneIn(2);
    const Body a = random.body(2, on_lattice, random.below(4), FramePath::Straight),
               b = random.body(2, on_lattice, random.below(4), FramePath::Screw);
    const double tolerance = random.size(-4, -1);
    const MotionClearance all = leastDistance(a.moving(), b.moving(), tolerance);
    for (const double limit : {0.5 * all.upper, all.lower, all.upper, 2 * all.upper, 1e-3, 1e3}) {
      const MotionClearance found = leastDistance(a.moving(), b.moving(), tolerance, limit);
      EXPECT_GE(found.lower, std::min(limit, all.lower - tolerance));
      EXPECT_LE(std::min(found.lower, limit), all.upper);
      if (found.exists()) {
        EXPECT_LE(found.upper - found.lower, tolerance * (1 + 1e-12) + 1e-15);
        EXPECT_GE(found.upper, all.lower);
        EXPECT_LE(found.upper, (limit + tolerance) * (1 + 1e-12));
      } else {
        EXPECT_GE(found.lower, limit);
        EXPECT_GE(all.upper, limit);
      }
    }
    if (HasFailure()) return;
  }
}

TEST(MotionClearance, IntervalsHoldAllTimesBelow) {
  Bodies random(2);
  for (int i = 0; i < manySteps(60); ++i) {
    SCOPED_TRACE(i);
    const auto any = [&] { return random.oneIn(2) ? FramePath::Straight : FramePath::Screw; };
    const bool on_lattice = random.oneIn(2);
    const Body a = random.body(2, on_lattice, random.below(4), any()),
               b = random.body(2, on_lattice, random.below(4), any());
    const double clearance = random.oneIn(3) ? 0 : random.uniform(0, 1),
                 tolerance = random.size(-3, -1);
    std::vector<MotionInterval> intervals;
    intervalsBelow(a.moving(), b.moving(), clearance, tolerance, intervals);
    for (std::size_t k = 0; k < intervals.size(); ++k) {
      EXPECT_LT(intervals[k].begin, intervals[k].end);
      if (k > 0) {
        EXPECT_LT(intervals[k - 1].end, intervals[k].begin);
      }
    }
    for (int step = 0; step <= 100; ++step) {
      const double t = step / 100., d = static_cast<double>(distanceAt(a, b, Real(t)));
      const bool is_inside = std::any_of(
          intervals.begin(), intervals.end(),
          [&](const MotionInterval& interval) { return interval.begin <= t && t <= interval.end; });
      EXPECT_TRUE(is_inside || d >= clearance - 1e-12) << "at " << t << ": " << d;
      EXPECT_TRUE(!is_inside || d <= clearance + tolerance + 1e-12) << "at " << t << ": " << d;
    }
    if (HasFailure()) return;
  }
}

/// Finds intervals below 0 at growing precision, in a bounded time: the times of contact.
template <typename Bodies>
void expectContacts(const Bodies& first, const Bodies& second, double speed,
                    const std::vector<MotionInterval>& expected) {
  for (const double tolerance : {1e-2, 1e-4, 1e-6, 1e-9}) {
    SCOPED_TRACE(tolerance);
    std::vector<MotionInterval> found;
    const std::clock_t begin = std::clock();
    intervalsBelow(first, second, 0, tolerance, found);
    EXPECT_LT(double(std::clock() - begin) / CLOCKS_PER_SEC, 0.5);
    ASSERT_EQ(found.size(), expected.size());
    for (std::size_t i = 0; i < found.size(); ++i) {
      const double early = tolerance / speed + 1e-11;
      EXPECT_LE(found[i].begin, expected[i].begin + 1e-11);
      EXPECT_GE(found[i].begin, expected[i].begin - early);
      EXPECT_GE(found[i].end, expected[i].end - 1e-11);
      EXPECT_LE(found[i].end, expected[i].end + early);
    }
  }
}

/// A triangle that goes through the surface of a box, in at one side and out at the other.
TEST(MotionClearance, TimesOfContactAreFoundAtAnyPrecision) {
  const TriangleMesh box = latticeBox(1);
  const DeformableMesh mesh(box),
      flat({P(0, .3, .4), P(.25, .3, .5), P(.1, .35, .6)}, {fcl::Triangle(0, 1, 2)});
  Pose from = kIdentity, to = kIdentity;
  from.translation()[0] = -1, to.translation()[0] = 3;
  const Motion through = Motion::rigid(flat, from, to),
               still = Motion::rigid(mesh, kIdentity, kIdentity);
  expectContacts(through, still, 4, {{.75 / 4, .25}, {1.75 / 4, .5}});
  expectContacts(still, through, 4, {{.75 / 4, .25}, {1.75 / 4, .5}});
}

TEST(MotionClearance, TimesOfContactOfShapesAreFoundAtAnyPrecision) {
  const fcl::Sphered ball(.5), other(.25);
  const fcl::Planed plane(P::UnitZ(), 0);
  const fcl::Halfspaced ground(P::UnitZ(), 0);
  Pose from = kIdentity, to = kIdentity;
  from.translation()[2] = -2, to.translation()[2] = 2;
  const Motion up = Motion::rigid(ball, from, to),
               still = Motion::rigid(other, kIdentity, kIdentity),
               table = Motion::rigid(plane, kIdentity, kIdentity),
               earth = Motion::rigid(ground, kIdentity, kIdentity);
  expectContacts(up, still, 4, {{1.25 / 4, 2.75 / 4}});
  expectContacts(up, table, 4, {{1.5 / 4, 2.5 / 4}});
  expectContacts(up, earth, 4, {{0, 2.5 / 4}});
}

/// A blade that turns through a fixed triangle: both in contact while the angle is small.
TEST(MotionClearance, TimesOfContactOfTurningTrianglesTakeTheRootOfThePrecision) {
  const DeformableMesh blade({P(.5, 0, -1), P(2, 0, -1), P(1, 0, 2)}, {fcl::Triangle(0, 1, 2)}),
      fixed({P(.6, -.3, 0), P(1.4, -.3, .1), P(1, .4, 0)}, {fcl::Triangle(0, 1, 2)});
  const auto turned = [](double angle) { return Pose(Eigen::AngleAxisd(angle, P::UnitZ())); };
  const Motion turning = Motion::rigid(blade, turned(-1), turned(1), FramePath::Screw),
               still = Motion::rigid(fixed, kIdentity, kIdentity);
  // The triangle reaches from the angle of one corner to that of another; the blade is as large.
  const double begin = (1 - std::atan2(.3, .6)) / 2, end = (1 + std::atan2(.4, 1)) / 2;
  for (const double tolerance : {1e-3, 1e-5, 1e-6}) {
    std::vector<MotionInterval> found;
    const std::clock_t start = std::clock();
    intervalsBelow(turning, still, 0, tolerance, found);
    EXPECT_LT(double(std::clock() - start) / CLOCKS_PER_SEC, 0.5);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_NEAR(found[0].begin, begin, 2 * tolerance);
    EXPECT_NEAR(found[0].end, end, 2 * tolerance);
  }
}

// ---- Shapes

/// A shape as triangles in its frame, with a radius around them; filled if it has a volume.
struct Shape {
  std::unique_ptr<fcl::CollisionGeometryd> shape;
  Body core;
  double radius;
  bool is_box;
};

Shape shapeOf(Bodies& random, FramePath path, int kind) {
  std::vector<P> points;
  std::vector<fcl::Triangle> faces;
  std::unique_ptr<fcl::CollisionGeometryd> shape;
  const double radius = kind == 2 ? 0 : random.uniform(0.1, 0.5), half = random.uniform(0.1, 0.5);
  if (kind == 0) {
    shape = std::make_unique<fcl::Sphered>(radius);
    points = {P::Zero()};
    faces.emplace_back(0, 0, 0);
  } else if (kind == 1) {
    shape = std::make_unique<fcl::Capsuled>(radius, 2 * half);
    points = {P(0, 0, half), P(0, 0, -half)};
    faces.emplace_back(0, 1, 1);
  } else {
    shape = std::make_unique<fcl::Boxd>(2 * half, half, 2 * half);
    for (int i = 0; i < 8; ++i)
      points.emplace_back((i & 1 ? 1 : -1) * half, (i & 2 ? 1 : -1) * half / 2,
                          (i & 4 ? 1 : -1) * half);
    for (const auto& f : {std::array<int, 4>{0, 1, 3, 2},
                          {4, 5, 7, 6},
                          {0, 1, 5, 4},
                          {2, 3, 7, 6},
                          {0, 2, 6, 4},
                          {1, 3, 7, 5}}) {
      faces.emplace_back(f[0], f[1], f[2]);
      faces.emplace_back(f[0], f[2], f[3]);
    }
  }
  const Pose from = random.pose(1);
  Pose to = random.pose(1);
  if ((path == FramePath::Straight && kind != 2) || Bodies::isHalfTurn(from, to))
    to.linear() = from.linear();
  Body core{{points, points, faces, quad::FramePair(from, to, path == FramePath::Screw)},
            nullptr,
            from,
            to,
            path};
  return {std::move(shape), std::move(core), radius, kind == 2};
}

/// Whether a corner of a triangle is in the hull of the box's corners: on the inner side of all
/// faces.
bool isInside(const Body& box, const Body& mesh, Real t) {
  quad::Point middle = {0, 0, 0};
  for (std::size_t v = 0; v < 8; ++v) middle = middle + Real(0.125) * box.exact.vertex(v, t);
  const quad::Point corner = mesh.exact.vertex(0, t);
  for (std::size_t f = 0; f < 12; f += 2) {
    const quad::Triangle face = box.exact.triangle(f, t);
    const quad::Point n = quad::cross(face[1] - face[0], face[2] - face[0]);
    const Real inner = quad::dot(n, middle - face[0]), side = quad::dot(n, corner - face[0]);
    if (inner * side < 0 || quad::absolute(inner) < 1e-12) return false;  // or the box is flat
  }
  return true;
}

Real distanceAt(const Body& mesh, const Shape& shape, Real t) {
  if (shape.is_box && isInside(shape.core, mesh, t)) return 0;
  const Real d = distanceAt(mesh, shape.core, t) - Real(shape.radius);
  return d > 0 ? d : Real(0);
}

TEST(MotionClearance, OfShapesIsThatOfTheJudge) {
  Bodies random(3);
  for (int i = 0; i < manySteps(60); ++i) {
    SCOPED_TRACE(i);
    const auto path = random.oneIn(2) ? FramePath::Straight : FramePath::Screw;
    const Body a = random.body(1, random.oneIn(2), random.below(4), FramePath::Straight);
    const Shape b = shapeOf(random, path, i % 3);
    const Motion moving = Motion::rigid(*b.shape, b.core.from, b.core.to, path);
    const double tolerance = random.size(-3, -1);
    MotionClearance found = leastDistance(a.moving(), moving, tolerance);
    if (found.meet()) {
      EXPECT_LE(static_cast<double>(distanceAt(a, b, Real(found.time))), 1e-7);
    } else {
      judge(
          found, [&](Real t) { return distanceAt(a, b, t); }, a.speed() + b.core.speed(), tolerance,
          1e-11);
    }
    const MotionClearance swapped = leastDistance(moving, a.moving(), tolerance);
    EXPECT_EQ(found.upper, swapped.upper);
    EXPECT_EQ(found.elements[0], swapped.elements[1]);
    if (HasFailure()) return;
  }
}

TEST(MotionClearance, OfHalfSpacesIsThatOfTheJudge) {
  Bodies random(4);
  for (int i = 0; i < manySteps(60); ++i) {
    SCOPED_TRACE(i);
    const auto path = random.oneIn(2) ? FramePath::Straight : FramePath::Screw;
    const Body a =
        random.body(1 + random.below(2), random.oneIn(2), random.below(4), FramePath::Straight);
    const P n = random.direction();
    const double offset = random.uniform(-3, 0);
    const Pose from = random.pose(0.5);
    Pose to = random.pose(0.5);
    if (Bodies::isHalfTurn(from, to)) to.linear() = from.linear();
    const bool is_solid = random.oneIn(2);
    const fcl::Halfspaced half_space(n, offset);
    const fcl::Planed plane(n, offset);
    const fcl::CollisionGeometryd& shape =
        is_solid ? static_cast<const fcl::CollisionGeometryd&>(half_space) : plane;
    const quad::FramePair frame(from, to, path == FramePath::Screw);
    const quad::Point normal = quad::of(n / n.norm());
    const quad::FramePair ends(from, to, false);
    const auto planeAt = [&](Real t, quad::Point& m, Real& d) {
      const quad::FramePair& motion = path == FramePath::Screw ? frame : ends;
      const auto at = [&](Real time, quad::Point& of_normal, Real& of_offset) {
        const quad::Point zero = motion(time, {0, 0, 0}, {0, 0, 0});
        of_normal = motion(time, normal, normal) - zero;
        of_offset = Real(offset) + quad::dot(of_normal, zero);
      };
      if (path == FramePath::Screw) return at(t, m, d);
      quad::Point m1;
      Real d1;
      at(0, m, d);
      at(1, m1, d1);
      m = (1 - t) * m + t * m1;
      d = (1 - t) * d + t * d1;
    };
    const auto distance = [&](Real t) -> Real {
      quad::Point m;
      Real d, low = 0, high = 0;
      planeAt(t, m, d);
      for (std::size_t v = 0; v < a.exact.start.size(); ++v) {
        const Real h = (quad::dot(m, a.exact.vertex(v, t)) - d) / quad::root(quad::dot(m, m));
        low = v == 0 ? h : std::min(low, h);
        high = v == 0 ? h : std::max(high, h);
      }
      return low > 0 ? low : !is_solid && high < 0 ? -high : Real(0);
    };
    if (!is_solid && a.exact.triangles.size() > 1) continue;  // the judge takes them for one
    const double tolerance = random.size(-3, -1);
    const MotionClearance found =
        leastDistance(a.moving(), Motion::rigid(shape, from, to, path), tolerance);
    if (found.meet()) {
      EXPECT_LE(static_cast<double>(distance(Real(found.time))), 1e-7);
    } else {
      Real speed = 0;
      for (int k = 0; k < 64; ++k)
        speed =
            std::max(speed, quad::absolute(distance(Real(k + 1) / 64) - distance(Real(k) / 64)));
      judge(found, distance, speed * 64 * 2, tolerance);
    }
    if (HasFailure()) return;
  }
}

// ---- Ordinary inputs

Pose at(double x, double y, double z) {
  Pose pose = kIdentity;
  pose.translation() = P(x, y, z);
  return pose;
}
Pose turned(double angle, const P& axis, const P& to) {
  Pose pose = at(to[0], to[1], to[2]);
  pose.linear() = Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
  return pose;
}

DeformableMesh meshOf(const TriangleMesh& mesh) { return {mesh.vertices, mesh.triangles}; }

/// Checks bounds around an expected distance, and the work.
void expectLeast(const Motion& a, const Motion& b, double distance, std::size_t most_box_tests,
                 std::size_t most_pair_times) {
  const double tolerance = 1e-5;
  const MotionClearance found = leastDistance(a, b, tolerance);
  EXPECT_LE(found.lower, distance + 1e-12);
  EXPECT_GE(found.upper, distance - 1e-12);
  EXPECT_LE(found.upper, distance + tolerance + 1e-12);
  EXPECT_LE(found.box_tests, most_box_tests);
  EXPECT_LE(found.pair_times, most_pair_times);
}

TEST(MotionClearance, OfFlatPlatesTakesFewTests) {
  const DeformableMesh plate = meshOf(adaptive_bvh_test::plate(100, 100));
  const auto moving = [&](const Pose& from, const Pose& to) {
    return Motion::rigid(plate, from, to);
  };
  const Motion still = moving(kIdentity, kIdentity);
  expectLeast(still, moving(at(0, 0, 0.3), at(0, 0, 0.3)), 0.3, 25000, 100);
  expectLeast(moving(kIdentity, at(1, 2, 3)), moving(at(0, 0, 0.3), at(1, 2, 3.3)), 0.3, 25000,
              100);
  expectLeast(still, moving(at(0.01, 0, 0.01), at(0.5, 0.3, 0.01)), 0.01, 25000, 2000);
  expectLeast(still, moving(at(-3, 0, 0.01), at(5, 0.3, 0.01)), 0.01, 25000, 2000);
  expectLeast(still, moving(at(0.1, 0, 1e4), at(0.2, 0, 1e4)), 1e4, 25000, 100);
  const MotionClearance meets = leastDistance(still, moving(kIdentity, at(0.2, 0, 0)), 1e-5);
  EXPECT_TRUE(meets.meet());
  EXPECT_EQ(meets.time, 0);
}

TEST(MotionClearance, OfAShaftThatTurnsInItsSleeve) {
  const TriangleMesh hose = tube(12, 40);
  TriangleMesh outer = hose;
  for (P& x : outer.vertices) x[1] *= 1.2, x[2] *= 1.2;
  const DeformableMesh shaft = meshOf(hose), sleeve = meshOf(outer);
  const Pose end = turned(M_PI / 6, P::UnitX(), P(0.01, 0, 0));
  const MotionClearance found =
      leastDistance(Motion::rigid(shaft, kIdentity, end, FramePath::Screw),
                    Motion::rigid(sleeve, kIdentity, kIdentity), 1e-4);
  // Corners of the shaft pass the middles of the sleeve's faces, which are cos(pi / 12) as far out.
  double radius = 0;
  for (const P& x : hose.vertices) radius = std::max(radius, std::hypot(x[1], x[2]));
  const double least = radius * (1.2 * std::cos(M_PI / 12) - 1);
  EXPECT_LE(found.lower, least + 1e-12);
  EXPECT_GE(found.upper, least - 1e-12);
  EXPECT_NEAR(found.time, 0.5, 0.1);
}

TEST(MotionClearance, FindsTheFirstImpact) {
  const DeformableMesh plate = meshOf(adaptive_bvh_test::plate(10, 10));
  const Motion still = Motion::rigid(plate, kIdentity, kIdentity);
  for (const double tolerance : {1e-6, 1e-2, 0.5}) {  // also where an earlier sample is as near
    const MotionClearance found = leastDistance(
        still, Motion::rigid(plate, turned(1, P(1, 2, 0), P(0, 0, 2)), at(0, 0, -1)), tolerance);
    const auto impact =
        adaptive_bvh::earliestImpact(Motion(plate, plate.vertices(), plate.vertices()),
                                     Motion(plate, plate.vertices(), plate.vertices(),
                                            turned(1, P(1, 2, 0), P(0, 0, 2)), at(0, 0, -1)));
    EXPECT_TRUE(found.meet());
    EXPECT_NEAR(found.time, impact.time, 1e-8);
  }
}

// ---- Boxes of nodes

/// Checks that the boxes below a node hold their triangles, whose vertices are at `exact` at both
/// ends; returns the triangles' leaf indices. Reads the boxes from above, as walks do.
std::vector<unsigned> judgeBoxes(adaptive_bvh::MovingBoxes& boxes, int node,
                                 const adaptive_bvh::WideTree& tree, double scale,
                                 const std::array<std::vector<quad::Point>, 2>& exact) {
  const adaptive_bvh::MovingNode& moving = boxes[node];
  const adaptive_bvh::WideNode& links = boxes.links()[node];
  std::vector<unsigned> all;
  for (int lane = 0; lane < int(links.count); ++lane) {
    const std::vector<unsigned> below =
        links.isLeaf() ? std::vector<unsigned>{unsigned(links.first + lane)}
                       : judgeBoxes(boxes, links.below[lane], tree, scale, exact);
    for (int e = 0; e < 2; ++e)
      for (int k = 0; k < 3; ++k) {
        const Real low = Real(moving.at[e].low[k][lane]), high = Real(moving.at[e].high[k][lane]);
        EXPECT_TRUE(low >= -Real(boxes.size()) && high <= Real(boxes.size()));
        for (const unsigned leaf_index : below)
          for (int corner = 0; corner < 3; ++corner) {
            const auto v = std::size_t(tree.corners(leaf_index)[corner]);
            const Real y =
                Real(scale) * (quad::entry(exact[std::size_t(e)][v], k) - Real(boxes.origin(e)[k]));
            EXPECT_TRUE(low <= y && y <= high) << "node " << node << ", vertex " << v;
          }
      }
    all.insert(all.end(), below.begin(), below.end());
  }
  return all;
}

/// Whatever the mesh's present positions are: those of the start, of the end, or others.
TEST(MovingBoxes, HoldTheTrianglesBelow) {
  Bodies random(6);
  for (int i = 0; i < manySteps(30); ++i) {
    SCOPED_TRACE(i);
    const double size = std::ldexp(1., random.oneIn(3) ? random.below(400) - 200 : 0),
                 most = random.oneIn(5) ? 0 : random.size(-6, 1);
    const auto moved = [&](std::vector<P> positions) -> std::vector<P> {
      const P together = random.oneIn(3) ? P(random.point() * most) : P(P::Zero());
      for (P& x : positions) x += size * (together + most * random.point());
      return positions;
    };
    TriangleMesh hose = tube(6, 20);
    for (P& x : hose.vertices) x *= size;
    DeformableMesh mesh = meshOf(hose);
    const std::vector<P> start = moved(hose.vertices), end = moved(start);
    if (random.oneIn(2)) mesh.update(start);
    const bool is_step = random.oneIn(2);
    if (is_step || random.oneIn(2)) mesh.updateTwoFrames(end);
    const Pose from = random.pose(size);
    Pose to = random.oneIn(3) ? from : random.pose(size);
    if (Bodies::isHalfTurn(from, to)) to.linear() = from.linear();
    const FramePath path = random.oneIn(2) ? FramePath::Straight : FramePath::Screw;
    const adaptive_bvh::MeshState& state = adaptive_bvh::stateOf(mesh);
    const std::vector<P>& before = is_step ? state.previous : start;
    const std::vector<P>& after = is_step ? state.vertices : end;
    const quad::MovingTriangles exact{before, after, hose.triangles,
                                      quad::FramePair(from, to, path == FramePath::Screw)};
    const adaptive_bvh::MovingBody body(state, before.data(), after.data(),
                                        adaptive_bvh::FrameMotion(from, to, path));
    adaptive_bvh::MovingBoxes boxes;
    const double scale = std::ldexp(1., -std::ilogb(body.radius()));
    for (const auto& times : {std::array<double, 2>{0, 1}, {0, 0.25}, {0.25, 0.5}, {0.5, 1}}) {
      std::array<std::vector<quad::Point>, 2> at_ends;
      for (std::size_t e = 0; e < 2; ++e)
        for (std::size_t v = 0; v < before.size(); ++v)
          at_ends[e].push_back(exact.vertex(v, Real(times[e])));
      boxes.assign(body, scale, times[0], times[1]);
      judgeBoxes(boxes, 0, state.tree, scale, at_ends);
    }
    if (HasFailure()) return;
  }
}

/// A rigid motion refers to the mesh, so it is that of the positions of the query.
TEST(MotionClearance, ARigidMotionFollowsUpdates) {
  DeformableMesh plate = meshOf(adaptive_bvh_test::plate(2, 2));
  const fcl::Sphered ball(0.25);
  const Motion rigid = Motion::rigid(plate, kIdentity, turned(1, P::UnitZ(), P::Zero())),
               above = Motion::rigid(ball, at(0.5, 0.5, 1), at(0.5, 0.5, 1));
  EXPECT_EQ(rigid.mesh, &plate);
  EXPECT_EQ(rigid.geometry, &plate);
  EXPECT_EQ(above.mesh, nullptr);
  EXPECT_NEAR(leastDistance(rigid, above, 1e-6).upper, 0.75, 1e-6);
  std::vector<P> lower = plate.vertices();
  for (P& x : lower) x[2] -= 1;
  plate.updateTwoFrames(lower);
  EXPECT_NEAR(leastDistance(rigid, above, 1e-6).upper, 1.75, 1e-6);
  EXPECT_EQ(adaptive_bvh::selfEarliestImpact(rigid).exists(), false);
}

/// Features move on straight lines, so the functions of features refuse shapes and screws.
TEST(MotionClearance, FeaturesNeedMeshesOnStraightPaths) {
  DeformableMesh plate = meshOf(adaptive_bvh_test::plate(2, 2));
  const Motion good = Motion::rigid(plate);
  const fcl::Sphered ball(0.25);
  const std::vector<P> x = plate.vertices();
  adaptive_bvh::FeaturePairs pairs;
  std::vector<double> a, b;
  for (const Motion& bad :
       {Motion::rigid(ball), Motion::rigid(plate, kIdentity, kIdentity, FramePath::Screw),
        Motion(plate, x, x, kIdentity, kIdentity, FramePath::Screw)}) {
    EXPECT_THROW(adaptive_bvh::selfCandidates(bad, 0.1, pairs), std::invalid_argument);
    for (const bool swaps : {false, true}) {
      const Motion &first = swaps ? bad : good, &second = swaps ? good : bad;
      EXPECT_THROW(adaptive_bvh::candidates(first, second, 0.1, pairs), std::invalid_argument);
      EXPECT_THROW(adaptive_bvh::earliestImpact(first, second), std::invalid_argument);
      EXPECT_THROW(adaptive_bvh::truncateMotion(first, second, 0.1, a, b), std::invalid_argument);
      EXPECT_THROW(adaptive_bvh::safeDisplacements(first, second, 0.1, a, b),
                   std::invalid_argument);
    }
  }
}

TEST(MotionClearance, RefusesWhatItCannotAnswer) {
  const DeformableMesh plate = meshOf(adaptive_bvh_test::plate(2, 2));
  const Motion still = Motion::rigid(plate, kIdentity, kIdentity);
  for (const double tolerance : {0., -1., 1e-15, std::nan(""), HUGE_VAL})
    EXPECT_THROW(leastDistance(still, still, tolerance), std::invalid_argument);
  for (const double limit : {-1., std::nan("")})
    EXPECT_THROW(leastDistance(still, still, 1e-3, limit), std::invalid_argument);
  std::vector<MotionInterval> intervals;
  for (const double clearance : {-1., std::nan(""), HUGE_VAL})
    EXPECT_THROW(intervalsBelow(still, still, clearance, 1e-3, intervals), std::invalid_argument);
  Pose scaled = kIdentity;
  scaled.linear() *= 2;
  EXPECT_THROW(leastDistance(still, Motion::rigid(plate, kIdentity, scaled), 1e-3),
               std::invalid_argument);
  const fcl::Planed plane(P::UnitZ(), 0);
  const Motion flat = Motion::rigid(plane, kIdentity, kIdentity);
  EXPECT_THROW(leastDistance(flat, flat, 1e-3), std::invalid_argument);
  std::vector<P> bad = plate.vertices();
  bad[0][0] = std::nan("");
  EXPECT_THROW(leastDistance(Motion(plate, plate.vertices(), bad), Motion(plate, bad, bad), 1e-3),
               std::invalid_argument);
}

}  // namespace motion_clearance_test
}  // namespace adaptive_bvh_test
