// Scenes of shapes and octrees without a mesh between them. Distances are judged by what they name:
// points of both shapes, and a plane between the two, in long double; depths by planes, by random
// directions and by closed forms in quadruple precision; rays and points by the shapes' formulas.
#include <gtest/gtest.h>

#include <fcl/geometry/octree/octree.h>
#include <octomap/octomap.h>

#include "adaptive_bvh/scene.h"
#include "support/closed_bodies.h"
#include "support/convex_pair_oracle.h"
#include "support/fcl_float.h"
#include "support/long_mode.h"
#include "support/random_geometry.h"
#include "support/test_mesh.h"

namespace adaptive_bvh_test {
namespace scene_shapes_test {

using adaptive_bvh::BodyId;
using adaptive_bvh::BodyPair;
using adaptive_bvh::DeformableMesh;
using adaptive_bvh::RayRange;
using adaptive_bvh::Scene;
using adaptive_bvh::SceneCollisionRequest;
using adaptive_bvh::SceneCollisions;
using adaptive_bvh::SceneDistance;
using adaptive_bvh::ScenePoint;
using adaptive_bvh::SceneRayHit;
using adaptive_bvh::SceneVertexContacts;
using exact::Point;
using exact::Real;

constexpr double kFar = std::numeric_limits<double>::infinity();

class SceneShapesTest : public testing::Test {
 protected:
  using P = fcl::Vector3d;
  using Transform = fcl::Transform3d;
  static constexpr double kError = 1e-9;

  static Transform at(const P& x) {
    Transform tf = Transform::Identity();
    tf.translation() = x;
    return tf;
  }

  /// On the lattice half of the time.
  double size() {
    return random_.oneIn(2) ? double(random_.uniform(0.1, 1)) : double(1 + random_.below(4)) / 4;
  }
  P sizes() { return {size(), size(), size()}; }
  Transform pose(double extent) {
    Transform tf = random_.pose(extent);
    if (random_.oneIn(2))
      for (int k = 0; k < 3; ++k) tf.translation()[k] = double(random_.below(13) - 6) / 4;
    return tf;
  }
  JudgedShape shape(int kind) {
    using namespace judged_shapes;
    switch (kind) {
      case 0: return sphere(size());
      case 1: return capsule(size(), size());
      case 2: return box(sizes());
      case 3: return cylinder(size(), size());
      case 4: return cone(size(), size());
      case 5: return ellipsoid(sizes());
      case 6: return octahedron(sizes(), random_.oneIn(2) ? P(P::Zero()) : random_.point());
      default: return flat(random_.direction(), random_.uniform(), kind == 7);
    }
  }
  static constexpr int kKinds = 9;
  static bool isFlat(const JudgedShape& shape) {
    const auto type = shape.geometry->getNodeType();
    return type == fcl::GEOM_PLANE || type == fcl::GEOM_HALFSPACE;
  }

  /// Directions along which a plane may lie between two bodies.
  static std::vector<Point> directions(const JudgedConvex& a, const JudgedConvex& b,
                                       const Point& between) {
    std::vector<Point> all;
    if (between.norm() > 0) all.push_back(between.normalized());
    for (const JudgedConvex* body : {&a, &b}) {
      const auto* plane = dynamic_cast<const fcl::Planed*>(body->shape.geometry.get());
      const auto* half_space = dynamic_cast<const fcl::Halfspaced*>(body->shape.geometry.get());
      if (!plane && !half_space) continue;
      // Seen from the body, exactly its normal, though R is no rotation to the last digit.
      const Point n = body->place.R.inverse().transpose() *
                      exact::of(plane ? plane->n : half_space->n).normalized();
      all.push_back(n);
      all.push_back(-n);
    }
    return all;
  }

  void expectApart(const JudgedConvex& a, const JudgedConvex& b, const SceneDistance& found) {
    const Point p = exact::of(found.points[0]), q = exact::of(found.points[1]);
    const Real d = Real(found.distance);
    EXPECT_LT(a.distance(p), kError);
    EXPECT_LT(b.distance(q), kError);
    EXPECT_NEAR(double(d), double((p - q).norm()), kError);
    Real between = -std::numeric_limits<Real>::infinity();
    for (const Point& n : directions(a, b, q - p))
      between = std::max(between, -convex_pairs::way(a, b, n));
    if (between < d - kError && !isFlat(a.shape) && !isFlat(b.shape))
      between = convex_pairs::widestGap(a, b, (q - p).normalized());
    EXPECT_GT(between, d - kError);
  }

  void expectContact(const JudgedConvex& a, const JudgedConvex& b, const fcl::Contactd& contact) {
    const Point x = exact::of(contact.pos), n = exact::of(contact.normal);
    const double rounding = kError * std::max(1., double(x.norm()));
    EXPECT_LT(a.distance(x), rounding);
    EXPECT_LT(b.distance(x), rounding);
    EXPECT_NEAR(1, double(n.norm()), 1e-5);
    const double depth = double(contact.penetration_depth);
    EXPECT_GE(depth, 0);
    if (depth == kFar) return;
    const bool is_flat = isFlat(a.shape) || isFlat(b.shape);
    if (!is_flat) {
      EXPECT_NEAR(depth, double(convex_pairs::way(a, b, n.normalized())), kError);
    }
    Real least = std::numeric_limits<Real>::infinity();
    for (const Point& m : directions(a, b, n)) least = std::min(least, convex_pairs::way(a, b, m));
    if (is_flat) {
      EXPECT_NEAR(depth, double(least), kError);
    }
    for (int i = 0; i < 100 && !is_flat; ++i) {
      const Point near = n + std::pow(Real(10), -Real(i % 4)) * exact::of(random_.direction());
      if (near.norm() > 0) least = std::min(least, convex_pairs::way(a, b, near.normalized()));
    }
    EXPECT_LT(depth, double(least) + depthError(a.shape, b.shape));
  }
  /// How much deeper than the least depth a contact may be.
  static double depthError(const JudgedShape& a, const JudgedShape& b) {
    const auto isHard = [](const JudgedShape& shape) {
      const auto type = shape.geometry->getNodeType();
      return type == fcl::GEOM_CYLINDER || type == fcl::GEOM_CONE;
    };
    return isHard(a) && isHard(b) ? kHardDepthError : 2 * kError;
  }
  static constexpr double kHardDepthError = 1e-6;

  /// Two bodies alone in a scene.
  void expectPair(const JudgedConvex& a, const Transform& tf_a, const JudgedConvex& b,
                  const Transform& tf_b) {
    Scene scene;
    const BodyId first = scene.add(a.shape.geometry, tf_a),
                 second = scene.add(b.shape.geometry, tf_b);
    scene.update();
    const SceneDistance found = scene.distance();
    SceneCollisions collisions;
    scene.collide(SceneCollisionRequest(), collisions);
    ASSERT_TRUE(found.exists());
    ASSERT_EQ((BodyPair{first, second}), found.bodies);
    const SceneDistance reverse = scene.nearest(second);
    EXPECT_EQ((BodyPair{second, first}), reverse.bodies);
    EXPECT_NEAR(double(found.distance), double(reverse.distance), kError);
    EXPECT_EQ(found.distance <= 0, !collisions.pairs.empty());
    EXPECT_TRUE(scene.isNearer(found.distance));
    if (found.distance > 0) {
      EXPECT_FALSE(scene.isNearer(found.distance * 0.999));
      expectApart(a, b, found);
      ++apart_;
    } else {
      ASSERT_EQ(1u, collisions.contacts.size());
      EXPECT_EQ(a.shape.geometry.get(), collisions.contacts[0].o1);
      EXPECT_EQ(b.shape.geometry.get(), collisions.contacts[0].o2);
      expectContact(a, b, collisions.contacts[0]);
      SceneCollisionRequest few;
      few.enable_contact = false;
      EXPECT_EQ(1u, scene.collide(few, collisions));
      ++touching_;
    }
  }

  RandomGeometry random_{5};
  int apart_ = 0, touching_ = 0;
};

TEST_F(SceneShapesTest, CertifiesPairsOfAllShapes) {
  const int pairs = manySteps(1000);
  for (int i = 0; i < pairs && !testing::Test::HasFailure(); ++i) {
    const auto a = this->shape(i % this->kKinds), b = this->shape(i / 9 % this->kKinds);
    const auto tf_a = this->pose(1), tf_b = this->pose(1);
    SCOPED_TRACE(std::to_string(i) + ": " + a.name + ", " + b.name);
    this->expectPair({a, tf_a}, tf_a, {b, tf_b}, tf_b);
  }
  EXPECT_GT(this->apart_, pairs / 5);
  EXPECT_GT(this->touching_, pairs / 8);
}

TEST_F(SceneShapesTest, HasTheClosedFormsOfRoundPairs) {
  for (int i = 0; i < manySteps(300) && !testing::Test::HasFailure(); ++i) {
    const bool is_ball = i % 2;
    const double r1 = this->size(), r2 = this->size(), l1 = is_ball ? 0. : this->size(),
                 l2 = i % 3 ? this->size() : 0.;
    const auto geometry = [](double r, double l) -> std::shared_ptr<fcl::CollisionGeometryd> {
      if (l > 0) return std::make_shared<fcl::Capsuled>(r, l);
      return std::make_shared<fcl::Sphered>(r);
    };
    const auto tf1 = this->pose(1), tf2 = this->pose(1);
    const exact::Placement p1 = exact::placement(tf1), p2 = exact::placement(tf2);
    const Point a(0, 0, Real(l1) / 2), b(0, 0, Real(l2) / 2);
    const double gap =
        double(convex_pairs::distance(p1(a), p1(-a), p2(b), p2(-b)) - Real(r1) - Real(r2));
    Scene scene;
    scene.add(geometry(r1, l1), tf1);
    scene.add(geometry(r2, l2), tf2);
    scene.update();
    const double error = 1e-13;
    EXPECT_NEAR(std::max(gap, 0.), double(scene.distance().distance), error);
    SceneCollisions found;
    if (scene.collide(SceneCollisionRequest(), found) && gap > -double(r1 + r2) + 1e-3) {
      EXPECT_NEAR(-gap, double(found.contacts[0].penetration_depth), error);
    }
    if (std::fabs(gap) > error) {
      EXPECT_EQ(gap < 0, !found.pairs.empty());
    }
  }
}

TEST_F(SceneShapesTest, HasTheDistancesAndDepthsOfBoxes) {
  int inside = 0;
  for (int i = 0; i < manySteps(100) && !testing::Test::HasFailure(); ++i) {
    SCOPED_TRACE(i);
    const auto side1 = this->sizes(), side2 = this->sizes();
    const auto tf1 = this->pose(0.5), tf2 = this->pose(0.5);
    const exact::Placement p1 = exact::placement(tf1), p2 = exact::placement(tf2);
    const Point half1 = exact::of(side1) / 2, half2 = exact::of(side2) / 2;
    Scene scene;
    scene.add(std::make_shared<fcl::Boxd>(side1), tf1);
    scene.add(std::make_shared<fcl::Boxd>(side2), tf2);
    scene.update();
    const double error = 1e-12;
    const double depth = double(convex_pairs::boxDepth(half1, p1, half2, p2));
    SceneCollisions found;
    scene.collide(SceneCollisionRequest(), found);
    if (depth < 0) {
      const double gap = double(convex_pairs::distance(convex_pairs::boxFaces(half1, p1),
                                                       convex_pairs::boxFaces(half2, p2)));
      EXPECT_NEAR(gap, double(scene.distance().distance), error);
      EXPECT_TRUE(found.pairs.empty() || gap < error);
    } else if (depth > error) {
      EXPECT_EQ(0., scene.distance().distance);
      ASSERT_EQ(1u, found.contacts.size());
      EXPECT_NEAR(depth, double(found.contacts[0].penetration_depth), 1e-9);
      ++inside;
    }
  }
  EXPECT_GT(inside, 10);
}

/// Of the public report: a robot of shapes among shapes counted as free.
TEST_F(SceneShapesTest, BoxAndBallTouch) {
  Scene scene;
  const DeformableMesh mesh(latticeBox(1));
  const BodyId box = scene.add(std::make_shared<fcl::Boxd>(1., 1., 1.)),
               ball = scene.add(std::make_shared<fcl::Sphered>(1.),
                                this->at(fcl::Vector3d(0.5, 0, 0)));
  scene.add(mesh, this->at(fcl::Vector3d(10, 0, 0)));
  scene.update();
  SceneCollisions found;
  EXPECT_EQ(1u, scene.collide(SceneCollisionRequest(), found));
  EXPECT_EQ((std::vector<BodyPair>{{box, ball}}), found.pairs);
  EXPECT_EQ(1., found.contacts[0].penetration_depth);
  EXPECT_TRUE(scene.isNearer(0));
  EXPECT_EQ((BodyPair{box, ball}), scene.nearest(box).bodies);
  EXPECT_EQ(0., scene.distance().distance);
  scene.ignore(box, ball);
  EXPECT_FALSE(scene.isNearer(0));
  EXPECT_EQ(8.5, scene.distance().distance);
}

TEST_F(SceneShapesTest, FlatShapesAreApartOnlyWhereParallel) {
  using P = fcl::Vector3d;
  const auto half_space = [](const P& n, double d) {
    return std::make_shared<fcl::Halfspaced>(n, d);
  };
  const auto plane = [](const P& n, double d) { return std::make_shared<fcl::Planed>(n, d); };
  const auto distanceOf = [](std::shared_ptr<fcl::CollisionGeometryd> a,
                             std::shared_ptr<fcl::CollisionGeometryd> b) {
    const fcl::Transform3d turned(
        Eigen::AngleAxis<double>(0.7, P(1, 2, 3).normalized()).toRotationMatrix());
    Scene scene;
    scene.add(a, turned);
    scene.add(b, turned);
    scene.update();
    SceneCollisions found;
    scene.collide(SceneCollisionRequest(), found);
    const double d = double(scene.distance().distance);
    EXPECT_EQ(d > 0, found.pairs.empty());
    return d > 0 ? d : -double(found.contacts[0].penetration_depth);
  };
  const P z = P::UnitZ();
  EXPECT_NEAR(3, distanceOf(half_space(z, -1), half_space(-z, -2)), 1e-6);
  EXPECT_NEAR(-3, distanceOf(half_space(z, 1), half_space(-z, 2)), 1e-6);
  EXPECT_EQ(-kFar, distanceOf(half_space(z, -1), half_space(z, 2)));
  EXPECT_EQ(-kFar, distanceOf(half_space(z, -1), half_space(P::UnitX(), 2)));
  EXPECT_NEAR(3, distanceOf(plane(z, -1), plane(-z, -2)), 1e-6);
  EXPECT_NEAR(0, distanceOf(plane(z, 1), plane(z, 1)), 1e-6);
  EXPECT_EQ(-kFar, distanceOf(plane(z, 1), plane(P::UnitY(), 1)));
  EXPECT_NEAR(1, distanceOf(plane(z, 2), half_space(z, 1)), 1e-6);
  EXPECT_NEAR(-1, distanceOf(half_space(z, 2), plane(z, 1)), 1e-6);
}

/// Rays against one shape: the point is on the surface, and nothing is crossed before.
TEST_F(SceneShapesTest, RaysHitSurfacesFirst) {
  using P = fcl::Vector3d;
  int hits = 0;
  const int rays = manySteps(1000);
  for (int i = 0; i < rays && !testing::Test::HasFailure(); ++i) {
    const auto shape = this->shape(i % this->kKinds);
    SCOPED_TRACE(std::to_string(i) + ": " + shape.name);
    const auto tf = this->pose(1);
    const JudgedConvex body(shape, tf);
    Scene scene;
    const BodyId id = scene.add(shape.geometry, tf);
    scene.update();
    const P origin = 2. * this->random_.point(),
            direction = this->random_.oneIn(2)
                            ? P(tf.translation() + 0.3 * this->random_.point() - origin)
                            : this->random_.vectorOfSize(1.);
    if (direction.isZero(0)) continue;
    const RayRange range = this->random_.oneIn(2) ? RayRange() : RayRange{0.25, 1.5};
    std::vector<SceneRayHit> found;
    scene.firstHits(&origin, &direction, 1, range, found);
    const auto at = [&](Real t) { return Point(exact::of(origin) + t * exact::of(direction)); };
    const Real length = exact::of(direction).norm(), error = 1e-8;
    const Real begin = range.begin,
               end = found[0].exists() ? Real(found[0].t) : std::min(Real(range.end), Real(6));
    if (found[0].exists()) {
      ++hits;
      EXPECT_EQ(id, found[0].body);
      EXPECT_EQ(-1, found[0].element);
      EXPECT_LT(body.distance(at(end)), error);
    }
    // All between is on one side.
    const Real margin = error / length;
    bool is_in = false, is_out = false;
    for (int k = 0; k <= 40; ++k) {
      const Real t = begin + margin + (end - begin - 2 * margin) * k / 40;
      if (end - begin < 4 * margin) break;
      const Real d = body.distance(at(t));
      is_in = is_in || d == 0;
      is_out = is_out || d > error;
    }
    EXPECT_FALSE(is_in && is_out) << origin.transpose() << ", " << direction.transpose() << ": "
                                  << end;
  }
  EXPECT_GT(hits, rays / 4);
}

/// Of a point outside, the distance is that of the formula; inside, the point found is on the
/// surface, and a ball up to it is inside.
TEST_F(SceneShapesTest, NearestPointsAreOnSurfaces) {
  using P = fcl::Vector3d;
  int inside = 0;
  for (int i = 0; i < manySteps(500) && !testing::Test::HasFailure(); ++i) {
    const auto shape = this->shape(i % this->kKinds);
    SCOPED_TRACE(std::to_string(i) + ": " + shape.name);
    const auto tf = this->pose(1);
    const JudgedConvex body(shape, tf);
    Scene scene;
    scene.add(shape.geometry, tf);
    scene.update();
    const P x = this->random_.oneIn(2) ? P(2. * this->random_.point())
                                       : P(tf.translation() + 0.2 * this->random_.point());
    const ScenePoint found = scene.nearestPoint(x);
    ASSERT_TRUE(found.exists());
    EXPECT_EQ(-1, found.element);
    const Real d = body.distance(exact::of(x));
    EXPECT_LT(body.distance(exact::of(found.point)), this->kError);
    EXPECT_NEAR(double(found.distance), double((found.point - x).norm()), 2 * this->kError);
    if (d > 0) {
      EXPECT_NEAR(double(d), double(found.distance), this->kError);
      continue;
    }
    ++inside;
    for (int k = 0; k < 20; ++k) {
      const Point on_ball =
          exact::of(x) + Real(found.distance) * exact::of(this->random_.direction());
      EXPECT_LT(body.distance(on_ball), this->kError);
    }
    if (found.distance > 1e-4) {
      const Point beyond = exact::of(x) + Real(1.01) * (exact::of(found.point) - exact::of(x));
      EXPECT_GT(body.distance(beyond), 0);
    }
  }
  EXPECT_GT(inside, 20);
}

/// An octree is what its cells are as boxes: they are judged as those of a second scene.
TEST_F(SceneShapesTest, OctreesAreBoxes) {
  using P = fcl::Vector3d;
  int touching = 0;
  for (int i = 0; i < manySteps(40) && !testing::Test::HasFailure(); ++i) {
    SCOPED_TRACE(i);
    Scene scene, of_boxes;
    const bool are_two = i % 4 == 0;
    std::size_t numbers[2] = {0, 0};
    const auto addOctree = [&](std::size_t side) {
      auto tree = std::make_shared<octomap::OcTree>(0.25);
      for (int k = 0; k < 12; ++k) {
        const P x = this->random_.point();
        tree->updateNode(octomap::point3d(float(x[0]), float(x[1]), float(x[2])), true);
      }
      const auto tf = this->pose(1);
      scene.add(std::make_shared<fcl::OcTreed>(tree), tf);
      for (auto leaf = tree->begin_leafs(); leaf != tree->end_leafs(); ++leaf, ++numbers[side]) {
        const P middle(double(leaf.getX()), double(leaf.getY()), double(leaf.getZ()));
        adaptive_bvh::BodyOptions options;
        options.group = side == 0 ? 1 : 2;
        options.mask = side == 0 ? 2 : 1;
        const double edge = double(leaf.getSize());
        of_boxes.add(std::make_shared<fcl::Boxd>(edge, edge, edge), tf * this->at(middle), options);
      }
    };
    addOctree(0);
    if (are_two) {
      addOctree(1);
    } else {
      const auto shape = this->shape(i % this->kKinds);
      const auto tf = this->pose(2);
      scene.add(shape.geometry, tf);
      adaptive_bvh::BodyOptions options;
      options.group = 2;
      options.mask = 1;
      of_boxes.add(shape.geometry, tf, options);
    }
    scene.update();
    of_boxes.update();
    EXPECT_NEAR(double(of_boxes.distance().distance), double(scene.distance().distance),
                this->kError);
    SceneCollisions found, expected;
    scene.collide(SceneCollisionRequest(), found);
    of_boxes.collide(SceneCollisionRequest(), expected);
    if (double(of_boxes.distance().distance) == 0) {
      ASSERT_EQ(1u, found.pairs.size());
      EXPECT_EQ(scene.isNearer(0), true);
    }
    if (i % 2) {  // turned cells are rounded in float
      EXPECT_NEAR(double(expected.contacts.size()), double(found.contacts.size()), 0);
    }
    touching += !found.pairs.empty();
    const P x = 2. * this->random_.point(), direction = this->random_.direction();
    EXPECT_NEAR(double(of_boxes.nearestPoint(x).distance), double(scene.nearestPoint(x).distance),
                this->kError);
    std::vector<SceneRayHit> one, other;
    scene.firstHits(&x, &direction, 1, one);
    of_boxes.firstHits(&x, &direction, 1, other);
    EXPECT_NEAR(std::min(1e9, double(other[0].t)), std::min(1e9, double(one[0].t)),
                10 * this->kError);
  }
  EXPECT_GT(touching, 5);
}

/// A step is never late, and not early by more than a little: by times in between.
TEST_F(SceneShapesTest, StepsAreNeverLate) {
  using P = fcl::Vector3d;
  int impacts = 0;
  const int steps = manySteps(200);
  for (int i = 0; i < steps && !testing::Test::HasFailure(); ++i) {
    const auto shape = this->shape(i % this->kKinds);
    SCOPED_TRACE(std::to_string(i) + ": " + shape.name);
    const double separation = i % 3 ? 0 : 0.05;
    // A triangle that moves and turns, and a shape that moves; or a ball and a shape that moves.
    const bool is_ball = i % 2;
    const auto pose = [&] { return this->at(2. * this->random_.point()); };
    fcl::Transform3d shape_from = this->pose(1), shape_to = shape_from;
    shape_to.translation() += 0.5 * this->random_.point();
    const fcl::Transform3d from = pose(), to = pose();
    std::vector<P> start, end;
    for (int k = 0; k < 3; ++k) {
      start.push_back(0.5 * this->random_.point());
      end.push_back(0.5 * this->random_.point());
    }
    DeformableMesh mesh(start, {fcl::Triangle(0, 1, 2)});
    mesh.updateTwoFrames(end);
    const double radius = this->size();
    const fcl::Sphered ball(radius);
    Scene scene;
    const BodyId moving = is_ball
                              ? scene.add(static_cast<const fcl::CollisionGeometryd&>(ball), from)
                              : scene.add(static_cast<const fcl::CollisionGeometryd&>(mesh), from);
    const BodyId other = scene.add(shape.geometry, shape_from);
    scene.beginStep();
    scene.setTransform(moving, to);
    scene.setTransform(other, shape_to);
    scene.update();
    const auto impact = scene.earliestImpact(separation);
    const double step = scene.largestSafeStep(separation);
    ASSERT_EQ(std::min(1., impact.impact.time), step);
    const auto distanceAt = [&](Real t) {
      const auto mixed = [&](const P& a, const P& b) {
        return Point((1 - t) * exact::of(a) + t * exact::of(b));
      };
      const exact::Placement place{exact::of(shape_from.linear()),
                                   mixed(shape_from.translation(), shape_to.translation())};
      const Point origin = mixed(from.translation(), to.translation());
      if (is_ball) return shape.distance(place.inverse(origin)) - Real(radius);
      exact::Triangle triangle;
      for (std::size_t k = 0; k < 3; ++k)
        triangle[k] = place.inverse(origin + mixed(start[k], end[k]));
      return shape.distanceTo(triangle);
    };
    const double error = 1e-9;
    for (int k = 0; k < 20 && step > 0; ++k)
      ASSERT_GT(distanceAt(Real(step) * k / 20), separation - error) << k << " " << step;
    if (impact.exists()) {
      ++impacts;
      EXPECT_EQ((BodyPair{moving, other}), impact.bodies);
      EXPECT_LT(distanceAt(step), separation + 1e-6);
      EXPECT_EQ(is_ball ? adaptive_bvh::SceneImpact::kNoFeature : 0u, impact.impact.pair.first);
    }
  }
  EXPECT_GT(impacts, steps / 10);
}

/// A box that turns as a shape and as a mesh meets a cloth at the same time.
TEST_F(SceneShapesTest, TurningBoxesMeetAsTheirMeshesDo) {
  using P = fcl::Vector3d;
  int impacts = 0;
  const TriangleMesh unit = latticeBox(1);
  TriangleMesh around = unit;
  for (P& x : around.vertices) x -= P::Constant(0.5);
  const DeformableMesh box_mesh(around), cloth(unit);
  const fcl::Boxd box(1, 1, 1);
  for (int i = 0; i < manySteps(60); ++i) {
    SCOPED_TRACE(i);
    const fcl::Transform3d from = this->random_.pose(4), to = this->random_.pose(4);
    Scene of_shape, of_mesh;
    const BodyId a = of_shape.add(box, from), b = of_mesh.add(box_mesh, from);
    for (Scene* scene : {&of_shape, &of_mesh}) {
      scene->add(cloth);
      scene->beginStep();
    }
    of_shape.setTransform(a, to);
    of_mesh.setTransform(b, to);
    of_shape.update();
    of_mesh.update();
    if (of_shape.largestSafeStep() == 0) continue;  // the start may be inside
    const double expected = of_mesh.largestSafeStep();
    EXPECT_NEAR(expected, of_shape.largestSafeStep(), 1e-7);
    impacts += expected < 1;
  }
  EXPECT_GT(impacts, 3);
}

/// A table as a half-space that tilts, against what its plane does at times in between.
TEST_F(SceneShapesTest, TurningHalfSpacesAreNeverLate) {
  using P = fcl::Vector3d;
  int impacts = 0;
  for (int i = 0; i < manySteps(100) && !testing::Test::HasFailure(); ++i) {
    SCOPED_TRACE(i);
    const fcl::Halfspaced table(P::UnitZ(), 0);
    const fcl::Transform3d from = this->pose(1);
    fcl::Transform3d to = from;
    to.linear() = from.linear() *
                  Eigen::AngleAxis<double>(0.5 * this->random_.uniform(), this->random_.direction())
                      .toRotationMatrix();
    const double radius = this->size();
    const fcl::Sphered ball(radius);
    const fcl::Transform3d ball_from = this->at(from * P(2, 1, 1.2)),
                           ball_to = this->at(from * P(2. * this->random_.point()));
    Scene scene;
    const BodyId a = scene.add(table, from), b = scene.add(ball, ball_from);
    scene.beginStep();
    scene.setTransform(a, to);
    scene.setTransform(b, ball_to);
    scene.update();
    const auto heightAt = [&](Real t) {
      const auto plane = [&](const fcl::Transform3d& tf) {
        const Point n = exact::of(tf.linear()).col(2);
        return std::make_pair(n, n.dot(exact::of(tf.translation())));
      };
      const auto begin = plane(from), end = plane(to);
      const Point n = (1 - t) * begin.first + t * end.first,
                  x = (1 - t) * exact::of(ball_from.translation()) +
                      t * exact::of(ball_to.translation());
      return n.dot(x) - ((1 - t) * begin.second + t * end.second) - Real(radius) * n.norm();
    };
    const double step = scene.largestSafeStep(), error = 1e-9;
    for (int k = 0; k < 20 && step > 0; ++k) ASSERT_GT(heightAt(Real(step) * k / 20), -error);
    if (step < 1) {
      ++impacts;
      EXPECT_LT(heightAt(step), 1e-5);
    }
  }
  EXPECT_GT(impacts, 10);
}

/// A sheet that falls through a box, of the public report.
TEST_F(SceneShapesTest, SheetsStopAtBoxes) {
  std::vector<fcl::Vector3d> corners = {{-1, -1, 1}, {1, -1, 1}, {1, 1, 1}, {-1, 1, 1}};
  DeformableMesh sheet(corners, {fcl::Triangle(0, 1, 2), fcl::Triangle(0, 2, 3)});
  for (fcl::Vector3d& x : corners) x[2] = -1;
  sheet.updateTwoFrames(corners);
  Scene scene;
  scene.add(sheet);
  const BodyId box = scene.add(std::make_shared<fcl::Boxd>(1., 1., 1.));
  scene.update();
  EXPECT_NEAR(0.25, scene.largestSafeStep(), 1e-9);
  EXPECT_LE(scene.largestSafeStep(), 0.25);
  scene.add(std::make_shared<fcl::Halfspaced>(fcl::Vector3d::UnitZ(), 0.75));
  scene.remove(box);
  scene.update();
  EXPECT_NEAR(0.125, scene.largestSafeStep(), 1e-9);
}

/// Scenes of shapes that change in place answer as scenes that are new.
TEST_F(SceneShapesTest, ShapesChangeInPlace) {
  const DeformableMesh cube(latticeBox(2));
  auto ball = std::make_shared<fcl::Sphered>(0.5);
  auto box = std::make_shared<fcl::Boxd>(1., 1., 1.);
  auto plane = std::make_shared<fcl::Planed>(fcl::Vector3d::UnitX(), 20.);
  Scene scene;
  scene.add(cube);
  scene.add(ball, this->at(fcl::Vector3d(4, 1, 1)));
  scene.add(box, this->at(fcl::Vector3d(8, 1, 1)));
  scene.add(plane);
  const auto counts = [](Scene& s) {
    SceneCollisions found;
    SceneVertexContacts contacts;
    std::vector<SceneDistance> nearest;
    s.nearest(0, 3, nearest);
    std::vector<double> numbers = {double(s.collide(SceneCollisionRequest(), found)),
                                   double(s.vertexContacts(0, contacts)), double(s.isNearer(0)),
                                   double(s.distance().distance), s.largestSafeStep()};
    for (const auto& n : nearest) numbers.push_back(double(n.distance));
    return numbers;
  };
  scene.update();
  EXPECT_FALSE(scene.isNearer(0));
  const std::array<double, 6> radii = {2.5, 3., 0.25, 4., 0.5, 2.};
  for (std::size_t i = 0; i < radii.size(); ++i) {
    SCOPED_TRACE(i);
    ball->radius = radii[i];
    box->side = fcl::Vector3d(1. + double(i % 3), 1, 2.);
    plane->d = 20. - double(2 * i);
    scene.update();
    Scene fresh;
    for (const BodyId id : scene.bodies()) fresh.add(scene.geometry(id), scene.transform(id));
    fresh.update();
    EXPECT_EQ(counts(fresh), counts(scene));
    EXPECT_EQ(radii[i] >= 2, scene.nearest(0).distance == 0);
  }
}

}  // namespace scene_shapes_test
}  // namespace adaptive_bvh_test
