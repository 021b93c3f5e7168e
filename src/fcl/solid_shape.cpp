#include "fcl/solid_shape.h"

#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <stdexcept>
#include <utility>

#include "fcl/shape_geometry.h"

namespace adaptive_bvh {
namespace {

using Vector = fcl::Vector3d;
constexpr double kTurn = 2 * 3.14159265358979323846;

/// The faces of a convex of FCL's as triangles, and their planes.
template <typename S>
class ConvexFaces {
 public:
  /// Throws std::invalid_argument where the faces do not enclose the convex.
  explicit ConvexFaces(const fcl::Convex<S>& convex) : hull_(convex.getVertices()) {
    const std::vector<int>& list = convex.getFaces();
    std::map<std::pair<int, int>, int> edges;
    std::size_t at = 0;
    for (int face = 0; face < convex.getFaceCount(); ++face) {
      const int count = at < list.size() ? list[at++] : 0;
      if (count < 3 || list.size() - at < static_cast<std::size_t>(count)) refuse();
      const int* const corners = &list[at];
      at += static_cast<std::size_t>(count);
      for (int k = 0; k < count; ++k) {
        const int from = corners[k], to = corners[(k + 1) % count];
        if (from < 0 || from >= static_cast<int>(hull_.vertices.size())) refuse();
        ++edges[{from, to}];
        --edges[{to, from}];
      }
      for (int k = 2; k < count; ++k) add(corners[0], corners[k - 1], corners[k]);
    }
    for (const auto& edge : edges)
      if (edge.second != 0) refuse();
    if (planes_.empty()) refuse();
  }

  const std::vector<std::array<Vector, 3>>& triangles() const { return triangles_; }
  Vector support(const Vector& direction) const { return hull_.support(direction); }
  /// By the nearest plane: of a point outside the distance may be too small, and the point is that
  /// of the plane.
  ShapeSurface operator()(const Vector& x) const {
    double highest = -std::numeric_limits<double>::infinity();
    const Plane* nearest = nullptr;
    for (const Plane& plane : planes_) {
      const double height = plane.n.dot(x) - plane.d;
      if (height > highest) highest = height, nearest = &plane;
    }
    return {highest, x - highest * nearest->n, nearest->n};
  }

 private:
  struct Plane {
    Vector n;
    double d;
  };

  [[noreturn]] static void refuse() {
    throw std::invalid_argument(
        "adaptive_bvh: signedDistance needs a convex whose faces enclose it: each edge must be run "
        "through once in each direction");
  }
  Vector vertex(int i) const {
    return hull_.vertices[static_cast<std::size_t>(i)].template cast<double>();
  }
  void add(int i, int j, int k) {
    const Vector a = vertex(i), b = vertex(j), c = vertex(k);
    triangles_.push_back({a, b, c});
    const Vector n = (b - a).cross(c - a).stableNormalized();
    if (n.isZero(0)) return;
    // Faces may be turned in; the hull is on one side of each.
    const double above = n.dot(hull_.support(n)), below = n.dot(hull_.support(-n)),
                 height = n.dot(a);
    if (above - height <= height - below)
      planes_.push_back({n, above});
    else
      planes_.push_back({-n, -below});
  }

  const shape_sets::Hull<S> hull_;
  std::vector<std::array<Vector, 3>> triangles_;
  std::vector<Plane> planes_;
};

/// Adds patches that cover parts of a surface, all around the z axis.
class PatchList {
 public:
  explicit PatchList(std::vector<SolidShape::Patch>& patches) : patches_(patches) {}

  void addTriangle(const Vector& a, const Vector& b, const Vector& c) const {
    patches_.push_back({SurfaceChart::flat(), a, b, c});
  }
  void addBox(const Vector& half) const {
    for (int k = 0; k < 6; ++k) {
      const Vector middle = (k < 3 ? 1 : -1) * half[k % 3] * Vector::Unit(k % 3),
                   u = half[(k + 1) % 3] * Vector::Unit((k + 1) % 3),
                   v = half[(k + 2) % 3] * Vector::Unit((k + 2) % 3);
      const Vector a = middle - u - v, c = middle + u + v;
      addTriangle(a, middle + u - v, c);
      addTriangle(a, c, middle - u + v);
    }
  }
  /// Half of an ellipsoid, above or below its centre.
  void addHalf(const Vector& center, const Vector& radii, double sign) const {
    const Vector x = Vector::UnitX(), y = Vector::UnitY();
    const Vector around[5] = {x, y, -x, -y, x};
    for (int i = 0; i < 4; ++i)
      patches_.push_back(
          {SurfaceChart::round(center, radii), sign * Vector::UnitZ(), around[i], around[i + 1]});
  }
  /// A line (radius, z) turned around the axis.
  void addTurned(double radius0, double z0, double radius1, double z1) const {
    constexpr int kParts = 8;
    const SurfaceChart chart = SurfaceChart::turned(radius0, z0, radius1, z1);
    const auto angle = [](int i) { return i * (kTurn / kParts); };
    for (int i = 0; i < kParts; ++i) {
      const Vector a(0, angle(i), 0), b(0, angle(i + 1), 0), c(1, angle(i), 0),
          d(1, angle(i + 1), 0);
      if (radius0 > 0) patches_.push_back({chart, a, b, c});  // else it is a line
      patches_.push_back({chart, c, b, d});
    }
  }
  void addDisk(double radius, double z) const {
    constexpr int kParts = 6;
    const auto rim = [&](int i) -> Vector {
      const double angle = i * (kTurn / kParts);
      return {radius * std::cos(angle), radius * std::sin(angle), 1};
    };
    for (int i = 0; i < kParts; ++i)
      patches_.push_back(
          {SurfaceChart::disk(radius, z), Vector::Zero(), rim(i), rim((i + 1) % kParts)});
  }

 private:
  std::vector<SolidShape::Patch>& patches_;
};

SolidShape roundedSegment(double radius, double half) {
  SolidShape solid;
  solid.surface = [=](const Vector& x) { return surfaceOfRoundedSegment(x, radius, half); };
  solid.support = [=](const Vector& n) -> Vector {
    return radius * n + Vector(0, 0, n[2] < 0 ? -half : half);
  };
  solid.rolling_radius = radius;
  const PatchList patches(solid.patches);
  const Vector radii = Vector::Constant(radius);
  patches.addHalf(Vector(0, 0, half), radii, 1);
  patches.addHalf(Vector(0, 0, -half), radii, -1);
  if (half > 0) patches.addTurned(radius, -half, radius, half);
  return solid;
}

SolidShape box(const Vector& half) {
  SolidShape solid;
  solid.surface = [=](const Vector& x) { return surfaceOfBox(x, half); };
  solid.support = [=](const Vector& n) -> Vector {
    return n.unaryExpr([](double c) { return c < 0 ? -1. : 1.; }).cwiseProduct(half);
  };
  PatchList(solid.patches).addBox(half);
  return solid;
}

SolidShape cylinder(double radius, double half) {
  SolidShape solid;
  const shape_sets::Cylinder set(radius, half);
  solid.surface = [=](const Vector& x) { return surfaceOfCylinder(x, radius, half); };
  solid.support = [=](const Vector& n) -> Vector { return set.support(n); };
  const PatchList patches(solid.patches);
  patches.addDisk(radius, -half);
  patches.addTurned(radius, -half, radius, half);
  patches.addDisk(radius, half);
  return solid;
}

SolidShape cone(double radius, double half) {
  SolidShape solid;
  const shape_sets::Cone set(radius, half);
  solid.surface = [=](const Vector& x) { return surfaceOfCone(x, radius, half); };
  solid.support = [=](const Vector& n) -> Vector { return set.support(n); };
  const PatchList patches(solid.patches);
  patches.addDisk(radius, -half);
  patches.addTurned(0, half, radius, -half);
  return solid;
}

SolidShape ellipsoid(const Vector& radii) {
  SolidShape solid;
  const shape_sets::Ellipsoid set(radii);
  solid.surface = [=](const Vector& x) { return surfaceOfEllipsoid(x, radii); };
  solid.support = [=](const Vector& n) -> Vector { return set.support(n); };
  // The least radius of curvature (Blaschke's rolling theorem).
  solid.rolling_radius = radii.minCoeff() * (radii.minCoeff() / radii.maxCoeff());
  for (const double sign : {1., -1.}) PatchList(solid.patches).addHalf(Vector::Zero(), radii, sign);
  return solid;
}

template <typename S>
SolidShape convex(const fcl::Convex<S>& shape) {
  SolidShape solid;
  const auto faces = std::make_shared<const ConvexFaces<S>>(shape);
  solid.surface = [=](const Vector& x) { return (*faces)(x); };
  solid.support = [=](const Vector& n) -> Vector { return faces->support(n); };
  solid.inner = shape.getInteriorPoint().template cast<double>();
  const PatchList patches(solid.patches);
  for (const auto& t : faces->triangles()) patches.addTriangle(t[0], t[1], t[2]);
  return solid;
}

}  // namespace

template <typename S>
SolidShape solidOf(const fcl::CollisionGeometry<S>& shape) {
  switch (shape.getNodeType()) {
    case fcl::GEOM_SPHERE:
      return roundedSegment(double(static_cast<const fcl::Sphere<S>&>(shape).radius), 0);
    case fcl::GEOM_CAPSULE: {
      const auto& capsule = static_cast<const fcl::Capsule<S>&>(shape);
      return roundedSegment(double(capsule.radius), double(capsule.lz) / 2);
    }
    case fcl::GEOM_BOX:
      return box(static_cast<const fcl::Box<S>&>(shape).side.template cast<double>() / 2);
    case fcl::GEOM_CYLINDER: {
      const auto& of = static_cast<const fcl::Cylinder<S>&>(shape);
      return cylinder(double(of.radius), double(of.lz) / 2);
    }
    case fcl::GEOM_CONE: {
      const auto& of = static_cast<const fcl::Cone<S>&>(shape);
      return cone(double(of.radius), double(of.lz) / 2);
    }
    case fcl::GEOM_ELLIPSOID:
      return ellipsoid(static_cast<const fcl::Ellipsoid<S>&>(shape).radii.template cast<double>());
    case fcl::GEOM_CONVEX: return convex(static_cast<const fcl::Convex<S>&>(shape));
    case fcl::GEOM_PLANE:
      throw std::invalid_argument(
          "adaptive_bvh: there is no signed distance to a plane, which has no inside");
    default:
      throw std::invalid_argument(
          "adaptive_bvh: there is no signed distance of a mesh and a geometry of this type");
  }
}

template SolidShape solidOf(const fcl::CollisionGeometry<float>&);
template SolidShape solidOf(const fcl::CollisionGeometry<double>&);

}  // namespace adaptive_bvh
