// Distances, depths, normals and contacts of a mesh and a shape are those of their geometry: in
// long double, by another method, on lattices and in any pose; apart, touching, crossing, inside.
#include <gtest/gtest.h>

#include "adaptive_bvh/proximity.h"
#include "adaptive_bvh/query.h"
#include "support/degenerate_triangles.h"
#include "support/fcl_float.h"
#include "support/long_mode.h"
#include "support/shape_oracle.h"
#include "support/test_volume.h"

namespace adaptive_bvh_test {
namespace shape_distance_test {

using exact::Point;
using exact::Real;
using Triangle = DegenerateTriangles::Triangle;

template <typename Body>
class ShapeDistance : public testing::Test {
 protected:
  using Shape = JudgedShape;

  RandomGeometry& random() { return triangles_.random(); }
  double size() {
    return double(random().oneIn(2) ? 1 + random().below(3) : random().uniform(0.1, 3));
  }
  fcl::Vector3d sizes() { return {size(), size(), size()}; }

  std::vector<Shape> shapes() {
    using namespace judged_shapes;
    const fcl::Vector3d normal = random().oneIn(2) ? fcl::Vector3d::Unit(random().below(3))
                                                   : fcl::Vector3d(random().direction());
    return {sphere(size()),
            capsule(size(), size()),
            box(sizes()),
            cylinder(size(), size()),
            cone(size(), size()),
            ellipsoid(sizes()),
            octahedron(sizes(), sizes() - sizes()),
            flat(normal, size() - 2, true),
            flat(normal, size() - 2, false)};
  }
  /// On the lattice half of the time.
  fcl::Transform3d pose() {
    fcl::Transform3d tf = fcl::Transform3d::Identity();
    if (random().oneIn(2)) return random().pose(4);
    tf.linear() = Eigen::AngleAxis<double>(double(M_PI / 2) * double(random().below(4)),
                                           fcl::Vector3d::Unit(random().below(3)))
                      .toRotationMatrix()
                      .array()
                      .round();
    tf.translation() = fcl::Vector3d(double(random().below(11) - 5), double(random().below(11) - 5),
                                     double(random().below(11) - 5));
    return tf;
  }

  TriangleMesh mesh() {
    TriangleMesh mesh;
    for (int i = random().below(3); i >= 0; --i) {
      const Triangle t = random().oneIn(2) ? triangles_.alongAxes() : triangles_.onLattice();
      const std::size_t first = mesh.vertices.size();
      for (const auto& p : t) mesh.vertices.push_back(p);
      mesh.triangles.emplace_back(first, first + 1, first + 2);
    }
    return mesh;
  }
  /// By the rotation as it is given.
  static exact::Triangle seenFrom(const fcl::Transform3d& tf, const TriangleMesh& mesh,
                                  std::size_t triangle) {
    exact::Triangle t;
    for (std::size_t k = 0; k < 3; ++k)
      t[k] = inShape(tf, mesh.vertices[mesh.triangles[triangle][int(k)]]);
    return t;
  }

  /// The mesh at the identity.
  void check(const Shape& shape) {
    SCOPED_TRACE(shape.name);
    const TriangleMesh mesh = this->mesh();
    const Body model = makeBody<Body>(mesh);
    const fcl::Transform3d tf = pose();
    Real expected = 1e30L;
    std::vector<Real> distances;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
      distances.push_back(shape.distanceTo(seenFrom(tf, mesh, i)));
      expected = std::min(expected, distances.back());
    }
    const double tolerance = 1e3 * std::numeric_limits<double>::epsilon() *
                             (10 + fcl::Vector3d(tf.translation()).norm());
    fcl::DistanceResultd result;
    const double found = adaptive_bvh::distance(&model, still_, shape.geometry.get(), tf,
                                                fcl::DistanceRequestd(true), result);
    ASSERT_EQ(found, result.min_distance);
    ASSERT_NEAR(double(expected), double(found), double(tolerance));
    ASSERT_NEAR(double(found), double((result.nearest_points[0] - result.nearest_points[1]).norm()),
                double(tolerance));
    ASSERT_NEAR(0, double(shape.distance(inShape(tf, result.nearest_points[1]))),
                double(tolerance));
    if constexpr (std::is_same<Body, adaptive_bvh::DeformableMesh>::value) {
      ASSERT_TRUE(isNearer(model, still_, *shape.geometry, tf, found + tolerance));
      if (found > tolerance) {
        ASSERT_FALSE(isNearer(model, still_, *shape.geometry, tf, found - tolerance));
      }
    }
    touching_ += found <= 0;
    ++all_;
    checkContacts(shape, mesh, model, tf, distances, found, tolerance);
  }
  static Point inShape(const fcl::Transform3d& tf, const fcl::Vector3d& x) {
    return exact::placement(tf).inverse(exact::of(x));
  }

  void checkContacts(const Shape& shape, const TriangleMesh& mesh, const Body& model,
                     const fcl::Transform3d& tf, const std::vector<Real>& distances, double found,
                     double tolerance) {
    fcl::CollisionResultd result;
    adaptive_bvh::collide(&model, still_, shape.geometry.get(), tf,
                          fcl::CollisionRequestd(100, true), result);
    std::vector<int> count(distances.size(), 0);
    Real deepest = 0;
    for (std::size_t i = 0; i < result.numContacts(); ++i) {
      const fcl::Contactd& contact = result.getContact(i);
      ASSERT_EQ(&model, contact.o1);
      ASSERT_EQ(shape.geometry.get(), contact.o2);
      const auto triangle = static_cast<std::size_t>(contact.b1);
      ++count[triangle];
      ASSERT_NEAR(0, double(distances[triangle]), double(tolerance));
      ASSERT_NEAR(0, double(shape.distance(inShape(tf, contact.pos))), double(tolerance));
      const exact::Triangle t = seenFrom(tf, mesh, triangle);
      ASSERT_NEAR(0, double(exact::distance(t, inShape(tf, contact.pos))), double(tolerance));
      ASSERT_NO_FATAL_FAILURE(checkDepth(
          shape, t, tf.linear().template cast<Real>().transpose() * exact::of(contact.normal),
          Real(contact.penetration_depth), Real(tolerance)));
      deepest = std::max(deepest, Real(contact.penetration_depth));
    }
    for (const int contacts : count) ASSERT_LE(contacts, 1);
    ASSERT_EQ(found <= 0, result.numContacts() > 0);
    fcl::DistanceRequestd signed_request(true, true);
    fcl::DistanceResultd signed_result;
    const double signed_distance = adaptive_bvh::distance(&model, still_, shape.geometry.get(), tf,
                                                          signed_request, signed_result);
    ASSERT_EQ(signed_distance, signed_result.min_distance);
    if (result.numContacts() > 0) {
      ASSERT_NEAR(-double(deepest), double(signed_distance), double(tolerance));
    } else {
      ASSERT_GT(signed_distance, 0);
    }
  }
  /// The shape moved by the depth along the normal is apart; along other directions, far from the
  /// normal and near it, it takes as long.
  void checkDepth(const Shape& shape, const exact::Triangle& t, const Point& normal, Real depth,
                  Real tolerance) {
    ASSERT_GE(depth, 0);
    ASSERT_NEAR(1, double(normal.norm()), double(tolerance));
    const Real slack = 10 * tolerance + 1e-8L;
    if (std::string(shape.name) != "plane" && std::string(shape.name) != "half-space") {
      ASSERT_NEAR(double(depth), double(shape.way(t, normal)), double(slack));
    }
    std::vector<Point> others = {normal, -normal, (t[1] - t[0]).cross(t[2] - t[0])};
    for (int k = 0; k < 3; ++k) others.insert(others.end(), {Point::Unit(k), -Point::Unit(k)});
    for (int i = 0; i < 20; ++i) others.push_back(exact::of(random().direction()));
    for (Real step = 0.1L; step > 1e-6L; step /= 2)
      others.push_back(normal + step * exact::of(random().direction()));
    for (const Point& other : others)
      if (other.norm() > 0) {
        ASSERT_GE(shape.way(t, other / other.norm()), depth - slack);
      }
    deep_ += depth > Real(0.01);
  }

  const fcl::Transform3d still_ = fcl::Transform3d::Identity();
  DegenerateTriangles triangles_{88};
  int touching_ = 0, all_ = 0, deep_ = 0;
};

TYPED_TEST_SUITE(ShapeDistance, TestBodies);

TYPED_TEST(ShapeDistance, IsThatOfTheGeometryOfEveryShape) {
  for (int round = 0; round < manySteps(60) && !testing::Test::HasFailure(); ++round)
    for (const auto& shape : this->shapes()) {
      SCOPED_TRACE(round);
      this->check(shape);
    }
  EXPECT_GT(this->touching_, this->all_ / 20);
  EXPECT_LT(this->touching_, this->all_ * 4 / 5);
  EXPECT_GT(this->deep_, this->all_ / 20);
}

TriangleMesh oneTriangle(const fcl::Vector3d& a, const fcl::Vector3d& b, const fcl::Vector3d& c) {
  TriangleMesh mesh;
  mesh.vertices = {a, b, c};
  mesh.triangles = {{0, 1, 2}};
  return mesh;
}

/// FCL's solver ends 12.5 % too far away here.
TYPED_TEST(ShapeDistance, OfABoxWhereGjkFails) {
  const auto model = makeBody<TypeParam>(oneTriangle({1, -1, -1}, {1, -1, 0}, {0, 0, 1}));
  const fcl::Boxd box(3, 2, 2);
  fcl::Transform3d tf = this->still_;
  tf.translation() = fcl::Vector3d(0, 4, -1);
  fcl::DistanceResultd result;
  adaptive_bvh::distance(&model, this->still_, &box, tf, fcl::DistanceRequestd(), result);
  EXPECT_FLOAT_EQ(std::sqrt(10.f), float(result.min_distance));
}

/// FCL returns -1, and the smallest negative number in the result.
TYPED_TEST(ShapeDistance, IsMinusTheDepthOfASphere) {
  const auto model = makeBody<TypeParam>(oneTriangle({-3, -3, 0}, {3, -3.1, 0}, {0.2, 4, 0}));
  const fcl::Sphered sphere(0.5);
  fcl::Transform3d tf = this->still_;
  tf.translation() = fcl::Vector3d(0, 0, 0.4);
  fcl::DistanceResultd result;
  const double found = adaptive_bvh::distance(&model, this->still_, &sphere, tf,
                                              fcl::DistanceRequestd(true, true), result);
  EXPECT_FLOAT_EQ(-0.1f, float(found));
  EXPECT_EQ(found, result.min_distance);
  EXPECT_NEAR(0, double(result.nearest_points[0].norm()), 1e-6);
}

/// The line from the centre of a ball to a triangle through it is rounding alone.
TEST(ShapeContact, OfABallWhoseCentreIsOnATriangleIsAlongItsNormal) {
  RandomGeometry random(91);
  const auto ball = std::make_shared<fcl::Sphered>(0.5);
  for (int round = 0; round < 2000; ++round) {
    const fcl::Transform3d pose = random.pose(3);
    TriangleMesh mesh;
    for (const fcl::Vector3d& x :
         {fcl::Vector3d(-2, -1, 0), fcl::Vector3d(2, -1, 0), fcl::Vector3d(0, 3, 0)})
      mesh.vertices.push_back(pose * x);
    mesh.triangles.emplace_back(0, 1, 2);
    const adaptive_bvh::DeformableMesh triangle(mesh);
    fcl::CollisionResultd result;
    adaptive_bvh::collide(&triangle, fcl::Transform3d::Identity(), ball.get(), pose,
                          fcl::CollisionRequestd(1, true), result);
    ASSERT_EQ(1u, result.numContacts());
    const fcl::Contactd& contact = result.getContact(0);
    ASSERT_NEAR(1, std::abs(contact.normal.dot(pose.linear().col(2))), 1e-12);
    ASSERT_NEAR(0.5, contact.penetration_depth, 1e-12);
  }
}

}  // namespace shape_distance_test
}  // namespace adaptive_bvh_test
