// Solid bodies: what is inside of a closed mesh touches it. Judged by distances of all triangles,
// solid angles and formulas of shapes, in long double.
#include <gtest/gtest.h>

#include "adaptive_bvh/proximity.h"
#include "adaptive_bvh/query.h"
#include "support/closed_bodies.h"
#include "support/fcl_float.h"
#include "support/long_mode.h"
#include "support/names.h"
#include "support/shape_oracle.h"

namespace adaptive_bvh_test {
namespace solid_bodies_test {

using adaptive_bvh::DeformableMesh;
using exact::Point;
using exact::Real;

class SolidBodies : public testing::Test {
 protected:
  using Mesh = DeformableMesh;
  using Transform = fcl::Transform3d;
  using Contact = fcl::Contactd;

  /// Of a point in a body's frame, in another's.
  static Point in(const Transform& to, const Transform& from, const Point& x) {
    return exact::placement(to).inverse(exact::placement(from)(x));
  }
  static exact::Triangle triangleOf(const Mesh& mesh, std::size_t t) {
    const fcl::Triangle& v = mesh.triangles()[t];
    return {exact::of(mesh.vertices()[v[0]]), exact::of(mesh.vertices()[v[1]]),
            exact::of(mesh.vertices()[v[2]])};
  }
  static exact::Triangle triangleIn(const Transform& to, const Transform& from, const Mesh& mesh,
                                    std::size_t t) {
    exact::Triangle triangle = triangleOf(mesh, t);
    for (Point& x : triangle) x = in(to, from, x);
    return triangle;
  }
  /// The surfaces of two meshes.
  static Real distance(const Mesh& a, const Transform& tf1, const Mesh& b, const Transform& tf2) {
    Real least = std::numeric_limits<Real>::max();
    for (std::size_t i = 0; i < b.triangles().size(); ++i) {
      const exact::Triangle t = triangleIn(tf1, tf2, b, i);
      for (std::size_t j = 0; j < a.triangles().size(); ++j)
        least = std::min(least, exact::distance(triangleOf(a, j), t));
    }
    return least;
  }
  static Real depthOf(const Mesh& mesh, const Point& x) {
    Real least = std::numeric_limits<Real>::max();
    for (std::size_t t = 0; t < mesh.triangles().size(); ++t)
      least = std::min(least, exact::distance(triangleOf(mesh, t), x));
    return least;
  }
  /// The triangles with the smallest index of the components of `inner` that are inside.
  static std::vector<int> inside(const Mesh& inner, const Transform& tf, const Mesh& around,
                                 const Transform& around_tf) {
    std::vector<std::size_t> component(inner.vertices().size());
    for (std::size_t v = 0; v < component.size(); ++v) component[v] = v;
    for (bool changes = true; changes;) {
      changes = false;
      for (const fcl::Triangle& t : inner.triangles()) {
        const std::size_t least = std::min({component[t[0]], component[t[1]], component[t[2]]});
        for (int k = 0; k < 3; ++k) {
          changes = changes || component[t[k]] != least;
          component[t[k]] = least;
        }
      }
    }
    std::vector<int> found;
    std::vector<bool> is_known(component.size(), false);
    for (std::size_t t = 0; t < inner.triangles().size(); ++t) {
      const std::size_t v = inner.triangles()[t][0];
      if (is_known[component[v]]) continue;
      is_known[component[v]] = true;
      const Point x = in(around_tf, tf, exact::of(inner.vertices()[v]));
      if (std::round(windingNumberOf(around, x)) != 0) found.push_back(int(t));
    }
    return found;
  }
  /// A closed body, smaller on request, of one component or two.
  Mesh body(double scale) {
    TriangleMesh mesh = random_.oneIn(3) ? latticeBox(1) : gridBall(4, 2);
    if (random_.oneIn(2)) addSurface(gridBall(3, 1), fcl::Vector3d(4, 0, 0), false, mesh);
    for (fcl::Vector3d& x : mesh.vertices) x *= scale;
    return Mesh(mesh);
  }

  /// Of a triangle to a shape within a radius of its origin; less, where the triangle is farther.
  static Real distanceTo(const JudgedShape& shape, const exact::Triangle& t, double radius) {
    const Real beyond = exact::distance(t, Point(Point::Zero())) - Real(radius);
    return beyond > 0 ? beyond : shape.distanceTo(t);
  }

  /// The contact of a point of the inner body, in the frame of the mesh around it.
  void expectContact(const Contact& contact, const Mesh& around, const Transform& tf,
                     const Point& x, double sign) {
    const double slack = 1e4 * double(std::numeric_limits<double>::epsilon());
    const Real depth = depthOf(around, x);
    ASSERT_NEAR(double(depth), double(contact.penetration_depth), slack);
    const Point pos = in(tf, Transform::Identity(), exact::of(contact.pos));
    ASSERT_NEAR(0, double((pos - x).norm()), slack);
    const Point normal = exact::of(tf.linear()).transpose() * exact::of(contact.normal);
    ASSERT_NEAR(1, double(normal.norm()), slack);
    ASSERT_NEAR(0, double(depthOf(around, x + Real(sign) * depth * normal)), slack);
  }

  RandomGeometry random_{31};
};

TEST_F(SolidBodies, OfTwoMeshesTouchWhereOneIsInside) {
  using Mesh = DeformableMesh;
  auto& random = this->random_;
  int inside = 0, outside = 0, touching = 0;
  for (int round = 0; round < manySteps(150); ++round) {
    const Mesh around(closedBody(random)), inner = this->body(random.size(-2., 0.));
    const fcl::Transform3d tf1 = random.pose(0.5), tf2 = random.pose(0.5);
    const bool swaps = random.oneIn(2);
    const Mesh &first = swaps ? inner : around, &second = swaps ? around : inner;
    fcl::CollisionResultd plain, solid;
    const fcl::CollisionRequestd request(1000000, true);
    adaptive_bvh::collide(&first, tf1, &second, tf2, request, plain);
    adaptive_bvh::collide(&first, tf1, &second, tf2, request, solid, true);
    ASSERT_EQ(solid.isCollision(), isNearer(first, tf1, second, tf2, 0., true));
    if (plain.isCollision()) {
      ASSERT_EQ(plain.numContacts(), solid.numContacts());
      ++touching;
      continue;
    }
    if (this->distance(first, tf1, second, tf2) < 1e-3) continue;
    const auto in_second = this->inside(first, tf1, second, tf2),
               in_first = this->inside(second, tf2, first, tf1);
    ASSERT_EQ(in_second.size() + in_first.size(), solid.numContacts()) << round;
    for (std::size_t i = 0; i < solid.numContacts(); ++i) {
      const fcl::Contactd& contact = solid.getContact(i);
      ASSERT_EQ(&first, contact.o1);
      ASSERT_EQ(&second, contact.o2);
      const bool is_first = i < in_second.size();
      const Mesh &body = is_first ? first : second, &other = is_first ? second : first;
      const auto &tf = is_first ? tf1 : tf2, &other_tf = is_first ? tf2 : tf1;
      const int triangle = is_first ? in_second[i] : in_first[i - in_second.size()];
      ASSERT_EQ(triangle, is_first ? contact.b1 : contact.b2);
      const auto v = body.triangles()[std::size_t(triangle)][0];
      const Point x = this->in(other_tf, tf, exact::of(body.vertices()[v]));
      ASSERT_NO_FATAL_FAILURE(
          this->expectContact(contact, other, other_tf, x, is_first ? -1. : 1.));
      const int nearest = is_first ? contact.b2 : contact.b1;
      ASSERT_NEAR(double(contact.penetration_depth),
                  double(exact::distance(this->triangleOf(other, std::size_t(nearest)), x)), 1e-3);
    }
    ++(solid.isCollision() ? inside : outside);
    fcl::CollisionResultd one;
    adaptive_bvh::collide(&first, tf1, &second, tf2, fcl::CollisionRequestd(1, false), one, true);
    ASSERT_EQ(std::min<std::size_t>(1, solid.numContacts()), one.numContacts());
    if (one.isCollision()) {
      ASSERT_TRUE(std::isnan(one.getContact(0).penetration_depth));
    }
  }
  EXPECT_GT(inside, 20);
  EXPECT_GT(outside, 20);
  EXPECT_GT(touching, 20);
}

TEST_F(SolidBodies, AShapeTouchesTheMeshAroundIt) {
  using namespace judged_shapes;
  auto& random = this->random_;
  int inside = 0, outside = 0;
  for (int round = 0; round < manySteps(40); ++round) {
    const DeformableMesh around(closedBody(random));
    const double size = random.size(-2., -0.3);
    const fcl::Vector3d sizes(size, size, size), aside(size, 0, 0);
    const JudgedShape shapes[] = {sphere(size),
                                  capsule(size, size),
                                  box(sizes),
                                  cylinder(size, size),
                                  cone(size, size),
                                  ellipsoid(sizes),
                                  octahedron(sizes, aside)};
    const JudgedShape& shape = shapes[random.below(7)];
    const fcl::Transform3d tf1 = random.pose(0.5), tf2 = random.pose(0.5);
    Real apart = std::numeric_limits<Real>::max();
    for (std::size_t t = 0; t < around.triangles().size(); ++t)
      apart =
          std::min(apart, this->distanceTo(shape, this->triangleIn(tf2, tf1, around, t), 3 * size));
    if (apart > 0 && apart < 1e-3) continue;
    fcl::CollisionResultd solid;
    adaptive_bvh::collide(shape.geometry.get(), tf2, &around, tf1,
                          fcl::CollisionRequestd(1000000, true), solid, true);
    ASSERT_EQ(solid.isCollision(), isNearer(around, tf1, *shape.geometry, tf2, 0., true));
    if (apart <= 0) {
      ASSERT_TRUE(solid.isCollision());
      continue;
    }
    Point x = Point::Zero();
    if (shape.geometry->getNodeType() == fcl::GEOM_CONVEX)
      x = exact::of(static_cast<const fcl::Convexd&>(*shape.geometry).getVertices()[0]);
    x = this->in(tf1, tf2, x);
    const bool is_inside = std::round(windingNumberOf(around, x)) != 0;
    ASSERT_EQ(is_inside ? 1u : 0u, solid.numContacts()) << round << " " << shape.name;
    ++(is_inside ? inside : outside);
    if (!is_inside) continue;
    const fcl::Contactd& contact = solid.getContact(0);
    ASSERT_EQ(&around, contact.o1);
    ASSERT_EQ(shape.geometry.get(), contact.o2);
    ASSERT_EQ(-1, contact.b2);
    ASSERT_NO_FATAL_FAILURE(this->expectContact(contact, around, tf1, x, 1.));
  }
  EXPECT_GT(inside, 4);
  EXPECT_GT(outside, 4);
}

TEST_F(SolidBodies, AreRefusedWhereNothingIsInside) {
  TriangleMesh open = gridBall(4, 2);
  open.triangles.pop_back();
  const DeformableMesh closed(gridBall(4, 2)), with_hole(open);
  const auto still = fcl::Transform3d::Identity();
  const fcl::Sphered sphere(1);
  const fcl::CollisionRequestd request;
  fcl::CollisionResultd result;
  const auto collides = [&](const fcl::CollisionGeometryd& a, const fcl::CollisionGeometryd& b) {
    return adaptive_bvh::collide(&a, still, &b, still, request, result, true);
  };
  try {
    collides(closed, with_hole);
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string::npos, std::string(error.what()).find("the edge from vertex"));
  }
  EXPECT_THROW(collides(with_hole, sphere), std::invalid_argument);
  EXPECT_THROW(isNearer(closed, still, with_hole, still, 0., true), std::invalid_argument);
  EXPECT_THROW(isNearer(with_hole, still, sphere, still, 0., true), std::invalid_argument);
  fcl::BVHModel<fcl::RSSd> model;
  model.beginModel();
  model.addSubModel(closed.vertices(), closed.triangles());
  model.endModel();
  EXPECT_THROW(collides(model, sphere), std::invalid_argument);
  EXPECT_FALSE(result.isCollision());
}

}  // namespace solid_bodies_test
}  // namespace adaptive_bvh_test
