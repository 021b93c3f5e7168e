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

template <typename S>
using Geometry = fcl::CollisionGeometry<S>;
template <typename S>
using Mesh = fcl::BVHModel<fcl::RSS<S>>;

/// The solvers iterate until the distance is right to about 1e-6; points on curved surfaces are off
/// by more.
template <typename S>
S tolerance() {
  return std::is_same<S, float>::value ? S(1e-4) : S(2e-5);
}

template <typename S>
S offTriangle(const Vector3<S>& x, const Vector3<S>& a, const Vector3<S>& b, const Vector3<S>& c) {
  const exact::Triangle triangle = {exact::of(a), exact::of(b), exact::of(c)};
  return S(exact::distance(triangle, exact::of(x)));
}

/// How far a point of the world lies from a mesh.
template <typename S>
S offMesh(const BodyView<S>& mesh, const fcl::Transform3<S>& tf, const Vector3<S>& x) {
  const Vector3<S> local = tf.inverse(Eigen::Isometry) * x;
  S least = std::numeric_limits<S>::max();
  for (int t = 0; t < mesh.num_tris; ++t) {
    const fcl::Triangle& corners = mesh.tri_indices[t];
    least = std::min(least, offTriangle(local, mesh.vertices[corners[0]], mesh.vertices[corners[1]],
                                        mesh.vertices[corners[2]]));
  }
  return least;
}

/// The signed distance of a point to a box, negative inside.
template <typename S>
S offBox(const Vector3<S>& x, const Vector3<S>& half) {
  const Vector3<S> beyond = x.cwiseAbs() - half;
  const S inside = beyond.maxCoeff();
  return inside < 0 ? inside : beyond.cwiseMax(S(0)).norm();
}

/// A body of revolution about z whose half profile is the convex polygon (r, z) over the axis: how
/// far (r, z) lies from its boundary.
template <typename S>
S offProfile(S r, S z, const std::vector<std::pair<S, S>>& profile) {
  S least = std::numeric_limits<S>::max();
  for (std::size_t i = 0; i + 1 < profile.size(); ++i) {
    const Vector3<S> a(profile[i].first, profile[i].second, 0);
    const Vector3<S> b(profile[i + 1].first, profile[i + 1].second, 0), x(r, z, 0);
    const S along = std::min(S(1), std::max(S(0), (x - a).dot(b - a) / (b - a).squaredNorm()));
    least = std::min(least, (a + along * (b - a) - x).norm());
  }
  return least;
}

/// How far a point, in the shape's frame, lies from its surface.
template <typename S>
S offShape(const Geometry<S>& shape, const Vector3<S>& x) {
  const S r = std::hypot(x[0], x[1]);
  if (auto box = dynamic_cast<const fcl::Box<S>*>(&shape))
    return std::abs(offBox<S>(x, box->side / 2));
  if (auto sphere = dynamic_cast<const fcl::Sphere<S>*>(&shape))
    return std::abs(x.norm() - sphere->radius);
  if (auto capsule = dynamic_cast<const fcl::Capsule<S>*>(&shape)) {
    const S z = std::max(std::abs(x[2]) - capsule->lz / 2, S(0));
    return std::abs(std::hypot(r, z) - capsule->radius);
  }
  if (auto cone = dynamic_cast<const fcl::Cone<S>*>(&shape))
    return offProfile<S>(r, x[2],
                         {{0, -cone->lz / 2}, {cone->radius, -cone->lz / 2}, {0, cone->lz / 2}});
  if (auto tin = dynamic_cast<const fcl::Cylinder<S>*>(&shape))
    return offProfile<S>(r, x[2],
                         {{0, -tin->lz / 2},
                          {tin->radius, -tin->lz / 2},
                          {tin->radius, tin->lz / 2},
                          {0, tin->lz / 2}});
  if (auto egg = dynamic_cast<const fcl::Ellipsoid<S>*>(&shape))
    return std::abs(x.cwiseQuotient(egg->radii).norm() - 1) * egg->radii.maxCoeff();
  const std::vector<Vector3<S>> v = {{0, 0, 0}, {S(0.6), 0, 0}, {0, S(0.5), 0}, {0, 0, S(0.7)}};
  return std::min(std::min(offTriangle(x, v[0], v[1], v[2]), offTriangle(x, v[0], v[1], v[3])),
                  std::min(offTriangle(x, v[0], v[2], v[3]), offTriangle(x, v[1], v[2], v[3])));
}

template <typename S>
bool areUnset(const fcl::DistanceResult<S>& result) {
  return result.nearest_points[0].array().isNaN().all() &&
         result.nearest_points[1].array().isNaN().all();
}

/// Of either type of body.
template <typename Body>
class NearestPoints : public testing::Test {
 protected:
  using S = ScalarOf<Body>;

  Body model_ = makeBody<Body>(dome<S>(9, 4));
  Deformation<S> deformation_{dome<S>(9, 4), Deformation<S>::Kind::Smooth, 5};
  std::mt19937 random_{31};
};
TYPED_TEST_SUITE(NearestPoints, TestBodies);

TYPED_TEST(NearestPoints, OfAShapeAndAMeshLieOnThemInTheWorld) {
  using S = ScalarOf<TypeParam>;
  const Geometry<S>* mesh = &this->model_;
  for (auto solver : {fcl::GST_LIBCCD, fcl::GST_INDEP})
    for (const auto& shape : boundedShapes<S>()) {
      int apart = 0, touching = 0;
      for (int frame = 0; frame < 60; ++frame) {
        if (frame % 5 == 0) this->model_.update(this->deformation_.next());
        const fcl::Transform3<S> mesh_tf = randomPose<S>(this->random_, S(0.5));
        const fcl::Transform3<S> shape_tf = randomPose<S>(this->random_, S(1));
        fcl::DistanceRequest<S> request(frame % 2 == 0);  // the points are there in any case
        request.gjk_solver_type = solver;
        for (bool mesh_first : {true, false}) {
          fcl::DistanceResult<S> result;
          const S distance =
              mesh_first
                  ? adaptive_bvh::distance(mesh, mesh_tf, shape.get(), shape_tf, request, result)
                  : adaptive_bvh::distance(shape.get(), shape_tf, mesh, mesh_tf, request, result);
          EXPECT_EQ(mesh, result.o1) << "the mesh comes first whatever the order";
          EXPECT_EQ(shape.get(), result.o2);
          EXPECT_EQ(int(fcl::DistanceResult<S>::NONE), result.b2);
          ASSERT_EQ(distance, result.min_distance);
          fcl::CollisionRequest<S> overlap;
          overlap.gjk_solver_type = solver;
          fcl::CollisionResult<S> contacts;
          adaptive_bvh::collide(mesh, mesh_tf, shape.get(), shape_tf, overlap, contacts);
          EXPECT_EQ(contacts.isCollision(), distance <= 0);
          if (distance <= 0) {
            EXPECT_EQ(0, distance);
            const Vector3<S>& common = result.nearest_points[0];
            EXPECT_LE((common - result.nearest_points[1]).norm(), tolerance<S>());
            EXPECT_LE(offMesh<S>(this->model_, mesh_tf, common), tolerance<S>());
            ++touching;
            continue;
          }
          const Vector3<S>&on_mesh = result.nearest_points[0], &on_shape = result.nearest_points[1];
          EXPECT_NEAR(distance, (on_mesh - on_shape).norm(), tolerance<S>());
          EXPECT_LE(offMesh<S>(this->model_, mesh_tf, on_mesh), tolerance<S>());
          const BodyView<S> view(this->model_);
          const fcl::Triangle& corners = view.tri_indices[result.b1];
          EXPECT_LE(offTriangle<S>(mesh_tf.inverse() * on_mesh, view.vertices[corners[0]],
                                   view.vertices[corners[1]], view.vertices[corners[2]]),
                    tolerance<S>())
              << "on the triangle that it names";
          EXPECT_LE(offShape<S>(*shape, shape_tf.inverse(Eigen::Isometry) * on_shape),
                    tolerance<S>())
              << "node type " << shape->getNodeType() << ", solver " << solver;
          // Nothing of the mesh is nearer to the shape's point than the mesh's point.
          EXPECT_GE(offMesh<S>(this->model_, mesh_tf, on_shape), distance - tolerance<S>());
          ++apart;
        }
      }
      EXPECT_GT(apart, 60);
      EXPECT_GT(touching, 2);
    }
}

/// The distance of a sphere is that of its middle, so brute force judges it.
TYPED_TEST(NearestPoints, TheDistanceOfASphereIsThatOfItsMiddle) {
  using S = ScalarOf<TypeParam>;
  TriangleMesh<S> thin = dome<S>(9, 4);
  for (std::size_t t = 0; t < thin.triangles.size(); t += 2) {  // every second one a segment
    fcl::Triangle& corners = thin.triangles[t];
    thin.vertices.push_back((thin.vertices[corners[0]] + thin.vertices[corners[1]]) / 2);
    corners[2] = thin.vertices.size() - 1;
  }
  const TypeParam segments = makeBody<TypeParam>(thin);
  const fcl::Sphere<S> sphere(S(0.25));
  int touching = 0;
  for (const TypeParam* model : {static_cast<const TypeParam*>(&this->model_), &segments})
    for (int frame = 0; frame < 100; ++frame) {
      const fcl::Transform3<S> mesh_tf = randomPose<S>(this->random_, S(0.5));
      const fcl::Transform3<S> tf = randomPose<S>(this->random_, S(0.6));
      const S expected = offMesh<S>(*model, mesh_tf, tf.translation()) - sphere.radius;
      fcl::DistanceResult<S> result;
      adaptive_bvh::distance<S>(model, mesh_tf, &sphere, tf, fcl::DistanceRequest<S>(), result);
      if (std::abs(expected) < tolerance<S>()) continue;
      EXPECT_NEAR(std::max(expected, S(0)), result.min_distance, tolerance<S>());
      touching += expected < 0;
    }
  EXPECT_GT(touching, 20);
}

TYPED_TEST(NearestPoints, OfTwoMeshesLieOnThemAlsoWhenTheyTouch) {
  using S = ScalarOf<TypeParam>;
  const DeformableMesh<S> mesh(tube<S>(5, 5));
  AdaptiveBVHModel<TestVolume<S>> adaptive,
      by_displacements(adaptive_bvh::RefitPolicy::thesis(adaptive_bvh::FitnessCriterion::A));
  fillModel(tube<S>(5, 5), adaptive);
  fillModel(tube<S>(5, 5), by_displacements);
  adaptive.mesh();
  fcl::BVHModel<TestVolume<S>> plain;
  fillModel(tube<S>(5, 5), plain);
  int touching = 0, apart = 0;
  std::vector<BodyView<S>> others = {adaptive};
  if (std::is_same<TypeParam, DeformableMesh<S>>::value)
    others.push_back(mesh);
  else
    others.insert(others.end(), {by_displacements, plain});
  const BodyView<S> own(this->model_);
  for (const BodyView<S>& other : others)
    for (int frame = 0; frame < 60; ++frame)
      for (bool swapped : {false, true}) {
        const fcl::Transform3<S> tf1 = randomPose<S>(this->random_, S(0.5));
        const fcl::Transform3<S> tf2 = randomPose<S>(this->random_, S(0.8));
        const BodyView<S>&first = swapped ? other : own, &second = swapped ? own : other;
        fcl::DistanceResult<S> result;
        const fcl::DistanceRequest<S> request(true);
        adaptive_bvh::distance<S>(first.geometry, tf1, second.geometry, tf2, request, result);
        const Vector3<S>* points = result.nearest_points;
        EXPECT_EQ(first.geometry, result.o1);
        EXPECT_EQ(second.geometry, result.o2);
        EXPECT_NEAR(result.min_distance, (points[0] - points[1]).norm(), S(2e-6));
        EXPECT_LE(offMesh<S>(first, tf1, points[0]), S(2e-6));
        EXPECT_LE(offMesh<S>(second, tf2, points[1]), S(2e-6));
        ++(result.min_distance > 0 ? apart : touching);

        // Asked again, it finds nothing nearer and leaves what it has.
        const Vector3<S> before = points[0];
        adaptive_bvh::distance<S>(first.geometry, tf1, second.geometry, tf2, request, result);
        EXPECT_LE((before - points[0]).norm(), S(1e-5));

        fcl::DistanceResult<S> unasked;
        adaptive_bvh::distance<S>(first.geometry, tf1, second.geometry, tf2,
                                  fcl::DistanceRequest<S>(), unasked);
        // Of pairs that are as near up to rounding, either may be found.
        EXPECT_NEAR(result.min_distance, unasked.min_distance,
                    4 * std::numeric_limits<S>::epsilon());
        EXPECT_TRUE(areUnset(unasked));
      }
  EXPECT_GT(touching, 20);
  EXPECT_GT(apart, 100);
}

TYPED_TEST(NearestPoints, OfACoherentPairAreTheSame) {
  using S = ScalarOf<TypeParam>;
  const DeformableMesh<S> mesh(dome<S>(9, 4)), other(tube<S>(5, 5));
  adaptive_bvh::CoherentDistance<S> pair(mesh, other);
  const fcl::Transform3<S> tf1 = randomPose<S>(this->random_, S(0.2));
  fcl::Transform3<S> tf2 = randomPose<S>(this->random_, S(0.2));
  for (int frame = 0; frame < 40; ++frame) {
    tf2.translation()[0] = S(frame) / 20;
    fcl::DistanceResult<S> result;
    pair.distance(tf1, tf2, fcl::DistanceRequest<S>(true), result);
    const Vector3<S>* points = result.nearest_points;
    EXPECT_NEAR(result.min_distance, (points[0] - points[1]).norm(), S(2e-6));
    EXPECT_LE(offMesh<S>(mesh, tf1, points[0]), S(2e-6));
    EXPECT_LE(offMesh<S>(other, tf2, points[1]), S(2e-6));
  }
}

/// An answer of another pair that the result brings is not taken for one of this pair.
TYPED_TEST(NearestPoints, AnOlderPenetrationIsKept) {
  using S = ScalarOf<TypeParam>;
  const fcl::Box<S> box(S(0.2), S(0.2), S(0.2));
  const fcl::Transform3<S> tf = fcl::Transform3<S>::Identity();
  fcl::Transform3<S> far = tf;
  far.translation()[0] = 9;
  fcl::DistanceRequest<S> request(true, true);
  fcl::DistanceResult<S> result(S(-0.25));
  EXPECT_EQ(S(-0.25), adaptive_bvh::distance<S>(&this->model_, tf, &box, far, request, result));
  EXPECT_EQ(S(-0.25), result.min_distance);
}

#if FCL_HAVE_OCTOMAP

TYPED_TEST(NearestPoints, OfAnOctreeAndAMeshLieOnThemInTheWorld) {
  using S = ScalarOf<TypeParam>;
  auto cells = std::make_shared<octomap::OcTree>(0.125);
  std::uniform_real_distribution<float> coordinate(-0.6f, 0.6f);
  for (int i = 0; i < 12; ++i) {
    const float x = coordinate(this->random_), y = coordinate(this->random_);
    cells->updateNode(octomap::point3d(x, y, coordinate(this->random_)), true);
  }
  const fcl::OcTree<S> octree(cells);
  const Geometry<S>*mesh = &this->model_, *tree = &octree;
  int apart = 0, touching = 0;
  for (auto solver : {fcl::GST_LIBCCD, fcl::GST_INDEP})
    for (int frame = 0; frame < 60; ++frame)
      for (bool mesh_first : {true, false}) {
        const fcl::Transform3<S> mesh_tf = randomPose<S>(this->random_, S(0.8));
        const fcl::Transform3<S> tree_tf = randomPose<S>(this->random_, S(0.8));
        fcl::DistanceRequest<S> request(true);
        request.gjk_solver_type = solver;
        fcl::DistanceResult<S> result;
        const S distance =
            mesh_first ? adaptive_bvh::distance(mesh, mesh_tf, tree, tree_tf, request, result)
                       : adaptive_bvh::distance(tree, tree_tf, mesh, mesh_tf, request, result);
        EXPECT_EQ(tree, result.o1) << "the octree comes first whatever the order";
        EXPECT_EQ(mesh, result.o2);
        const Vector3<S>* points = result.nearest_points;
        EXPECT_NEAR(distance, (points[0] - points[1]).norm(), tolerance<S>());
        if (distance <= 0) {
          EXPECT_LE(offMesh<S>(this->model_, mesh_tf, points[1]), tolerance<S>());
          ++touching;
          continue;
        }
        EXPECT_LE(offMesh<S>(this->model_, mesh_tf, points[1]), tolerance<S>());
        const Vector3<S> local = tree_tf.inverse(Eigen::Isometry) * points[0];
        S off_cells = std::numeric_limits<S>::max();
        for (auto cell = cells->begin_leafs(), end = cells->end_leafs(); cell != end; ++cell) {
          const Vector3<S> middle(S(cell.getX()), S(cell.getY()), S(cell.getZ()));
          off_cells = std::min(
              off_cells,
              std::abs(offBox<S>(local - middle, Vector3<S>::Constant(S(cell.getSize()) / 2))));
        }
        EXPECT_LE(off_cells, tolerance<S>());
        EXPECT_GE(offMesh<S>(this->model_, mesh_tf, points[0]), distance - tolerance<S>());
        ++apart;
      }
  EXPECT_GT(apart, 60);
  EXPECT_GT(touching, 10);
}

#endif

/// What FCL itself leaves in the points of a touching pair that is handed to it, and of no pair.
TYPED_TEST(NearestPoints, AreNeverUninitialised) {
  using S = ScalarOf<TypeParam>;
  const fcl::Box<S> box(1, 1, 1);
  const fcl::Transform3<S> tf = fcl::Transform3<S>::Identity();
  for (auto solver : {fcl::GST_LIBCCD, fcl::GST_INDEP}) {
    fcl::DistanceRequest<S> request(true);
    request.gjk_solver_type = solver;
    fcl::DistanceResult<S> touching;
    for (Vector3<S>& point : touching.nearest_points) point.setConstant(77);
    EXPECT_LE(adaptive_bvh::distance<S>(&box, tf, &box, tf, request, touching), 0);
    EXPECT_TRUE(areUnset(touching));
    fcl::DistanceResult<S> near(S(1e-3));
    for (Vector3<S>& point : near.nearest_points) point.setConstant(77);
    fcl::Transform3<S> far = tf;
    far.translation()[0] = 9;
    adaptive_bvh::distance<S>(&this->model_, tf, &box, far, request, near);
    EXPECT_TRUE(areUnset(near)) << "nothing nearer was found";
  }
}

// ---- pairs that FCL cannot compute --------------------------------------------------------------

template <typename S, typename BV>
std::shared_ptr<Geometry<S>> domeOf() {
  auto model = std::make_shared<fcl::BVHModel<BV>>();
  fillModel(dome<S>(5, 3), *model);
  return model;
}

template <typename S>
std::vector<std::shared_ptr<Geometry<S>>> oneOfEach() {
  std::vector<std::shared_ptr<Geometry<S>>> all = boundedShapes<S>();
  auto adaptive = std::make_shared<AdaptiveBVHModel<fcl::RSS<S>>>();
  fillModel(dome<S>(5, 3), *adaptive);
  all.insert(all.end(), {std::make_shared<fcl::Plane<S>>(Vector3<S>(0, 0, 1), S(0.1)),
                         std::make_shared<fcl::Halfspace<S>>(Vector3<S>(0, 0, 1), S(0.1)),
                         std::make_shared<fcl::TriangleP<S>>(
                             Vector3<S>(0, 0, 0), Vector3<S>(1, 0, 0), Vector3<S>(0, 1, 0)),
                         adaptive, domeOf<S, fcl::RSS<S>>(), domeOf<S, fcl::AABB<S>>(),
                         domeOf<S, fcl::OBB<S>>(), domeOf<S, fcl::kIOS<S>>(),
                         domeOf<S, fcl::OBBRSS<S>>(), domeOf<S, fcl::KDOP<S, 16>>(),
                         domeOf<S, fcl::KDOP<S, 18>>(), domeOf<S, fcl::KDOP<S, 24>>()});
#if FCL_HAVE_OCTOMAP
  auto cells = std::make_shared<octomap::OcTree>(0.1);
  cells->updateNode(octomap::point3d(0.05f, 0.05f, 0.05f), true);
  all.push_back(std::make_shared<fcl::OcTree<S>>(cells));
#endif
  return all;
}

template <typename S>
class Refusals : public testing::Test {
 protected:
  Refusals() { fillModel(dome<S>(9, 4), model_); }

  AdaptiveBVHModel<fcl::RSS<S>> model_;
};
TYPED_TEST_SUITE(Refusals, MeshScalars);

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
TYPED_TEST(Refusals, PairsThatFclCannotComputeAreRefused) {
  using S = TypeParam;
  const auto all = oneOfEach<S>();
  const fcl::Transform3<S> tf1 = fcl::Transform3<S>::Identity();
  fcl::Transform3<S> tf2 = tf1;
  tf2.translation()[2] = 3;
  const auto isUnbounded = [](const Geometry<S>& geometry) {
    return geometry.getNodeType() == fcl::GEOM_PLANE ||
           geometry.getNodeType() == fcl::GEOM_HALFSPACE;
  };
  int distances = 0, collisions = 0, refused = 0;
  for (const auto& o1 : all)
    for (const auto& o2 : all) {
      const bool unbounded = isUnbounded(*o1) || isUnbounded(*o2);
      const auto distance = [&](auto&& ask) {
        fcl::DistanceResult<S> result;
        ask(o1.get(), tf1, o2.get(), tf2, fcl::DistanceRequest<S>(true), result);
        EXPECT_LT(result.min_distance, 100) << "an answer that reads as far away";
      };
      const std::string no_distance =
          refusal([&] { distance([](auto&&... x) { adaptive_bvh::distance(x...); }); });
      const auto isOurs = [](const Geometry<S>& geometry) {
        return geometry.getNodeType() == fcl::BV_RSS || geometry.getNodeType() == fcl::BV_OBBRSS;
      };
      const bool expected = unbounded ? !isOurs(*o1) && !isOurs(*o2) : warns([&] {
        fcl::DistanceResult<S> result;
        fcl::distance(o1.get(), tf1, o2.get(), tf2, fcl::DistanceRequest<S>(), result);
      });
      EXPECT_EQ(expected, !no_distance.empty()) << o1->getNodeType() << ", " << o2->getNodeType();
      ++(expected ? refused : distances);

      const auto collide = [&] {
        fcl::CollisionResult<S> result;
        adaptive_bvh::collide(o1.get(), tf1, o2.get(), tf2, fcl::CollisionRequest<S>(), result);
      };
      const std::string no_collision = refusal(collide);
      if (unbounded) continue;
      EXPECT_EQ(warns([&] {
                  fcl::CollisionResult<S> result;
                  fcl::collide(o1.get(), tf1, o2.get(), tf2, fcl::CollisionRequest<S>(), result);
                }),
                !no_collision.empty())
          << o1->getNodeType() << ", " << o2->getNodeType();
      ++(no_collision.empty() ? collisions : refused);
    }
  EXPECT_GT(distances, 100);
  EXPECT_GT(collisions, 150);
  EXPECT_GT(refused, 100);
}

TYPED_TEST(Refusals, ARefusalNamesBothTypes) {
  using S = TypeParam;
  fcl::BVHModel<fcl::OBBRSS<S>> other;
  fillModel(dome<S>(5, 3), other);
  const fcl::Plane<S> plane(Vector3<S>(0, 0, 1), 0);
  const fcl::Transform3<S> tf = fcl::Transform3<S>::Identity();
  const Geometry<S>* mesh = &this->model_;
  const auto distanceTo = [&](const Geometry<S>* object) {
    return refusal([&] {
      fcl::DistanceResult<S> result;
      adaptive_bvh::distance(mesh, tf, object, tf, fcl::DistanceRequest<S>(), result);
    });
  };
  EXPECT_EQ(
      "adaptive_bvh: FCL cannot compute the distance between a BVHModel of RSS and a BVHModel of "
      "OBBRSS; use the same volumes in both models",
      distanceTo(&other));
  fcl::BVHModel<fcl::AABB<S>> aligned;
  fillModel(dome<S>(5, 3), aligned);
  EXPECT_EQ(
      "adaptive_bvh: FCL cannot compute the distance between a BVHModel of AABB and a plane; a "
      "large box may stand for the plane or half-space",
      refusal([&] {
        fcl::DistanceResult<S> result;
        adaptive_bvh::distance<S>(&aligned, tf, &plane, tf, fcl::DistanceRequest<S>(), result);
      }));
  AdaptiveBVHModel<fcl::OBBRSS<S>> adaptive_other;
  fillModel(dome<S>(5, 3), adaptive_other);
  EXPECT_EQ(distanceTo(&other), distanceTo(&adaptive_other)) << "both may be adaptive";
  EXPECT_NE("", refusal([&] {
              fcl::CollisionResult<S> result;
              adaptive_bvh::collide<S>(&other, tf, mesh, tf, fcl::CollisionRequest<S>(), result);
            }));
  const Mesh<S> empty;
  EXPECT_NE("", distanceTo(&empty));
  EXPECT_NE("", refusal([&] {
              fcl::DistanceResult<S> result;
              adaptive_bvh::distance<S>(&empty, tf, &empty, tf, fcl::DistanceRequest<S>(), result);
            }))
      << "two plain models";
}

}  // namespace nearest_points_test
}  // namespace adaptive_bvh_test
