// Contacts: which pairs touch does not depend on the request, and each has all its fields or NaN.
#include <gtest/gtest.h>

#include <map>

#include <fcl/config.h>
#if FCL_HAVE_OCTOMAP
#include <fcl/geometry/octree/octree.h>
#endif

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/query.h"
#include "adaptive_bvh/self_collision.h"
#include "support/brute_force.h"
#include "support/fcl_float.h"
#include "support/long_mode.h"
#include "support/shapes.h"
#include "support/test_volume.h"
#include "triangles/triangle_gap.h"
#include "triangles/triangle_intersection.h"

namespace adaptive_bvh_test {
namespace contact_requests_test {

using adaptive_bvh::AdaptiveBVHModel;
using adaptive_bvh::DeformableMesh;
using adaptive_bvh::TrianglePoints;
using Pairs = std::set<std::pair<int, int>>;

constexpr std::size_t kAll = 1000000;

/// Points that move together keep their distances.
double tolerance() { return 1e-12; }

TrianglePoints randomTriangle(std::mt19937& random, double size) {
  std::uniform_real_distribution<double> one(-1, 1);
  const auto point = [&]() -> fcl::Vector3d { return {one(random), one(random), one(random)}; };
  const fcl::Vector3d middle = point();
  return {middle + size * point(), middle + size * point(), middle + size * point()};
}

/// Of some triangles only a segment or a point is left: corner on the edge, beside it, or equal.
void flatten(TrianglePoints& t, unsigned kind) {
  if (kind == 1) t[2] = (t[0] + t[1]) / 2;
  if (kind == 2) t[2] = t[0] + 0.3 * (t[1] - t[0]);
  if (kind == 3) t[2] = t[0];
  if (kind == 4) t[1] = t[2] = t[0];
}

/// `flat`: of ten triangles so many are segments or points.
TriangleMesh strewn(int triangles, unsigned flat, std::mt19937& random) {
  TriangleMesh mesh;
  for (int i = 0; i < triangles; ++i) {
    TrianglePoints t = randomTriangle(random, 0.4);
    if (random() % 10 < flat) flatten(t, 1 + unsigned(random() % 4));
    const std::size_t v = mesh.vertices.size();
    mesh.vertices.insert(mesh.vertices.end(), t.begin(), t.end());
    mesh.triangles.emplace_back(v, v + 1, v + 2);
  }
  return mesh;
}

TrianglePoints cornersOf(const BodyView& mesh, int t) {
  const fcl::Triangle& corners = mesh.tri_indices[t];
  return {mesh.vertices[corners[0]], mesh.vertices[corners[1]], mesh.vertices[corners[2]]};
}

TrianglePoints placed(const BodyView& mesh, int t, const fcl::Transform3d& tf) {
  const TrianglePoints x = cornersOf(mesh, t);
  return {tf * x[0], tf * x[1], tf * x[2]};
}

/// The distance of a point to a triangle.
double distanceOf(const TrianglePoints& t, const fcl::Vector3d& point) {
  const fcl::Vector3d x = point;
  return (adaptive_bvh::nearestPoint(t, x) - x).norm();
}

/// Of two convex sets, by projecting from one to the other and back: it converges to the nearest
/// points from above.
double distanceByProjections(const TrianglePoints& a, const TrianglePoints& b) {
  fcl::Vector3d x = ((a[0] + a[1] + a[2]) / 3), y = x;
  const TrianglePoints p = a, q = b;
  for (int step = 0; step < 3000; ++step) {
    y = adaptive_bvh::nearestPoint(q, x);
    x = adaptive_bvh::nearestPoint(p, y);
  }
  return double((x - y).norm());
}

/// By trying a fine grid of them.
double distanceToGrid(const TrianglePoints& t, const fcl::Vector3d& x) {
  constexpr int kSteps = 200;
  double least = std::numeric_limits<double>::max();
  for (int i = 0; i <= kSteps; ++i)
    for (int j = 0; i + j <= kSteps; ++j) {
      const double u = double(i) / kSteps, v = double(j) / kSteps;
      least = std::min(least, (t[0] + u * (t[1] - t[0]) + v * (t[2] - t[0]) - x).norm());
    }
  return least;
}

bool isUnset(const fcl::Contactd& contact) {
  return contact.pos.array().isNaN().all() && contact.normal.array().isNaN().all() &&
         std::isnan(contact.penetration_depth);
}

Pairs pairsOf(const fcl::CollisionResultd& result) {
  Pairs pairs;
  for (std::size_t i = 0; i < result.numContacts(); ++i)
    pairs.emplace(int(result.getContact(i).b1), int(result.getContact(i).b2));
  return pairs;
}

class Contacts : public testing::Test {
 protected:
  std::mt19937 random_{testSeed(29)};
};

/// Of either type of body.
template <typename Body>
class ContactsOfBodies : public Contacts {};
TYPED_TEST_SUITE(ContactsOfBodies, TestBodies);

TEST_F(Contacts, TheNearestPointOfATriangleIsTheNearest) {
  for (int i = 0; i < 60; ++i) {
    TrianglePoints t = randomTriangle(this->random_, 1);
    flatten(t, unsigned(i % 5));
    const fcl::Vector3d x = randomTriangle(this->random_, 1)[0];
    const fcl::Vector3d nearest = adaptive_bvh::nearestPoint(t, x);
    const double found = (nearest - x).norm(), expected = distanceToGrid(t, x);
    EXPECT_LE(found, expected + tolerance());
    EXPECT_GE(found, expected - 0.02) << "a grid point is that near to every point";
    EXPECT_LE(distanceToGrid(t, nearest), 0.02) << "on the triangle";
  }
}

TEST_F(Contacts, NearestPointsOfTwoTrianglesAreTheNearest) {
  int apart = 0, touching = 0;
  for (int i = 0; i < 400; ++i) {
    TrianglePoints a = randomTriangle(this->random_, 1);
    TrianglePoints b = randomTriangle(this->random_, 1);
    flatten(a, unsigned(i % 5));
    flatten(b, unsigned(i / 5 % 5));
    const fcl::Vector3d between = (a[0] + a[1] + a[2] - b[0] - b[1] - b[2]) / 3;
    if (i % 2)
      for (fcl::Vector3d& p : b) p += between;  // their middles in one place
    const auto [on_a, on_b] = adaptive_bvh::gapOf(a, b).points;
    const double found = (on_a - on_b).norm(), expected = double(distanceByProjections(a, b));
    EXPECT_LE(found, expected + 10 * tolerance());
    EXPECT_GE(found, expected - 0.01) << "projections converge slowly";
    EXPECT_LE(distanceOf(a, on_a), tolerance());
    EXPECT_LE(distanceOf(b, on_b), tolerance());
    ++(found > 0.01 ? apart : touching);
  }
  EXPECT_GT(apart, 100);
  EXPECT_GT(touching, 40);
}

TYPED_TEST(ContactsOfBodies, ThePairsAreThoseThatTouchWhateverIsAskedFor) {
  std::size_t pairs = 0;
  for (int round = 0; round < 60; ++round) {
    const auto first = makeBody<TypeParam>(strewn(60, 3, this->random_));
    const auto second = makeBody<TypeParam>(strewn(60, 3, this->random_));
    fcl::Transform3d tf1 = fcl::Transform3d::Identity(), tf2 = tf1;
    if (round % 3) tf1 = randomPose(this->random_, 0.3);
    if (round % 3 == 1) tf2 = randomPose(this->random_, 0.3);
    fcl::CollisionResultd without, with;
    const fcl::CollisionGeometryd *o1 = &first, *o2 = &second;
    adaptive_bvh::collide(o1, tf1, o2, tf2, fcl::CollisionRequestd(kAll, false), without);
    adaptive_bvh::collide(o1, tf1, o2, tf2, fcl::CollisionRequestd(kAll, true), with);
    const Pairs touching = BruteForce(first, tf1, second, tf2).contacts();
    EXPECT_EQ(touching, pairsOf(without));
    EXPECT_EQ(touching, pairsOf(with));
    pairs += pairsOf(with).size();
    for (std::size_t i = 0; i < without.numContacts(); ++i)
      EXPECT_TRUE(isUnset(without.getContact(i)));
  }
  EXPECT_GT(pairs, 500u);
}

TYPED_TEST(ContactsOfBodies, EveryFieldIsFclsOrBetweenTheTriangles) {
  int ours = 0, fcls = 0;
  for (int round = 0; round < 40; ++round) {
    const auto first = makeBody<TypeParam>(strewn(60, 3, this->random_));
    const auto second = makeBody<TypeParam>(strewn(60, 3, this->random_));
    const fcl::Transform3d tf1 = randomPose(this->random_, 0.3);
    const fcl::Transform3d tf2 = randomPose(this->random_, 0.3);
    fcl::CollisionResultd result;
    adaptive_bvh::collide(&first, tf1, &second, tf2, fcl::CollisionRequestd(kAll, true), result);
    std::map<std::pair<int, int>, int> count;
    for (std::size_t i = 0; i < result.numContacts(); ++i) {
      const fcl::Contactd& contact = result.getContact(i);
      const TrianglePoints a = placed(first, int(contact.b1), tf1);
      const TrianglePoints b = placed(second, int(contact.b2), tf2);
      const std::pair<int, int> pair(int(contact.b1), int(contact.b2));
      EXPECT_LE(++count[pair], 2);
      EXPECT_NEAR(1, contact.normal.norm(), 10 * tolerance());
      ASSERT_TRUE(std::isfinite(contact.penetration_depth));
      const auto off = [&](const TrianglePoints& t) { return distanceOf(t, contact.pos); };
      // FCL's points are corners of one of the two.
      EXPECT_LE(std::min(off(a), off(b)), 10 * tolerance());
      const auto isThin = [](const TrianglePoints& t) { return adaptive_bvh::isThin(t); };
      if (isThin(cornersOf(first, int(contact.b1))) || isThin(cornersOf(second, int(contact.b2)))) {
        EXPECT_LE(std::max(off(a), off(b)), 10 * tolerance());
        EXPECT_EQ(0, contact.penetration_depth);
        ++ours;
      } else {
        ++fcls;
      }
    }
  }
  EXPECT_GT(ours, 40);
  EXPECT_GT(fcls, 200);
}

/// To FCL's test parallel segments touch at any distance. Volumes that have grown do not prune
/// them.
TEST_F(Contacts, ThinTrianglesThatAreApartDoNotTouch) {
  int said = 0, touching = 0;
  for (int i = 0; i < 4000; ++i) {
    TrianglePoints a = randomTriangle(this->random_, 0.5);
    TrianglePoints b = randomTriangle(this->random_, 0.5);
    flatten(a, 1 + unsigned(i % 4));
    flatten(b, unsigned(i / 4 % 5));
    if (i % 3 == 0) b = {a[0] + (b[0] - a[1]), a[1] + (b[0] - a[1]), a[2] + (b[0] - a[1])};
    const fcl::Vector3d shift = a[0] - b[0];
    if (i % 7 == 0) {
      for (fcl::Vector3d& p : b) p += shift;
      b[0] = a[0];  // one corner in common
    }
    const bool fcl_says =
        fcl::detail::Intersect<double>::intersect_Triangle(a[0], a[1], a[2], b[0], b[1], b[2]);
    said += fcl_says;
    const bool touches = adaptive_bvh::touch(a, b);
    const double distance = adaptive_bvh::gapOf(a, b).distance;
    const double near = 1e-15;
    if (touches) {
      EXPECT_LE(distance, near);
    }
    touching += touches;
  }
#ifdef __x86_64__  // on ARM, FCL is fused and errs less often
  EXPECT_GT(said, touching + 500) << "FCL's own verdict would do";
#else
  EXPECT_NE(said, touching);
#endif
  EXPECT_GT(touching, 100);
}

TEST_F(Contacts, InflatedVolumesDoNotMakeContacts) {
  adaptive_bvh::RefitPolicy never;
  never.criterion = adaptive_bvh::FitnessCriterion::RefitNone;
  using Model = AdaptiveBVHModel<fcl::RSSd>;
  Model first(never), second(never);
  fillModel(strewn(60, 5, this->random_), first);
  const TriangleMesh mesh = strewn(60, 5, this->random_);
  fillModel(mesh, second);
  const fcl::Transform3d tf = fcl::Transform3d::Identity();
  std::vector<fcl::Vector3d> jump = mesh.vertices;
  for (std::size_t v = 0; v < jump.size(); ++v)
    jump[v] += fcl::Vector3d::Constant(double(v % 5) / 4);
  second.update(jump);
  second.update(mesh.vertices);  // back again: the same triangles in larger volumes
  for (bool with : {false, true}) {
    fcl::CollisionResultd result;
    const fcl::CollisionGeometryd *o1 = &first, *o2 = &second;
    adaptive_bvh::collide(o1, tf, o2, tf, fcl::CollisionRequestd(kAll, with), result);
    EXPECT_EQ(BruteForce(first, tf, second, tf).contacts(), pairsOf(result));
  }
}

TEST_F(Contacts, ASelfCollisionListsEachPairOnce) {
  std::size_t pairs = 0;
  for (unsigned flat : {0u, 3u})
    for (int round = 0; round < 10; ++round) {
      const DeformableMesh model(strewn(100, flat, this->random_));
      const fcl::Transform3d tf = randomPose(this->random_, 1);
      fcl::CollisionResultd with, without, some;
      selfCollide(model, tf, {}, fcl::CollisionRequestd(kAll, true), with);
      selfCollide(model, tf, {}, fcl::CollisionRequestd(kAll, false), without);
      const Pairs found = pairsOf(with);
      EXPECT_EQ(found.size(), with.numContacts()) << "a pair twice";
      EXPECT_EQ(found, pairsOf(without));
      for (const auto& [i, j] : found) EXPECT_FALSE(found.count({j, i})) << "in both orders";
      for (std::size_t i = 0; i < with.numContacts(); ++i) {
        const fcl::Contactd& contact = with.getContact(i);
        EXPECT_TRUE(contact.pos.allFinite() && std::isfinite(contact.penetration_depth));
        EXPECT_NEAR(1, contact.normal.norm(), 10 * tolerance());
        const auto expected = adaptive_bvh::contactOf(cornersOf(model, int(contact.b1)),
                                                      cornersOf(model, int(contact.b2)));
        const fcl::Vector3d point = tf * fcl::Vector3d(expected.points[0]);
        EXPECT_LE((point - contact.pos).norm(), 10 * tolerance()) << "FCL's first point";
        EXPECT_TRUE(isUnset(without.getContact(i)));
      }
      pairs += found.size();
      selfCollide(model, tf, {}, fcl::CollisionRequestd(7, true), some);
      EXPECT_EQ(std::min<std::size_t>(7, found.size()), pairsOf(some).size());
    }
  EXPECT_GT(pairs, 400u);
}

TYPED_TEST(ContactsOfBodies, NoPairLeavesFieldsUnset) {
  const auto model = makeBody<TypeParam>(dome(9, 4));
  fcl::BVHModel<fcl::OBBRSSd> other;
  fillModel(dome(9, 4), other);
  std::vector<std::shared_ptr<fcl::CollisionGeometryd>> others = boundedShapes();
#if FCL_HAVE_OCTOMAP
  auto cells = std::make_shared<octomap::OcTree>(0.1);
  for (int i = 0; i < 8; ++i)
    cells->updateNode(octomap::point3d(0.1f * float(i) - 0.4f, 0, 0), true);
  others.push_back(std::make_shared<fcl::OcTreed>(cells));
#endif
  const fcl::Transform3d tf1 = fcl::Transform3d::Identity();
  fcl::Transform3d tf2 = tf1;
  tf2.translation() = fcl::Vector3d(0.35, -0.1, 0.2);
  const auto expectUnset = [&](const fcl::CollisionGeometryd* o1, const fcl::CollisionGeometryd* o2,
                               const fcl::Transform3d& tf) {
    fcl::CollisionResultd result;
    EXPECT_GT(adaptive_bvh::collide(o1, tf1, o2, tf, fcl::CollisionRequestd(kAll), result), 0u);
    for (std::size_t i = 0; i < result.numContacts(); ++i)
      EXPECT_TRUE(isUnset(result.getContact(i)));
  };
  for (const auto& shape : others) {
    expectUnset(&model, shape.get(), tf2);
    expectUnset(others[0].get(), shape.get(), tf1);  // a pair of FCL's
  }
  expectUnset(&model, &model, tf2);
  expectUnset(&other, &other, tf2);
}

/// To FCL every sphere touches every segment whose volume it meets.
TYPED_TEST(ContactsOfBodies, ASphereTouchesAThinTriangleOnlyWhenItIsNear) {
  const fcl::Sphered sphere(0.3);
  int touching = 0, apart = 0;
  for (int i = 0; i < 400; ++i) {
    TrianglePoints t = randomTriangle(this->random_, 1);
    flatten(t, 1 + unsigned(i % 4));
    const auto model =
        makeBody<TypeParam>(TriangleMesh{{t[0], t[1], t[2]}, {fcl::Triangle(0, 1, 2)}});
    fcl::Transform3d tf1 = randomPose(this->random_, 0.5);
    const fcl::Transform3d tf2 = randomPose(this->random_, 1);
    const fcl::Vector3d center = tf2.translation();
    tf1.translation() += center - tf1.linear() * (t[0] + t[1]) / 2;
    const TrianglePoints in_world = placed(model, 0, tf1);
    const double distance = distanceToGrid(in_world, center) - sphere.radius;
    if (std::abs(distance) < 0.02) continue;
    for (bool with : {false, true}) {
      fcl::CollisionResultd result;
      adaptive_bvh::collide(&model, tf1, &sphere, tf2, fcl::CollisionRequestd(kAll, with), result);
      ASSERT_EQ(distance < 0 ? 1u : 0u, result.numContacts());
      if (!with || distance > 0) continue;
      const fcl::Contactd& contact = result.getContact(0);
      EXPECT_NEAR(1, contact.normal.norm(), 10 * tolerance());
      EXPECT_NEAR(-distance, contact.penetration_depth, 0.02);
      EXPECT_LE(distanceOf(in_world, contact.pos), 10 * tolerance());
    }
    ++(distance < 0 ? touching : apart);
  }
  EXPECT_GT(touching, 50);
  EXPECT_GT(apart, 50);
}

}  // namespace contact_requests_test
}  // namespace adaptive_bvh_test
