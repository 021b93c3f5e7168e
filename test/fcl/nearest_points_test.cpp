// Nearest points in the world, on their objects, as far apart as the distance says; whatever the
// shape, the order and the solver. And pairs that FCL cannot compute are refused.
#include <gtest/gtest.h>

#include <functional>
#include <iostream>
#include <sstream>

#include <fcl/config.h>
#if FCL_HAVE_OCTOMAP
#include <fcl/geometry/octree/octree.h>
#endif
#include <fcl/geometry/shape/halfspace.h>
#include <fcl/geometry/shape/plane.h>
#include <fcl/geometry/shape/triangle_p.h>

#include "adaptive_bvh/adaptive_bvh_model.h"
#include "adaptive_bvh/coherent_distance.h"
#include "adaptive_bvh/query.h"
#include "support/exact_geometry.h"
#include "support/fcl_float.h"
#include "support/shapes.h"
#include "support/test_volume.h"

namespace adaptive_bvh_test {
namespace nearest_points_test {

using adaptive_bvh::AdaptiveBVHModel;
using adaptive_bvh::DeformableMesh;

using Geometry = fcl::CollisionGeometryd;
using Mesh = fcl::BVHModel<fcl::RSSd>;

/// The solvers iterate until the distance is right to about 1e-6; points on curved surfaces are off
/// by more.
double tolerance() { return 2e-5; }

double offTriangle(const fcl::Vector3d& x, const fcl::Vector3d& a, const fcl::Vector3d& b,
                   const fcl::Vector3d& c) {
  const exact::Triangle triangle = {exact::of(a), exact::of(b), exact::of(c)};
  return double(exact::distance(triangle, exact::of(x)));
}

/// How far a point of the world lies from a mesh.
double offMesh(const BodyView& mesh, const fcl::Transform3d& tf, const fcl::Vector3d& x) {
  const fcl::Vector3d local = tf.inverse(Eigen::Isometry) * x;
  double least = std::numeric_limits<double>::max();
  for (int t = 0; t < mesh.num_tris; ++t) {
    const fcl::Triangle& corners = mesh.tri_indices[t];
    least = std::min(least, offTriangle(local, mesh.vertices[corners[0]], mesh.vertices[corners[1]],
                                        mesh.vertices[corners[2]]));
  }
  return least;
}

/// The signed distance of a point to a box, negative inside.
double offBox(const fcl::Vector3d& x, const fcl::Vector3d& half) {
  const fcl::Vector3d beyond = x.cwiseAbs() - half;
  const double inside = beyond.maxCoeff();
  return inside < 0 ? inside : beyond.cwiseMax(0.).norm();
}

/// A body of revolution about z whose half profile is the convex polygon (r, z) over the axis: how
/// far (r, z) lies from its boundary.
double offProfile(double r, double z, const std::vector<std::pair<double, double>>& profile) {
  double least = std::numeric_limits<double>::max();
  for (std::size_t i = 0; i + 1 < profile.size(); ++i) {
    const fcl::Vector3d a(profile[i].first, profile[i].second, 0);
    const fcl::Vector3d b(profile[i + 1].first, profile[i + 1].second, 0), x(r, z, 0);
    const double along = std::min(1., std::max(0., (x - a).dot(b - a) / (b - a).squaredNorm()));
    least = std::min(least, (a + along * (b - a) - x).norm());
  }
  return least;
}

/// How far a point, in the shape's frame, lies from its surface.
double offShape(const Geometry& shape, const fcl::Vector3d& x) {
  const double r = std::hypot(x[0], x[1]);
  if (auto box = dynamic_cast<const fcl::Boxd*>(&shape)) return std::abs(offBox(x, box->side / 2));
  if (auto sphere = dynamic_cast<const fcl::Sphered*>(&shape))
    return std::abs(x.norm() - sphere->radius);
  if (auto capsule = dynamic_cast<const fcl::Capsuled*>(&shape)) {
    const double z = std::max(std::abs(x[2]) - capsule->lz / 2, 0.);
    return std::abs(std::hypot(r, z) - capsule->radius);
  }
  if (auto cone = dynamic_cast<const fcl::Coned*>(&shape))
    return offProfile(r, x[2],
                      {{0, -cone->lz / 2}, {cone->radius, -cone->lz / 2}, {0, cone->lz / 2}});
  if (auto tin = dynamic_cast<const fcl::Cylinderd*>(&shape))
    return offProfile(r, x[2],
                      {{0, -tin->lz / 2},
                       {tin->radius, -tin->lz / 2},
                       {tin->radius, tin->lz / 2},
                       {0, tin->lz / 2}});
  if (auto egg = dynamic_cast<const fcl::Ellipsoidd*>(&shape))
    return std::abs(x.cwiseQuotient(egg->radii).norm() - 1) * egg->radii.maxCoeff();
  const std::vector<fcl::Vector3d> v = {{0, 0, 0}, {0.6, 0, 0}, {0, 0.5, 0}, {0, 0, 0.7}};
  return std::min(std::min(offTriangle(x, v[0], v[1], v[2]), offTriangle(x, v[0], v[1], v[3])),
                  std::min(offTriangle(x, v[0], v[2], v[3]), offTriangle(x, v[1], v[2], v[3])));
}

bool areUnset(const fcl::DistanceResultd& result) {
  return result.nearest_points[0].array().isNaN().all() &&
         result.nearest_points[1].array().isNaN().all();
}

/// Of either type of body.
template <typename Body>
class NearestPoints : public testing::Test {
 protected:
  Body model_ = makeBody<Body>(dome(9, 4));
  Deformation deformation_{dome(9, 4), Deformation::Kind::Smooth, 5};
  std::mt19937 random_{31};
};
TYPED_TEST_SUITE(NearestPoints, TestBodies);

TYPED_TEST(NearestPoints, OfAShapeAndAMeshLieOnThemInTheWorld) {
  const Geometry* mesh = &this->model_;
  for (auto solver : {fcl::GST_LIBCCD, fcl::GST_INDEP})
    for (const auto& shape : boundedShapes()) {
      int apart = 0, touching = 0;
      for (int frame = 0; frame < 60; ++frame) {
        if (frame % 5 == 0) this->model_.update(this->deformation_.next());
        const fcl::Transform3d mesh_tf = randomPose(this->random_, 0.5);
        const fcl::Transform3d shape_tf = randomPose(this->random_, 1.);
        fcl::DistanceRequestd request(frame % 2 == 0);  // the points are there in any case
        request.gjk_solver_type = solver;
        for (bool mesh_first : {true, false}) {
          fcl::DistanceResultd result;
          const double distance =
              mesh_first
                  ? adaptive_bvh::distance(mesh, mesh_tf, shape.get(), shape_tf, request, result)
                  : adaptive_bvh::distance(shape.get(), shape_tf, mesh, mesh_tf, request, result);
          EXPECT_EQ(mesh, result.o1) << "the mesh comes first whatever the order";
          EXPECT_EQ(shape.get(), result.o2);
          EXPECT_EQ(int(fcl::DistanceResultd::NONE), result.b2);
          ASSERT_EQ(distance, result.min_distance);
          fcl::CollisionRequestd overlap;
          overlap.gjk_solver_type = solver;
          fcl::CollisionResultd contacts;
          adaptive_bvh::collide(mesh, mesh_tf, shape.get(), shape_tf, overlap, contacts);
          EXPECT_EQ(contacts.isCollision(), distance <= 0);
          if (distance <= 0) {
            EXPECT_EQ(0, distance);
            const fcl::Vector3d& common = result.nearest_points[0];
            EXPECT_LE((common - result.nearest_points[1]).norm(), tolerance());
            EXPECT_LE(offMesh(this->model_, mesh_tf, common), tolerance());
            ++touching;
            continue;
          }
          const fcl::Vector3d &on_mesh = result.nearest_points[0],
                              &on_shape = result.nearest_points[1];
          EXPECT_NEAR(distance, (on_mesh - on_shape).norm(), tolerance());
          EXPECT_LE(offMesh(this->model_, mesh_tf, on_mesh), tolerance());
          const BodyView view(this->model_);
          const fcl::Triangle& corners = view.tri_indices[result.b1];
          EXPECT_LE(offTriangle(mesh_tf.inverse() * on_mesh, view.vertices[corners[0]],
                                view.vertices[corners[1]], view.vertices[corners[2]]),
                    tolerance())
              << "on the triangle that it names";
          EXPECT_LE(offShape(*shape, shape_tf.inverse(Eigen::Isometry) * on_shape), tolerance())
              << "node type " << shape->getNodeType() << ", solver " << solver;
          // Nothing of the mesh is nearer to the shape's point than the mesh's point.
          EXPECT_GE(offMesh(this->model_, mesh_tf, on_shape), distance - tolerance());
          ++apart;
        }
      }
      EXPECT_GT(apart, 60);
      EXPECT_GT(touching, 2);
    }
}

/// The distance of a sphere is that of its middle, so brute force judges it.
TYPED_TEST(NearestPoints, TheDistanceOfASphereIsThatOfItsMiddle) {
  TriangleMesh thin = dome(9, 4);
  for (std::size_t t = 0; t < thin.triangles.size(); t += 2) {  // every second one a segment
    fcl::Triangle& corners = thin.triangles[t];
    thin.vertices.push_back((thin.vertices[corners[0]] + thin.vertices[corners[1]]) / 2);
    corners[2] = thin.vertices.size() - 1;
  }
  const TypeParam segments = makeBody<TypeParam>(thin);
  const fcl::Sphered sphere(0.25);
  int touching = 0;
  for (const TypeParam* model : {static_cast<const TypeParam*>(&this->model_), &segments})
    for (int frame = 0; frame < 100; ++frame) {
      const fcl::Transform3d mesh_tf = randomPose(this->random_, 0.5);
      const fcl::Transform3d tf = randomPose(this->random_, 0.6);
      const double expected = offMesh(*model, mesh_tf, tf.translation()) - sphere.radius;
      fcl::DistanceResultd result;
      adaptive_bvh::distance(model, mesh_tf, &sphere, tf, fcl::DistanceRequestd(), result);
      if (std::abs(expected) < tolerance()) continue;
      EXPECT_NEAR(std::max(expected, 0.), result.min_distance, tolerance());
      touching += expected < 0;
    }
  EXPECT_GT(touching, 20);
}

TYPED_TEST(NearestPoints, OfTwoMeshesLieOnThemAlsoWhenTheyTouch) {
  const DeformableMesh mesh(tube(5, 5));
  AdaptiveBVHModel<TestVolume<double>> adaptive,
      by_displacements(adaptive_bvh::RefitPolicy::thesis(adaptive_bvh::FitnessCriterion::A));
  fillModel(tube(5, 5), adaptive);
  fillModel(tube(5, 5), by_displacements);
  adaptive.mesh();
  fcl::BVHModel<TestVolume<double>> plain;
  fillModel(tube(5, 5), plain);
  int touching = 0, apart = 0;
  std::vector<BodyView> others = {adaptive};
  if (std::is_same<TypeParam, DeformableMesh>::value)
    others.push_back(mesh);
  else
    others.insert(others.end(), {by_displacements, plain});
  const BodyView own(this->model_);
  for (const BodyView& other : others)
    for (int frame = 0; frame < 60; ++frame)
      for (bool swapped : {false, true}) {
        const fcl::Transform3d tf1 = randomPose(this->random_, 0.5);
        const fcl::Transform3d tf2 = randomPose(this->random_, 0.8);
        const BodyView &first = swapped ? other : own, &second = swapped ? own : other;
        fcl::DistanceResultd result;
        const fcl::DistanceRequestd request(true);
        adaptive_bvh::distance(first.geometry, tf1, second.geometry, tf2, request, result);
        const fcl::Vector3d* points = result.nearest_points;
        EXPECT_EQ(first.geometry, result.o1);
        EXPECT_EQ(second.geometry, result.o2);
        EXPECT_NEAR(result.min_distance, (points[0] - points[1]).norm(), 2e-6);
        EXPECT_LE(offMesh(first, tf1, points[0]), 2e-6);
        EXPECT_LE(offMesh(second, tf2, points[1]), 2e-6);
        ++(result.min_distance > 0 ? apart : touching);

        // Asked again, it finds nothing nearer and leaves what it has.
        const fcl::Vector3d before = points[0];
        adaptive_bvh::distance(first.geometry, tf1, second.geometry, tf2, request, result);
        EXPECT_LE((before - points[0]).norm(), 1e-5);

        fcl::DistanceResultd unasked;
        adaptive_bvh::distance(first.geometry, tf1, second.geometry, tf2, fcl::DistanceRequestd(),
                               unasked);
        // Of pairs that are as near up to rounding, either may be found.
        EXPECT_NEAR(result.min_distance, unasked.min_distance,
                    4 * std::numeric_limits<double>::epsilon());
        EXPECT_TRUE(areUnset(unasked));
      }
  EXPECT_GT(touching, 20);
  EXPECT_GT(apart, 100);
}

TYPED_TEST(NearestPoints, OfACoherentPairAreTheSame) {
  const DeformableMesh mesh(dome(9, 4)), other(tube(5, 5));
  adaptive_bvh::CoherentDistance pair(mesh, other);
  const fcl::Transform3d tf1 = randomPose(this->random_, 0.2);
  fcl::Transform3d tf2 = randomPose(this->random_, 0.2);
  for (int frame = 0; frame < 40; ++frame) {
    tf2.translation()[0] = double(frame) / 20;
    fcl::DistanceResultd result;
    pair.distance(tf1, tf2, fcl::DistanceRequestd(true), result);
    const fcl::Vector3d* points = result.nearest_points;
    EXPECT_NEAR(result.min_distance, (points[0] - points[1]).norm(), 2e-6);
    EXPECT_LE(offMesh(mesh, tf1, points[0]), 2e-6);
    EXPECT_LE(offMesh(other, tf2, points[1]), 2e-6);
  }
}

/// An answer of another pair that the result brings is not taken for one of this pair.
TYPED_TEST(NearestPoints, AnOlderPenetrationIsKept) {
  const fcl::Boxd box(0.2, 0.2, 0.2);
  const fcl::Transform3d tf = fcl::Transform3d::Identity();
  fcl::Transform3d far = tf;
  far.translation()[0] = 9;
  fcl::DistanceRequestd request(true, true);
  fcl::DistanceResultd result(-0.25);
  EXPECT_EQ(-0.25, adaptive_bvh::distance(&this->model_, tf, &box, far, request, result));
  EXPECT_EQ(-0.25, result.min_distance);
}

#if FCL_HAVE_OCTOMAP

TYPED_TEST(NearestPoints, OfAnOctreeAndAMeshLieOnThemInTheWorld) {
  auto cells = std::make_shared<octomap::OcTree>(0.125);
  std::uniform_real_distribution<float> coordinate(-0.6f, 0.6f);
  for (int i = 0; i < 12; ++i) {
    const float x = coordinate(this->random_), y = coordinate(this->random_);
    cells->updateNode(octomap::point3d(x, y, coordinate(this->random_)), true);
  }
  const fcl::OcTreed octree(cells);
  const Geometry *mesh = &this->model_, *tree = &octree;
  int apart = 0, touching = 0;
  for (auto solver : {fcl::GST_LIBCCD, fcl::GST_INDEP})
    for (int frame = 0; frame < 60; ++frame)
      for (bool mesh_first : {true, false}) {
        const fcl::Transform3d mesh_tf = randomPose(this->random_, 0.8);
        const fcl::Transform3d tree_tf = randomPose(this->random_, 0.8);
        fcl::DistanceRequestd request(true);
        request.gjk_solver_type = solver;
        fcl::DistanceResultd result;
        const double distance =
            mesh_first ? adaptive_bvh::distance(mesh, mesh_tf, tree, tree_tf, request, result)
                       : adaptive_bvh::distance(tree, tree_tf, mesh, mesh_tf, request, result);
        EXPECT_EQ(tree, result.o1) << "the octree comes first whatever the order";
        EXPECT_EQ(mesh, result.o2);
        const fcl::Vector3d* points = result.nearest_points;
        EXPECT_NEAR(distance, (points[0] - points[1]).norm(), tolerance());
        if (distance <= 0) {
          EXPECT_LE(offMesh(this->model_, mesh_tf, points[1]), tolerance());
          ++touching;
          continue;
        }
        EXPECT_LE(offMesh(this->model_, mesh_tf, points[1]), tolerance());
        const fcl::Vector3d local = tree_tf.inverse(Eigen::Isometry) * points[0];
        double off_cells = std::numeric_limits<double>::max();
        for (auto cell = cells->begin_leafs(), end = cells->end_leafs(); cell != end; ++cell) {
          const fcl::Vector3d middle(double(cell.getX()), double(cell.getY()), double(cell.getZ()));
          off_cells = std::min(
              off_cells, std::abs(offBox(local - middle,
                                         fcl::Vector3d::Constant(double(cell.getSize()) / 2))));
        }
        EXPECT_LE(off_cells, tolerance());
        EXPECT_GE(offMesh(this->model_, mesh_tf, points[0]), distance - tolerance());
        ++apart;
      }
  EXPECT_GT(apart, 60);
  EXPECT_GT(touching, 10);
}

#endif

/// What FCL itself leaves in the points of a touching pair that is handed to it, and of no pair.
TYPED_TEST(NearestPoints, AreNeverUninitialised) {
  const fcl::Boxd box(1, 1, 1);
  const fcl::Transform3d tf = fcl::Transform3d::Identity();
  for (auto solver : {fcl::GST_LIBCCD, fcl::GST_INDEP}) {
    fcl::DistanceRequestd request(true);
    request.gjk_solver_type = solver;
    fcl::DistanceResultd touching;
    for (fcl::Vector3d& point : touching.nearest_points) point.setConstant(77);
    EXPECT_LE(adaptive_bvh::distance(&box, tf, &box, tf, request, touching), 0);
    EXPECT_TRUE(areUnset(touching));
    fcl::DistanceResultd near(1e-3);
    for (fcl::Vector3d& point : near.nearest_points) point.setConstant(77);
    fcl::Transform3d far = tf;
    far.translation()[0] = 9;
    adaptive_bvh::distance(&this->model_, tf, &box, far, request, near);
    EXPECT_TRUE(areUnset(near)) << "nothing nearer was found";
  }
}

// ---- pairs that FCL cannot compute --------------------------------------------------------------

template <typename BV>
std::shared_ptr<Geometry> domeOf() {
  auto model = std::make_shared<fcl::BVHModel<BV>>();
  fillModel(dome(5, 3), *model);
  return model;
}

std::vector<std::shared_ptr<Geometry>> oneOfEach() {
  std::vector<std::shared_ptr<Geometry>> all = boundedShapes();
  auto adaptive = std::make_shared<AdaptiveBVHModel<fcl::RSSd>>();
  fillModel(dome(5, 3), *adaptive);
  all.insert(all.end(),
             {std::make_shared<fcl::Planed>(fcl::Vector3d(0, 0, 1), 0.1),
              std::make_shared<fcl::Halfspaced>(fcl::Vector3d(0, 0, 1), 0.1),
              std::make_shared<fcl::TriangleP<double>>(
                  fcl::Vector3d(0, 0, 0), fcl::Vector3d(1, 0, 0), fcl::Vector3d(0, 1, 0)),
              adaptive, domeOf<fcl::RSSd>(), domeOf<fcl::AABBd>(), domeOf<fcl::OBBd>(),
              domeOf<fcl::kIOS<double>>(), domeOf<fcl::OBBRSSd>(), domeOf<fcl::KDOP<double, 16>>(),
              domeOf<fcl::KDOP<double, 18>>(), domeOf<fcl::KDOP<double, 24>>()});
#if FCL_HAVE_OCTOMAP
  auto cells = std::make_shared<octomap::OcTree>(0.1);
  cells->updateNode(octomap::point3d(0.05f, 0.05f, 0.05f), true);
  all.push_back(std::make_shared<fcl::OcTreed>(cells));
#endif
  return all;
}

class Refusals : public testing::Test {
 protected:
  Refusals() { fillModel(dome(9, 4), model_); }

  AdaptiveBVHModel<fcl::RSSd> model_;
};

/// Does FCL say on std::cerr that it does not support this?
bool warns(const std::function<void()>& query) {
  std::ostringstream said;
  std::streambuf* const saved = std::cerr.rdbuf(said.rdbuf());
  query();
  std::cerr.rdbuf(saved);
  return said.str().find("not supported") != std::string::npos;
}

/// The sentence of the std::invalid_argument that a query throws; empty when it answers.
std::string refusal(const std::function<void()>& query) {
  try {
    query();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

/// FCL's own warning is the judge, but for planes and half-spaces, where FCL crashes: there those
/// with meshes of RSS and OBBRSS are ours.
TEST_F(Refusals, PairsThatFclCannotComputeAreRefused) {
  const auto all = oneOfEach();
  const fcl::Transform3d tf1 = fcl::Transform3d::Identity();
  fcl::Transform3d tf2 = tf1;
  tf2.translation()[2] = 3;
  const auto isUnbounded = [](const Geometry& geometry) {
    return geometry.getNodeType() == fcl::GEOM_PLANE ||
           geometry.getNodeType() == fcl::GEOM_HALFSPACE;
  };
  int distances = 0, collisions = 0, refused = 0;
  for (const auto& o1 : all)
    for (const auto& o2 : all) {
      const bool unbounded = isUnbounded(*o1) || isUnbounded(*o2);
      const auto distance = [&](auto&& ask) {
        fcl::DistanceResultd result;
        ask(o1.get(), tf1, o2.get(), tf2, fcl::DistanceRequestd(true), result);
        EXPECT_LT(result.min_distance, 100) << "an answer that reads as far away";
      };
      const std::string no_distance =
          refusal([&] { distance([](auto&&... x) { adaptive_bvh::distance(x...); }); });
      const auto isOurs = [](const Geometry& geometry) {
        return geometry.getNodeType() == fcl::BV_RSS || geometry.getNodeType() == fcl::BV_OBBRSS;
      };
      const bool expected = unbounded ? !isOurs(*o1) && !isOurs(*o2) : warns([&] {
        fcl::DistanceResultd result;
        fcl::distance(o1.get(), tf1, o2.get(), tf2, fcl::DistanceRequestd(), result);
      });
      EXPECT_EQ(expected, !no_distance.empty()) << o1->getNodeType() << ", " << o2->getNodeType();
      ++(expected ? refused : distances);

      const auto collide = [&] {
        fcl::CollisionResultd result;
        adaptive_bvh::collide(o1.get(), tf1, o2.get(), tf2, fcl::CollisionRequestd(), result);
      };
      const std::string no_collision = refusal(collide);
      if (unbounded) continue;
      EXPECT_EQ(warns([&] {
                  fcl::CollisionResultd result;
                  fcl::collide(o1.get(), tf1, o2.get(), tf2, fcl::CollisionRequestd(), result);
                }),
                !no_collision.empty())
          << o1->getNodeType() << ", " << o2->getNodeType();
      ++(no_collision.empty() ? collisions : refused);
    }
  EXPECT_GT(distances, 100);
  EXPECT_GT(collisions, 150);
  EXPECT_GT(refused, 100);
}

TEST_F(Refusals, ARefusalNamesBothTypes) {
  fcl::BVHModel<fcl::OBBRSSd> other;
  fillModel(dome(5, 3), other);
  const fcl::Planed plane(fcl::Vector3d(0, 0, 1), 0);
  const fcl::Transform3d tf = fcl::Transform3d::Identity();
  const Geometry* mesh = &this->model_;
  const auto distanceTo = [&](const Geometry* object) {
    return refusal([&] {
      fcl::DistanceResultd result;
      adaptive_bvh::distance(mesh, tf, object, tf, fcl::DistanceRequestd(), result);
    });
  };
  EXPECT_EQ(
      "adaptive_bvh: FCL cannot compute the distance between a BVHModel of RSS and a BVHModel of "
      "OBBRSS; use the same volumes in both models",
      distanceTo(&other));
  fcl::BVHModel<fcl::AABBd> aligned;
  fillModel(dome(5, 3), aligned);
  EXPECT_EQ(
      "adaptive_bvh: FCL cannot compute the distance between a BVHModel of AABB and a plane; a "
      "large box may stand for the plane or half-space",
      refusal([&] {
        fcl::DistanceResultd result;
        adaptive_bvh::distance(&aligned, tf, &plane, tf, fcl::DistanceRequestd(), result);
      }));
  AdaptiveBVHModel<fcl::OBBRSSd> adaptive_other;
  fillModel(dome(5, 3), adaptive_other);
  EXPECT_EQ(distanceTo(&other), distanceTo(&adaptive_other)) << "both may be adaptive";
  EXPECT_NE("", refusal([&] {
              fcl::CollisionResultd result;
              adaptive_bvh::collide(&other, tf, mesh, tf, fcl::CollisionRequestd(), result);
            }));
  const Mesh empty;
  EXPECT_NE("", distanceTo(&empty));
  EXPECT_NE("", refusal([&] {
              fcl::DistanceResultd result;
              adaptive_bvh::distance(&empty, tf, &empty, tf, fcl::DistanceRequestd(), result);
            }))
      << "two plain models";
}

}  // namespace nearest_points_test
}  // namespace adaptive_bvh_test
