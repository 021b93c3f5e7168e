// Contacts of vertices with shapes, judged in long double by the shapes' formulas, by their
// supporting planes, and by balls inside of them.
#include <gtest/gtest.h>

#include "adaptive_bvh/penetration.h"
#include "support/closed_bodies.h"
#include "support/shape_oracle.h"

namespace adaptive_bvh_test {
namespace shape_contacts_test {

using adaptive_bvh::DeformableMesh;
using adaptive_bvh::VertexContacts;
using exact::Point;
using exact::Real;

class ShapeContacts : public testing::Test {
 protected:
  using Model = DeformableMesh;

  JudgedShape shape(double size) {
    using namespace judged_shapes;
    const auto side = [&] { return size * random_.size(-2, 0.3); };
    const auto three = [&] { return fcl::Vector3d(side(), side(), side()); };
    switch (random_.below(9)) {
      case 0: return sphere(side());
      case 1: return capsule(side(), side());
      case 2: return box(three());
      case 3: return cylinder(side(), side());
      case 4: return cone(side(), side());
      case 5: return ellipsoid(random_.oneIn(4) ? fcl::Vector3d::Constant(side()) : three());
      case 6: return octahedron(three(), fcl::Vector3d(size * 0.2 * random_.point()));
      case 7: return flat(random_.direction(), size * random_.uniform(), false);
      default: return flat(random_.direction(), size * random_.uniform(), true);
    }
  }
  /// Vertices all around, some on the axes and in the middle.
  Model points(double size) {
    TriangleMesh mesh;
    for (int i = 0; i < 60; ++i) {
      fcl::Vector3d p = size * this->random_.size(-2, 0.4) * random_.direction();
      if (random_.oneIn(4)) p[random_.below(3)] = 0;
      if (random_.oneIn(4)) p[random_.below(3)] = 0;
      mesh.vertices.push_back(p);
      if (i % 3 == 2) mesh.triangles.emplace_back(i - 2, i - 1, i);
    }
    return Model(mesh);
  }

  RandomGeometry random_{43};
};

/// Whether a ball around x lies in a convex shape: along many directions.
bool holdsBall(const JudgedShape& shape, const Point& x, Real radius, Real rounding,
               RandomGeometry& random) {
  for (int i = 0; i < 60; ++i) {
    const Point n = i < 6 ? Point((i < 3 ? 1 : -1) * Point::Unit(i % 3))
                          : Point(exact::of(random.direction()).normalized());
    if (shape.distance(x + radius * n) > rounding) return false;
  }
  return true;
}

/// Of the triangle that has a vertex.
Real areaOf(const DeformableMesh& mesh, unsigned vertex) {
  const fcl::Triangle& t = mesh.triangles()[vertex / 3];
  const Point a = exact::of(mesh.vertices()[t[0]]);
  return (exact::of(mesh.vertices()[t[1]]) - a).cross(exact::of(mesh.vertices()[t[2]]) - a).norm() /
         2;
}

TEST_F(ShapeContacts, AreThoseOfTheFormulas) {
  auto& random = this->random_;
  RandomGeometry directions(44);
  long judged = 0, found = 0, inside = 0;
  for (int body = 0; body < manySteps(200); ++body) {
    const double size = random.size(-6, 6);
    const JudgedShape shape = this->shape(size);
    const bool is_convex = std::string(shape.name) == "octahedron",
               is_plane = std::string(shape.name) == "plane",
               is_flat = is_plane || std::string(shape.name) == "half-space";
    const auto mesh = this->points(size);
    const auto tf = random.pose(0.3 * size), shape_tf = random.pose(0.3 * size);
    const double margin = random.oneIn(3)   ? 0.
                          : random.oneIn(6) ? std::numeric_limits<double>::infinity()
                                            : size * random.size(-3, 0.3);
    VertexContacts result;
    const fcl::CollisionGeometryd& geometry = *shape.geometry;
    const std::size_t count = vertexContacts(mesh, tf, geometry, shape_tf, margin, result);
    ASSERT_EQ(count, result.size());
    const exact::Placement at = exact::placement(tf), shape_at = exact::placement(shape_tf);
    const auto inShape = [&](const Point& world) -> Point {
      return shape_at.R.transpose() * (world - shape_at.T);
    };
    const Real epsilon = std::numeric_limits<double>::epsilon(),
               rounding = size * (is_convex ? 4e-10L : 2e-14L);
    std::size_t next = 0;
    for (unsigned v = 0; v < mesh.vertices().size(); ++v) {
      const Point x = inShape(at(exact::of(mesh.vertices()[v])));
      const Real d = shape.distance(x);
      const bool is_found = next < result.size() && result.vertices[next] == v;
      if (std::abs(d - margin) > rounding) {
        ASSERT_EQ(d < margin || (d == 0 && !is_plane), is_found) << shape.name << " " << double(d);
      }
      ++judged;
      if (!is_found) continue;
      const std::size_t i = next++;
      ++found;
      const Real measured = result.distances[i];
      const Real tolerance = rounding + 4 * epsilon * std::abs(measured);
      EXPECT_NEAR(1, double(exact::of(result.normals[i]).norm()), double(4 * epsilon));
      const Point outward = -(shape_at.R.transpose() * exact::of(result.normals[i])),
                  nearest = inShape(exact::of(result.nearest_points[i]));
      const Real world = rounding + 64 * epsilon * (size + std::abs(measured));
      EXPECT_NEAR(double((x - nearest).norm()), double(std::abs(measured)), double(world));
      EXPECT_LE(shape.distance(nearest), world) << shape.name;
      EXPECT_EQ(-1, result.triangles[i]);
      // One third of its only triangle; some are degenerate.
      const Real area = areaOf(mesh, v) / 3;
      EXPECT_NEAR(double(area), double(result.areas[i]),
                  double(8 * epsilon * area) + 1e-15 * double(size * size));
      if (std::abs(measured) > 1e-3L * size) {
        const Point direction = (measured < 0 ? Point(nearest - x) : Point(x - nearest));
        // Both ends of the direction are known up to `world`.
        EXPECT_LE((direction.normalized() - outward).norm(),
                  1e-5L + 4 * epsilon + 2 * world / std::abs(measured))
            << shape.name;
      }
      if (d > 2 * rounding) {
        EXPECT_NEAR(double(d), double(measured), double(tolerance)) << shape.name;
        continue;
      }
      inside += measured < 0;
      EXPECT_LE(measured, tolerance) << shape.name;
      if (is_flat) continue;
      // The nearest point is on the surface: a plane through it has all of the shape on one side.
      EXPECT_NEAR(double(shape.reach(outward)), double(outward.dot(nearest)),
                  double(rounding + 64 * epsilon * size))
          << shape.name;
      // And there is no nearer one.
      EXPECT_TRUE(
          holdsBall(shape, x, -measured, rounding + 8 * epsilon * std::abs(measured), directions))
          << shape.name;
    }
    ASSERT_EQ(next, result.size());
  }
  EXPECT_GT(found, judged / 8);
  EXPECT_GT(inside, found / 10);
  std::printf("%ld vertices judged, %ld contacts, %ld inside\n", judged, found, inside);
}

/// Vertices at all distances down to what is rounded: the plane across the normal through the
/// nearest point has all of the shape behind it.
TEST_F(ShapeContacts, NormalsNearTheSurfaceAreThoseOfIt) {
  auto& random = this->random_;
  const auto tf = fcl::Transform3d::Identity();
  long judged = 0;
  for (int body = 0; body < manySteps(100); ++body) {
    const double size = random.size(-6, 6);
    const JudgedShape shape = this->shape(size);
    if (shape.reach(Point::UnitX()) > 1e20L * size) continue;  // a plane
    TriangleMesh near_surface;
    for (int i = 0; i < 60; ++i) {
      const Point along = exact::of(random.direction());
      Real low = 0, high = 10 * Real(size);
      for (int step = 0; step < 80; ++step)
        (shape.distance((low + high) / 2 * along) > 0 ? high : low) = (low + high) / 2;
      const Real shift = Real(random.size(-16, -2)) * (random.oneIn(2) ? 1 : -1);
      near_surface.vertices.push_back((low * (1 + shift) * along).cast<double>());
      if (i % 3 == 2) near_surface.triangles.emplace_back(i - 2, i - 1, i);
    }
    const DeformableMesh mesh(near_surface);
    const fcl::CollisionGeometryd& geometry = *shape.geometry;
    VertexContacts result;
    vertexContacts(mesh, tf, geometry, tf, size, result);
    EXPECT_EQ(60u, result.size());
    const bool is_convex = std::string(shape.name) == "octahedron";
    for (std::size_t i = 0; i < result.size(); ++i) {
      const Point outward = -exact::of(result.normals[i]),
                  nearest = exact::of(result.nearest_points[i]);
      const Real epsilon = std::numeric_limits<double>::epsilon();
      // Nearer than 1e-8 of the coordinates it is the surface's; an edge has any of several.
      const Real error = 1e-7L * size + 64 * epsilon * size + (is_convex ? 1e-7L * size : 0);
      EXPECT_NEAR(double(shape.reach(outward)), double(outward.dot(nearest)), double(error))
          << shape.name << " " << result.distances[i] / size;
      ++judged;
    }
  }
  EXPECT_GT(judged, 1000);
}

/// Vertices on the surface, on edges and tips: the mean direction.
TEST_F(ShapeContacts, HaveNormalsOnTheSurface) {
  TriangleMesh points;
  points.vertices = {{1, 0, 0}, {1, 1, 0}, {1, 1, 1}, {0, 0, 1}, {0, 0, 0}, {0, 1, -1}};
  points.triangles.emplace_back(0, 1, 2);
  points.triangles.emplace_back(3, 4, 5);
  const DeformableMesh mesh(points);
  const auto tf = fcl::Transform3d::Identity();
  const auto normals = [&](const fcl::CollisionGeometryd& shape) {
    VertexContacts result;
    vertexContacts(mesh, tf, shape, tf, 10., result);
    EXPECT_EQ(6u, result.size());
    return result;
  };
  const auto expectOutward = [](const VertexContacts& c, std::size_t i, const fcl::Vector3d& n) {
    EXPECT_EQ(0, c.distances[i]);
    EXPECT_LE((c.normals[i] + n.normalized()).norm(), 1e-6) << c.normals[i].transpose();
  };
  const auto box = normals(fcl::Boxd(2, 2, 2));
  expectOutward(box, 0, {1, 0, 0});
  expectOutward(box, 1, {1, 1, 0});
  expectOutward(box, 2, {1, 1, 1});
  EXPECT_EQ(-1, box.distances[4]);
  EXPECT_NEAR(1, box.normals[4].norm(), 1e-6);
  const auto ball = normals(fcl::Sphered(1));
  expectOutward(ball, 0, {1, 0, 0});
  expectOutward(ball, 3, {0, 0, 1});
  EXPECT_EQ(-1, ball.distances[4]);
  const auto cylinder = normals(fcl::Cylinderd(1, 2));
  expectOutward(cylinder, 0, {1, 0, 0});
  expectOutward(cylinder, 3, {0, 0, 1});
  expectOutward(cylinder, 5, {0, 1, -1});
  const auto cone = normals(fcl::Coned(1, 2));
  expectOutward(cone, 3, {0, 0, 1});
  const double side = std::sqrt(5.);
  expectOutward(cone, 5, {0, 2 / side, 1 / side - 1});
  const auto ellipsoid = normals(fcl::Ellipsoidd(1, 2, 1));
  expectOutward(ellipsoid, 0, {1, 0, 0});
  EXPECT_NEAR(-1, ellipsoid.distances[4], 1e-6);
}

TEST_F(ShapeContacts, WithAMeshAsGeometryAreThoseOfTheMesh) {
  const DeformableMesh mesh(gridBall(8, 7)), other(latticeBox(2));
  const auto tf = fcl::Transform3d::Identity();
  const fcl::CollisionGeometryd& geometry = other;
  VertexContacts as_mesh, as_geometry;
  vertexContacts(mesh, tf, other, tf, 0.1, as_mesh);
  vertexContacts(mesh, tf, geometry, tf, 0.1, as_geometry);
  EXPECT_GT(as_mesh.size(), 0u);
  EXPECT_EQ(as_mesh.distances, as_geometry.distances);
  EXPECT_EQ(as_mesh.triangles, as_geometry.triangles);
  const fcl::BVHModel<fcl::OBBRSSd> unknown;
  const fcl::CollisionGeometryd& no_shape = unknown;
  EXPECT_THROW(vertexContacts(mesh, tf, no_shape, tf, 0.1, as_geometry), std::invalid_argument);
  const fcl::Sphered sphere(1);
  const fcl::CollisionGeometryd& ball = sphere;
  EXPECT_THROW(vertexContacts(mesh, tf, ball, tf, -1., as_geometry), std::invalid_argument);
  auto mirrored = tf;
  mirrored.linear()(0, 0) = -1;
  EXPECT_THROW(vertexContacts(mesh, tf, ball, mirrored, 1., as_geometry), std::invalid_argument);
  EXPECT_EQ(as_mesh.distances, as_geometry.distances);
}

}  // namespace shape_contacts_test
}  // namespace adaptive_bvh_test
