#include "body.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

#include <fcl/config.h>
#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/cone.h>
#include <fcl/geometry/shape/convex.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/ellipsoid.h>
#include <fcl/geometry/shape/halfspace.h>
#include <fcl/geometry/shape/plane.h>
#include <fcl/geometry/shape/sphere.h>
#if FCL_HAVE_OCTOMAP
#include <fcl/geometry/octree/octree.h>
#endif

namespace adaptive_bvh {
namespace {

using ShapePoint = fcl::Vector3d;

/// Columns of a full turn; rows from one pole of a sphere to the other.
constexpr std::size_t kTurn = 48, kRows = 24;
constexpr double kPi = 3.14159265358979323846;

/// A convex polygon, counter-clockwise seen from outside, with vertices of its own.
void addPolygon(const std::vector<ShapePoint>& corners, TriangleMesh<double>& mesh) {
  const std::size_t first = mesh.vertices.size();
  mesh.vertices.insert(mesh.vertices.end(), corners.begin(), corners.end());
  for (std::size_t i = 2; i < corners.size(); ++i)
    mesh.triangles.emplace_back(first, first + i - 1, first + i);
}

void addBox(const ShapePoint& middle, const ShapePoint& half, TriangleMesh<double>& mesh) {
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {-1., 1.}) {
      std::vector<ShapePoint> corners;
      for (const auto& [u, v] : {std::pair(-1., -1.), {1., -1.}, {1., 1.}, {-1., 1.}}) {
        ShapePoint corner;
        corner[axis] = side;
        corner[(axis + 1) % 3] = side * u;  // mirrored with the side: still counter-clockwise
        corner[(axis + 2) % 3] = v;
        corners.push_back(middle + corner.cwiseProduct(half));
      }
      addPolygon(corners, mesh);
    }
}

/// The surface that a smooth curve of points (radius, z), from the lower end to the upper, sweeps
/// about the z axis.
void revolve(const std::vector<Eigen::Vector2d>& curve, TriangleMesh<double>& mesh) {
  const std::size_t first = mesh.vertices.size();
  for (const Eigen::Vector2d& at : curve)
    for (std::size_t i = 0; i < kTurn; ++i) {
      const double angle = 2 * kPi * double(i) / double(kTurn);
      mesh.vertices.emplace_back(at[0] * std::cos(angle), at[0] * std::sin(angle), at[1]);
    }
  for (std::size_t row = 0; row + 1 < curve.size(); ++row)
    for (std::size_t i = 0; i < kTurn; ++i) {
      const std::size_t a = first + kTurn * row + i, b = first + kTurn * row + (i + 1) % kTurn;
      if (curve[row][0] > 0) mesh.triangles.emplace_back(a, b, b + kTurn);
      if (curve[row + 1][0] > 0) mesh.triangles.emplace_back(a, b + kTurn, a + kTurn);
    }
}

/// A sphere whose halves are moved along z by `half`, upward and downward.
void addCapsule(double radius, double half, TriangleMesh<double>& mesh) {
  std::vector<Eigen::Vector2d> curve;
  for (std::size_t i = 0; i <= kRows; ++i) {
    const double angle = kPi * (double(i) / double(kRows) - 0.5);
    const bool pole = i == 0 || i == kRows;
    const double r = pole ? 0 : radius * std::cos(angle), z = radius * std::sin(angle);
    if (2 * i <= kRows) curve.emplace_back(r, z - half);
    if (2 * i > kRows || (2 * i == kRows && half > 0)) curve.emplace_back(r, z + half);
  }
  revolve(curve, mesh);
}

/// A cone without its tip, or a cylinder, along z.
void addFrustum(double lower, double upper, double half, TriangleMesh<double>& mesh) {
  revolve({{0, -half}, {lower, -half}}, mesh);
  revolve({{lower, -half}, {upper, half}}, mesh);
  if (upper > 0) revolve({{upper, half}, {0, half}}, mesh);
}

/// Where n . x = offset, for an `n` of any length.
void addSquare(const ShapePoint& n, double offset, TriangleMesh<double>& mesh) {
  const double length = n.norm();
  const ShapePoint up = n / length;
  const Eigen::Matrix3d axes =
      Eigen::Quaterniond::FromTwoVectors(ShapePoint::UnitZ(), up).toRotationMatrix();
  const ShapePoint middle = offset / length * up, x = axes.col(0), y = axes.col(1);
  addPolygon({middle - x - y, middle + x - y, middle + x + y, middle - x + y}, mesh);
}

template <typename S>
void addConvex(const fcl::Convex<S>& convex, TriangleMesh<double>& mesh) {
  const std::vector<int>& faces = convex.getFaces();
  for (std::size_t at = 0; at < faces.size(); at += 1 + static_cast<std::size_t>(faces[at])) {
    std::vector<ShapePoint> corners;
    for (int i = 1; i <= faces[at]; ++i) {
      const int corner = faces[at + static_cast<std::size_t>(i)];
      corners.push_back(
          convex.getVertices()[static_cast<std::size_t>(corner)].template cast<double>());
    }
    addPolygon(corners, mesh);
  }
}

template <typename Shape, typename S>
const Shape& shapeAs(const fcl::CollisionGeometry<S>& shape) {
  return static_cast<const Shape&>(shape);
}

template <typename S>
void addEllipsoid(const fcl::Ellipsoid<S>& ellipsoid, TriangleMesh<double>& mesh) {
  addCapsule(1, 0, mesh);
  const ShapePoint radii = ellipsoid.radii.template cast<double>();
  for (ShapePoint& vertex : mesh.vertices) vertex = vertex.cwiseProduct(radii);
}

#if FCL_HAVE_OCTOMAP
template <typename S>
void addCells(const fcl::OcTree<S>& octree, TriangleMesh<double>& mesh) {
  for (const auto& cell : octree.toBoxes())
    addBox(ShapePoint(double(cell[0]), double(cell[1]), double(cell[2])),
           ShapePoint::Constant(double(cell[3]) / 2), mesh);
}
#endif

}  // namespace

template <typename S>
TriangleMesh<double> shapeMesh(const fcl::CollisionGeometry<S>& shape) {
  TriangleMesh<double> mesh;
  switch (shape.getNodeType()) {
    case fcl::GEOM_SPHERE:
      addCapsule(double(shapeAs<fcl::Sphere<S>>(shape).radius), 0, mesh);
      break;
    case fcl::GEOM_CAPSULE: {
      const auto& capsule = shapeAs<fcl::Capsule<S>>(shape);
      addCapsule(double(capsule.radius), double(capsule.lz) / 2, mesh);
      break;
    }
    case fcl::GEOM_BOX:
      addBox(ShapePoint::Zero(), shapeAs<fcl::Box<S>>(shape).side.template cast<double>() / 2,
             mesh);
      break;
    case fcl::GEOM_CYLINDER: {
      const auto& cylinder = shapeAs<fcl::Cylinder<S>>(shape);
      const double radius = double(cylinder.radius);
      addFrustum(radius, radius, double(cylinder.lz) / 2, mesh);
      break;
    }
    case fcl::GEOM_CONE: {
      const auto& cone = shapeAs<fcl::Cone<S>>(shape);
      addFrustum(double(cone.radius), 0, double(cone.lz) / 2, mesh);
      break;
    }
    case fcl::GEOM_ELLIPSOID: addEllipsoid(shapeAs<fcl::Ellipsoid<S>>(shape), mesh); break;
    case fcl::GEOM_CONVEX: addConvex(shapeAs<fcl::Convex<S>>(shape), mesh); break;
    case fcl::GEOM_PLANE: {
      const auto& plane = shapeAs<fcl::Plane<S>>(shape);
      addSquare(plane.n.template cast<double>(), double(plane.d), mesh);
      break;
    }
    case fcl::GEOM_HALFSPACE: {
      const auto& half_space = shapeAs<fcl::Halfspace<S>>(shape);
      addSquare(half_space.n.template cast<double>(), double(half_space.d), mesh);
      break;
    }
#if FCL_HAVE_OCTOMAP
    case fcl::GEOM_OCTREE: addCells(shapeAs<fcl::OcTree<S>>(shape), mesh); break;
#endif
    default:
      throw std::invalid_argument(
          "Recording::add: the geometry is neither a DeformableMesh nor a shape nor an octree");
  }
  return mesh;
}

template TriangleMesh<double> shapeMesh(const fcl::CollisionGeometry<float>&);
template TriangleMesh<double> shapeMesh(const fcl::CollisionGeometry<double>&);

}  // namespace adaptive_bvh
