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

template <typename S>
class SceneShapesTest : public testing::Test {
 protected:
  using P = Vector3<S>;
  using Transform = fcl::Transform3<S>;
  static constexpr bool kIsFloat = std::is_same<S, float>::value;
  static constexpr double kError = kIsFloat ? 1e-5 : 1e-9;

  static Transform at(const P& x) {
    Transform tf = Transform::Identity();
    tf.translation() = x;
    return tf;
  }

  /// On the lattice half of the time.
  S size() {
    return random_.oneIn(2) ? S(random_.uniform(S(0.1), 1)) : S(1 + random_.below(4)) / 4;
  }
  P sizes() { return {size(), size(), size()}; }
  Transform pose(S extent) {
    Transform tf = random_.pose(extent);
    if (random_.oneIn(2))
      for (int k = 0; k < 3; ++k) tf.translation()[k] = S(random_.below(13) - 6) / 4;
    return tf;
  }
  JudgedShape<S> shape(int kind) {
    using namespace judged_shapes;
    switch (kind) {
      case 0: return sphere<S>(size());
      case 1: return capsule<S>(size(), size());
      case 2: return box<S>(sizes());
      case 3: return cylinder<S>(size(), size());
      case 4: return cone<S>(size(), size());
      case 5: return ellipsoid<S>(sizes());
      case 6: return octahedron<S>(sizes(), random_.oneIn(2) ? P(P::Zero()) : random_.point());
      default: return flat<S>(random_.direction(), random_.uniform(), kind == 7);
    }
  }
  static constexpr int kKinds = 9;
  static bool isFlat(const JudgedShape<S>& shape) {
    const auto type = shape.geometry->getNodeType();
    return type == fcl::GEOM_PLANE || type == fcl::GEOM_HALFSPACE;
  }

  /// Directions along which a plane may lie between two bodies.
  static std::vector<Point> directions(const JudgedConvex<S>& a, const JudgedConvex<S>& b,
                                       const Point& between) {
    std::vector<Point> all;
    if (between.norm() > 0) all.push_back(between.normalized());
    for (const JudgedConvex<S>* body : {&a, &b}) {
      const auto* plane = dynamic_cast<const fcl::Plane<S>*>(body->shape.geometry.get());
      const auto* half_space = dynamic_cast<const fcl::Halfspace<S>*>(body->shape.geometry.get());
      if (!plane && !half_space) continue;
      // Seen from the body, exactly its normal, though R is no rotation to the last digit.
      const Point n = body->place.R.inverse().transpose() *
                      exact::of(plane ? plane->n : half_space->n).normalized();
      all.push_back(n);
      all.push_back(-n);
    }
    return all;
  }

  void expectApart(const JudgedConvex<S>& a, const JudgedConvex<S>& b,
                   const SceneDistance<S>& found) {
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

  void expectContact(const JudgedConvex<S>& a, const JudgedConvex<S>& b,
                     const fcl::Contact<S>& contact) {
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
  static double depthError(const JudgedShape<S>& a, const JudgedShape<S>& b) {
    const auto isHard = [](const JudgedShape<S>& shape) {
      const auto type = shape.geometry->getNodeType();
      return type == fcl::GEOM_CYLINDER || type == fcl::GEOM_CONE;
    };
    return isHard(a) && isHard(b) ? kHardDepthError : 2 * kError;
  }
  static constexpr double kHardDepthError = kIsFloat ? 1e-4 : 1e-6;

  /// Two bodies alone in a scene.
  void expectPair(const JudgedConvex<S>& a, const Transform& tf_a, const JudgedConvex<S>& b,
                  const Transform& tf_b) {
    Scene<S> scene;
    const BodyId first = scene.add(a.shape.geometry, tf_a),
                 second = scene.add(b.shape.geometry, tf_b);
    scene.update();
    const SceneDistance<S> found = scene.distance();
    SceneCollisions<S> collisions;
    scene.collisions(SceneCollisionRequest(), collisions);
    ASSERT_TRUE(found.exists());
    ASSERT_EQ((BodyPair{first, second}), found.bodies);
    const SceneDistance<S> reverse = scene.nearest(second);
    EXPECT_EQ((BodyPair{second, first}), reverse.bodies);
    EXPECT_NEAR(double(found.distance), double(reverse.distance), kError);
    EXPECT_EQ(found.distance <= 0, !collisions.pairs.empty());
    EXPECT_TRUE(scene.isNearer(found.distance));
    if (found.distance > 0) {
      EXPECT_FALSE(scene.isNearer(found.distance * S(0.999)));
      expectApart(a, b, found);
      ++apart_;
    } else {
      ASSERT_EQ(1u, collisions.contacts.size());
      EXPECT_EQ(a.shape.geometry.get(), collisions.contacts[0].o1);
      EXPECT_EQ(b.shape.geometry.get(), collisions.contacts[0].o2);
      expectContact(a, b, collisions.contacts[0]);
      SceneCollisionRequest few;
      few.enable_contact = false;
      EXPECT_EQ(1u, scene.collisions(few, collisions));
      ++touching_;
    }
  }

  RandomGeometry<S> random_{5};
  int apart_ = 0, touching_ = 0;
};

TYPED_TEST_SUITE(SceneShapesTest, MeshScalars);

TYPED_TEST(SceneShapesTest, CertifiesPairsOfAllShapes) {
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

TYPED_TEST(SceneShapesTest, HasTheClosedFormsOfRoundPairs) {
  using S = TypeParam;
  for (int i = 0; i < manySteps(300) && !testing::Test::HasFailure(); ++i) {
    const bool is_ball = i % 2;
    const S r1 = this->size(), r2 = this->size(), l1 = is_ball ? S(0) : this->size(),
            l2 = i % 3 ? this->size() : S(0);
    const auto geometry = [](S r, S l) -> std::shared_ptr<fcl::CollisionGeometry<S>> {
      if (l > 0) return std::make_shared<fcl::Capsule<S>>(r, l);
      return std::make_shared<fcl::Sphere<S>>(r);
    };
    const auto tf1 = this->pose(1), tf2 = this->pose(1);
    const exact::Placement p1 = exact::placement(tf1), p2 = exact::placement(tf2);
    const Point a(0, 0, Real(l1) / 2), b(0, 0, Real(l2) / 2);
    const double gap =
        double(convex_pairs::distance(p1(a), p1(-a), p2(b), p2(-b)) - Real(r1) - Real(r2));
    Scene<S> scene;
    scene.add(geometry(r1, l1), tf1);
    scene.add(geometry(r2, l2), tf2);
    scene.update();
    const double error = this->kIsFloat ? 2e-6 : 1e-13;
    EXPECT_NEAR(std::max(gap, 0.), double(scene.distance().distance), error);
    SceneCollisions<S> found;
    if (scene.collisions(SceneCollisionRequest(), found) && gap > -double(r1 + r2) + 1e-3) {
      EXPECT_NEAR(-gap, double(found.contacts[0].penetration_depth), error);
    }
    if (std::fabs(gap) > error) {
      EXPECT_EQ(gap < 0, !found.pairs.empty());
    }
  }
}

TYPED_TEST(SceneShapesTest, HasTheDistancesAndDepthsOfBoxes) {
  using S = TypeParam;
  int inside = 0;
  for (int i = 0; i < manySteps(100) && !testing::Test::HasFailure(); ++i) {
    SCOPED_TRACE(i);
    const auto side1 = this->sizes(), side2 = this->sizes();
    const auto tf1 = this->pose(S(0.5)), tf2 = this->pose(S(0.5));
    const exact::Placement p1 = exact::placement(tf1), p2 = exact::placement(tf2);
    const Point half1 = exact::of(side1) / 2, half2 = exact::of(side2) / 2;
    Scene<S> scene;
    scene.add(std::make_shared<fcl::Box<S>>(side1), tf1);
    scene.add(std::make_shared<fcl::Box<S>>(side2), tf2);
    scene.update();
    const double error = this->kIsFloat ? 2e-6 : 1e-12;
    const double depth = double(convex_pairs::boxDepth(half1, p1, half2, p2));
    SceneCollisions<S> found;
    scene.collisions(SceneCollisionRequest(), found);
    if (depth < 0) {
      const double gap = double(convex_pairs::distance(convex_pairs::boxFaces(half1, p1),
                                                       convex_pairs::boxFaces(half2, p2)));
      EXPECT_NEAR(gap, double(scene.distance().distance), error);
      EXPECT_TRUE(found.pairs.empty() || gap < error);
    } else if (depth > error) {
      EXPECT_EQ(S(0), scene.distance().distance);
      ASSERT_EQ(1u, found.contacts.size());
      EXPECT_NEAR(depth, double(found.contacts[0].penetration_depth), this->kIsFloat ? 2e-6 : 1e-9);
      ++inside;
    }
  }
  EXPECT_GT(inside, 10);
}

/// Of the public report: a robot of shapes among shapes counted as free.
TYPED_TEST(SceneShapesTest, BoxAndBallTouch) {
  using S = TypeParam;
  Scene<S> scene;
  const DeformableMesh<S> mesh(latticeBox<S>(1));
  const BodyId box = scene.add(std::make_shared<fcl::Box<S>>(S(1), S(1), S(1))),
               ball = scene.add(std::make_shared<fcl::Sphere<S>>(S(1)),
                                this->at(Vector3<S>(S(0.5), 0, 0)));
  scene.add(mesh, this->at(Vector3<S>(10, 0, 0)));
  scene.update();
  SceneCollisions<S> found;
  EXPECT_EQ(1u, scene.collisions(SceneCollisionRequest(), found));
  EXPECT_EQ((std::vector<BodyPair>{{box, ball}}), found.pairs);
  EXPECT_EQ(S(1), found.contacts[0].penetration_depth);
  EXPECT_TRUE(scene.isNearer(0));
  EXPECT_EQ((BodyPair{box, ball}), scene.nearest(box).bodies);
  EXPECT_EQ(S(0), scene.distance().distance);
  scene.ignore(box, ball);
  EXPECT_FALSE(scene.isNearer(0));
  EXPECT_EQ(S(8.5), scene.distance().distance);
}

TYPED_TEST(SceneShapesTest, FlatShapesAreApartOnlyWhereParallel) {
  using S = TypeParam;
  using P = Vector3<S>;
  const auto half_space = [](const P& n, S d) { return std::make_shared<fcl::Halfspace<S>>(n, d); };
  const auto plane = [](const P& n, S d) { return std::make_shared<fcl::Plane<S>>(n, d); };
  const auto distanceOf = [](std::shared_ptr<fcl::CollisionGeometry<S>> a,
                             std::shared_ptr<fcl::CollisionGeometry<S>> b) {
    const fcl::Transform3<S> turned(
        Eigen::AngleAxis<S>(S(0.7), P(1, 2, 3).normalized()).toRotationMatrix());
    Scene<S> scene;
    scene.add(a, turned);
    scene.add(b, turned);
    scene.update();
    SceneCollisions<S> found;
    scene.collisions(SceneCollisionRequest(), found);
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
TYPED_TEST(SceneShapesTest, RaysHitSurfacesFirst) {
  using S = TypeParam;
  using P = Vector3<S>;
  int hits = 0;
  const int rays = manySteps(1000);
  for (int i = 0; i < rays && !testing::Test::HasFailure(); ++i) {
    const auto shape = this->shape(i % this->kKinds);
    SCOPED_TRACE(std::to_string(i) + ": " + shape.name);
    const auto tf = this->pose(1);
    const JudgedConvex<S> body(shape, tf);
    Scene<S> scene;
    const BodyId id = scene.add(shape.geometry, tf);
    scene.update();
    const P origin = S(2) * this->random_.point(),
            direction = this->random_.oneIn(2)
                            ? P(tf.translation() + S(0.3) * this->random_.point() - origin)
                            : this->random_.vectorOfSize(S(1));
    if (direction.isZero(0)) continue;
    const RayRange<S> range = this->random_.oneIn(2) ? RayRange<S>() : RayRange<S>{S(0.25), S(1.5)};
    std::vector<SceneRayHit<S>> found;
    scene.firstHits(&origin, &direction, 1, range, found);
    const auto at = [&](Real t) { return Point(exact::of(origin) + t * exact::of(direction)); };
    const Real length = exact::of(direction).norm(), error = this->kIsFloat ? 1e-4 : 1e-8;
    const Real begin = range.begin,
               end = found[0].exists() ? Real(found[0].hit.t) : std::min(Real(range.end), Real(6));
    if (found[0].exists()) {
      ++hits;
      EXPECT_EQ(id, found[0].body);
      EXPECT_EQ(-1, found[0].hit.triangle);
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
TYPED_TEST(SceneShapesTest, NearestPointsAreOnSurfaces) {
  using S = TypeParam;
  using P = Vector3<S>;
  int inside = 0;
  for (int i = 0; i < manySteps(500) && !testing::Test::HasFailure(); ++i) {
    const auto shape = this->shape(i % this->kKinds);
    SCOPED_TRACE(std::to_string(i) + ": " + shape.name);
    const auto tf = this->pose(1);
    const JudgedConvex<S> body(shape, tf);
    Scene<S> scene;
    scene.add(shape.geometry, tf);
    scene.update();
    const P x = this->random_.oneIn(2) ? P(S(2) * this->random_.point())
                                       : P(tf.translation() + S(0.2) * this->random_.point());
    const ScenePoint<S> found = scene.nearestPoint(x);
    ASSERT_TRUE(found.exists());
    EXPECT_EQ(-1, found.triangle);
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
    if (found.distance > S(1e-4)) {
      const Point beyond = exact::of(x) + Real(1.01) * (exact::of(found.point) - exact::of(x));
      EXPECT_GT(body.distance(beyond), 0);
    }
  }
  EXPECT_GT(inside, 20);
}

/// An octree is what its cells are as boxes: they are judged as those of a second scene.
TYPED_TEST(SceneShapesTest, OctreesAreBoxes) {
  using S = TypeParam;
  using P = Vector3<S>;
  int touching = 0;
  for (int i = 0; i < manySteps(40) && !testing::Test::HasFailure(); ++i) {
    SCOPED_TRACE(i);
    Scene<S> scene, of_boxes;
    const bool are_two = i % 4 == 0;
    std::size_t numbers[2] = {0, 0};
    const auto addOctree = [&](std::size_t side) {
      auto tree = std::make_shared<octomap::OcTree>(0.25);
      for (int k = 0; k < 12; ++k) {
        const P x = this->random_.point();
        tree->updateNode(octomap::point3d(float(x[0]), float(x[1]), float(x[2])), true);
      }
      const auto tf = this->pose(1);
      scene.add(std::make_shared<fcl::OcTree<S>>(tree), tf);
      for (auto leaf = tree->begin_leafs(); leaf != tree->end_leafs(); ++leaf, ++numbers[side]) {
        const P middle(S(leaf.getX()), S(leaf.getY()), S(leaf.getZ()));
        adaptive_bvh::BodyOptions options;
        options.group = side == 0 ? 1 : 2;
        options.mask = side == 0 ? 2 : 1;
        const S edge = S(leaf.getSize());
        of_boxes.add(std::make_shared<fcl::Box<S>>(edge, edge, edge), tf * this->at(middle),
                     options);
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
    SceneCollisions<S> found, expected;
    scene.collisions(SceneCollisionRequest(), found);
    of_boxes.collisions(SceneCollisionRequest(), expected);
    if (double(of_boxes.distance().distance) == 0) {
      ASSERT_EQ(1u, found.pairs.size());
      EXPECT_EQ(scene.isNearer(0), true);
    }
    if (i % 2) {  // turned cells are rounded in float
      EXPECT_NEAR(double(expected.contacts.size()), double(found.contacts.size()),
                  this->kIsFloat ? 4 : 0);
    }
    touching += !found.pairs.empty();
    const P x = S(2) * this->random_.point(), direction = this->random_.direction();
    EXPECT_NEAR(double(of_boxes.nearestPoint(x).distance), double(scene.nearestPoint(x).distance),
                this->kError);
    std::vector<SceneRayHit<S>> one, other;
    scene.firstHits(&x, &direction, 1, one);
    of_boxes.firstHits(&x, &direction, 1, other);
    EXPECT_NEAR(std::min(1e9, double(other[0].hit.t)), std::min(1e9, double(one[0].hit.t)),
                10 * this->kError);
  }
  EXPECT_GT(touching, 5);
}

/// A step is never late, and not early by more than a little: by times in between.
TYPED_TEST(SceneShapesTest, StepsAreNeverLate) {
  using S = TypeParam;
  using P = Vector3<S>;
  int impacts = 0;
  const int steps = manySteps(200);
  for (int i = 0; i < steps && !testing::Test::HasFailure(); ++i) {
    const auto shape = this->shape(i % this->kKinds);
    SCOPED_TRACE(std::to_string(i) + ": " + shape.name);
    const double separation = i % 3 ? 0 : 0.05;
    // A triangle that moves and turns, and a shape that moves; or a ball and a shape that moves.
    const bool is_ball = i % 2;
    const auto pose = [&] { return this->at(S(2) * this->random_.point()); };
    fcl::Transform3<S> shape_from = this->pose(1), shape_to = shape_from;
    shape_to.translation() += S(0.5) * this->random_.point();
    const fcl::Transform3<S> from = pose(), to = pose();
    std::vector<P> start, end;
    for (int k = 0; k < 3; ++k) {
      start.push_back(S(0.5) * this->random_.point());
      end.push_back(S(0.5) * this->random_.point());
    }
    DeformableMesh<S> mesh(start, {fcl::Triangle(0, 1, 2)});
    mesh.updateTwoFrames(end);
    const S radius = this->size();
    const fcl::Sphere<S> ball(radius);
    Scene<S> scene;
    const BodyId moving =
        is_ball ? scene.add(static_cast<const fcl::CollisionGeometry<S>&>(ball), from)
                : scene.add(static_cast<const fcl::CollisionGeometry<S>&>(mesh), from);
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
    const double error = this->kIsFloat ? 1e-5 : 1e-9;
    for (int k = 0; k < 20 && step > 0; ++k)
      ASSERT_GT(distanceAt(Real(step) * k / 20), separation - error) << k << " " << step;
    if (impact.happens()) {
      ++impacts;
      EXPECT_EQ((BodyPair{moving, other}), impact.bodies);
      EXPECT_LT(distanceAt(step), separation + 1e-6);
      EXPECT_EQ(is_ball ? adaptive_bvh::SceneImpact::kNoFeature : 0u, impact.impact.pair.first);
    }
  }
  EXPECT_GT(impacts, steps / 10);
}

/// A box that turns as a shape and as a mesh meets a cloth at the same time.
TYPED_TEST(SceneShapesTest, TurningBoxesMeetAsTheirMeshesDo) {
  using S = TypeParam;
  using P = Vector3<S>;
  int impacts = 0;
  const TriangleMesh<S> unit = latticeBox<S>(1);
  TriangleMesh<S> around = unit;
  for (P& x : around.vertices) x -= P::Constant(S(0.5));
  const DeformableMesh<S> box_mesh(around), cloth(unit);
  const fcl::Box<S> box(1, 1, 1);
  for (int i = 0; i < manySteps(60); ++i) {
    SCOPED_TRACE(i);
    const fcl::Transform3<S> from = this->random_.pose(4), to = this->random_.pose(4);
    Scene<S> of_shape, of_mesh;
    const BodyId a = of_shape.add(box, from), b = of_mesh.add(box_mesh, from);
    for (Scene<S>* scene : {&of_shape, &of_mesh}) {
      scene->add(cloth);
      scene->beginStep();
    }
    of_shape.setTransform(a, to);
    of_mesh.setTransform(b, to);
    of_shape.update();
    of_mesh.update();
    if (of_shape.largestSafeStep() == 0) continue;  // the start may be inside
    const double expected = of_mesh.largestSafeStep();
    EXPECT_NEAR(expected, of_shape.largestSafeStep(), this->kIsFloat ? 1e-5 : 1e-7);
    impacts += expected < 1;
  }
  EXPECT_GT(impacts, 3);
}

/// A table as a half-space that tilts, against what its plane does at times in between.
TYPED_TEST(SceneShapesTest, TurningHalfSpacesAreNeverLate) {
  using S = TypeParam;
  using P = Vector3<S>;
  int impacts = 0;
  for (int i = 0; i < manySteps(100) && !testing::Test::HasFailure(); ++i) {
    SCOPED_TRACE(i);
    const fcl::Halfspace<S> table(P::UnitZ(), 0);
    const fcl::Transform3<S> from = this->pose(1);
    fcl::Transform3<S> to = from;
    to.linear() = from.linear() *
                  Eigen::AngleAxis<S>(S(0.5) * this->random_.uniform(), this->random_.direction())
                      .toRotationMatrix();
    const S radius = this->size();
    const fcl::Sphere<S> ball(radius);
    const fcl::Transform3<S> ball_from = this->at(from * P(2, 1, S(1.2))),
                             ball_to = this->at(from * P(S(2) * this->random_.point()));
    Scene<S> scene;
    const BodyId a = scene.add(table, from), b = scene.add(ball, ball_from);
    scene.beginStep();
    scene.setTransform(a, to);
    scene.setTransform(b, ball_to);
    scene.update();
    const auto heightAt = [&](Real t) {
      const auto plane = [&](const fcl::Transform3<S>& tf) {
        const Point n = exact::of(tf.linear()).col(2);
        return std::make_pair(n, n.dot(exact::of(tf.translation())));
      };
      const auto begin = plane(from), end = plane(to);
      const Point n = (1 - t) * begin.first + t * end.first,
                  x = (1 - t) * exact::of(ball_from.translation()) +
                      t * exact::of(ball_to.translation());
      return n.dot(x) - ((1 - t) * begin.second + t * end.second) - Real(radius) * n.norm();
    };
    const double step = scene.largestSafeStep(), error = this->kIsFloat ? 1e-5 : 1e-9;
    for (int k = 0; k < 20 && step > 0; ++k) ASSERT_GT(heightAt(Real(step) * k / 20), -error);
    if (step < 1) {
      ++impacts;
      EXPECT_LT(heightAt(step), 1e-5);
    }
  }
  EXPECT_GT(impacts, 10);
}

/// A sheet that falls through a box, of the public report.
TYPED_TEST(SceneShapesTest, SheetsStopAtBoxes) {
  using S = TypeParam;
  std::vector<Vector3<S>> corners = {{-1, -1, 1}, {1, -1, 1}, {1, 1, 1}, {-1, 1, 1}};
  DeformableMesh<S> sheet(corners, {fcl::Triangle(0, 1, 2), fcl::Triangle(0, 2, 3)});
  for (Vector3<S>& x : corners) x[2] = -1;
  sheet.updateTwoFrames(corners);
  Scene<S> scene;
  scene.add(sheet);
  const BodyId box = scene.add(std::make_shared<fcl::Box<S>>(S(1), S(1), S(1)));
  scene.update();
  EXPECT_NEAR(0.25, scene.largestSafeStep(), 1e-9);
  EXPECT_LE(scene.largestSafeStep(), 0.25);
  scene.add(std::make_shared<fcl::Halfspace<S>>(Vector3<S>::UnitZ(), S(0.75)));
  scene.remove(box);
  scene.update();
  EXPECT_NEAR(0.125, scene.largestSafeStep(), 1e-9);
}

/// Scenes of shapes that change in place answer as scenes that are new.
TYPED_TEST(SceneShapesTest, ShapesChangeInPlace) {
  using S = TypeParam;
  const DeformableMesh<S> cube(latticeBox<S>(2));
  auto ball = std::make_shared<fcl::Sphere<S>>(S(0.5));
  auto box = std::make_shared<fcl::Box<S>>(S(1), S(1), S(1));
  auto plane = std::make_shared<fcl::Plane<S>>(Vector3<S>::UnitX(), S(20));
  Scene<S> scene;
  scene.add(cube);
  scene.add(ball, this->at(Vector3<S>(4, 1, 1)));
  scene.add(box, this->at(Vector3<S>(8, 1, 1)));
  scene.add(plane);
  const auto counts = [](Scene<S>& s) {
    SceneCollisions<S> found;
    SceneVertexContacts<S> contacts;
    std::vector<SceneDistance<S>> nearest;
    s.nearest(0, 3, nearest);
    std::vector<double> numbers = {double(s.collisions(SceneCollisionRequest(), found)),
                                   double(s.vertexContacts(0, contacts)), double(s.isNearer(0)),
                                   double(s.distance().distance), s.largestSafeStep()};
    for (const auto& n : nearest) numbers.push_back(double(n.distance));
    return numbers;
  };
  scene.update();
  EXPECT_FALSE(scene.isNearer(0));
  const std::array<S, 6> radii = {S(2.5), S(3), S(0.25), S(4), S(0.5), S(2)};
  for (std::size_t i = 0; i < radii.size(); ++i) {
    SCOPED_TRACE(i);
    ball->radius = radii[i];
    box->side = Vector3<S>(S(1) + S(i % 3), 1, S(2));
    plane->d = S(20) - S(2 * i);
    scene.update();
    Scene<S> fresh;
    for (const BodyId id : scene.bodies()) fresh.add(scene.geometry(id), scene.transform(id));
    fresh.update();
    EXPECT_EQ(counts(fresh), counts(scene));
    EXPECT_EQ(radii[i] >= 2, scene.nearest(0).distance == 0);
  }
}

}  // namespace scene_shapes_test
}  // namespace adaptive_bvh_test
