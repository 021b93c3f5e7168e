#pragma once

#include <cmath>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "fcl/shape_geometry.h"
#include "query/depth_search.h"
#include "triangles/shape_surface.h"
#include "triangles/surface_chart.h"

namespace adaptive_bvh {

/// The faces of a convex of FCL's as triangles, and their planes.
template <typename S>
class ConvexFaces {
 public:
  using Vector = fcl::Vector3d;

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

/// The inside of a convex shape, for DepthSearch, in the shape's frame: by planes that it touches.
/// `Surface`: the ShapeSurface of a point. `Support`: the farthest point along a direction.
template <typename Surface, typename Support>
class ShapeTarget {
 public:
  /// A plane n x = d with the shape on its lower side. A point in the shape is no deeper than below
  /// this plane.
  struct Witness {
    fcl::Vector3d n = fcl::Vector3d::Zero();
    double d = 0;
  };
  struct Reach {
    Witness plane;
    double operator()(const fcl::Vector3d& x) const { return plane.d - plane.n.dot(x); }
  };

  ShapeTarget(const Surface& surface, const Support& support)
      : surface_(surface), support_(support) {}

  Reach reach(const Witness& plane) const { return {plane}; }
  double overBox(const Reach& reach, const TurnedBox& box) const {
    return reach(box.middle) + (reach.plane.n.transpose() * box.halves).cwiseAbs().sum();
  }
  void measure(DepthPoint<Witness>& point, const Witness&) const {
    const ShapeSurface found = surface_(point.x);
    point.distance = std::abs(found.distance);
    point.side = found.distance < 0 ? SurfaceSide::Inside : SurfaceSide::Outside;
    point.witness = {found.outward, found.outward.dot(support_(found.outward))};
  }
  bool isInside(const fcl::Vector3d& x) const { return surface_(x).distance < 0; }
  bool isClear(const fcl::Vector3d&, double) const { return false; }
  /// Bounds by planes are negative outside, so neither is needed.
  bool touches(const std::array<fcl::Vector3d, 3>&) const { return true; }
  double crossing(const Witness&, const fcl::Vector3d&, const fcl::Vector3d&) const { return -1; }
  fcl::Vector3d outward(const fcl::Vector3d& x) const { return surface_(x).outward; }
  void findNearest(const DepthPoint<Witness>& point, DepthBounds& bounds) const {
    const ShapeSurface found = surface_(point.x);
    bounds.nearest = found.nearest;
    bounds.outward = found.outward;
  }

 private:
  const Surface& surface_;
  const Support& support_;
};

/// Throws std::invalid_argument unless a geometry is a shape of FCL's with an inside.
template <typename S>
void requireSolid(const fcl::CollisionGeometry<S>& shape) {
  const fcl::NODE_TYPE type = shape.getNodeType();
  if (type < fcl::GEOM_BOX || type > fcl::GEOM_HALFSPACE || type == fcl::GEOM_PLANE)
    throw std::invalid_argument(
        type == fcl::GEOM_PLANE
            ? "adaptive_bvh: there is no signed distance to a plane, which has no inside"
            : "adaptive_bvh: there is no signed distance of a mesh and a geometry of this type");
}

/// Calls visit(target, add): the inside of a shape of FCL's, and add(patch), which calls
/// patch(chart, p, q, r) with the charts and parameters of triangles that cover its surface.
/// Nothing for a half-space.
template <typename S, typename Visit>
void visitSolid(const fcl::CollisionGeometry<S>& shape, const Visit& visit) {
  using Vector = fcl::Vector3d;
  const auto visitSet = [&](const auto& surface, const auto& support, const auto& addPatches) {
    using Target = ShapeTarget<std::decay_t<decltype(surface)>, std::decay_t<decltype(support)>>;
    visit(Target(surface, support), addPatches);
  };
  const auto addRound = [](const SurfaceChart& chart, double sign, const auto& patch) {
    for (int i = 0; i < 4; ++i) {
      const Vector from = i % 2 ? Vector::UnitY() : Vector::UnitX(),
                   to = i % 2 ? Vector::UnitX() : Vector::UnitY();
      patch(chart, Vector(sign * Vector::UnitZ()), Vector(i < 2 ? from : Vector(-from)),
            Vector(i == 0 || i == 3 ? to : Vector(-to)));
    }
  };
  const auto addTurned = [](const SurfaceChart& chart, const auto& patch) {
    constexpr int kParts = 8;
    const auto angle = [](int i) { return i * (2 * 3.14159265358979323846 / kParts); };
    for (int i = 0; i < kParts; ++i) {
      const Vector a(0, angle(i), 0), b(0, angle(i + 1), 0), c(1, angle(i), 0),
          d(1, angle(i + 1), 0);
      patch(chart, a, b, c);
      patch(chart, c, b, d);
    }
  };
  const auto addDisk = [](double radius, double z, const auto& patch) {
    constexpr int kParts = 6;
    const auto rim = [&](int i) -> Vector {
      const double angle = i * (2 * 3.14159265358979323846 / kParts);
      return {radius * std::cos(angle), radius * std::sin(angle), 1};
    };
    for (int i = 0; i < kParts; ++i)
      patch(SurfaceChart::disk(radius, z), Vector(Vector::Zero()), rim(i), rim((i + 1) % kParts));
  };
  const auto visitSegment = [&](double radius, double half) {
    visitSet([=](const Vector& x) { return surfaceOfRoundedSegment(x, radius, half); },
             [=](const Vector& n) -> Vector {
               return radius * n + Vector(0, 0, n[2] < 0 ? -half : half);
             },
             [=](const auto& patch) {
               const Vector radii = Vector::Constant(radius);
               addRound(SurfaceChart::round(Vector(0, 0, half), radii), 1, patch);
               addRound(SurfaceChart::round(Vector(0, 0, -half), radii), -1, patch);
               if (half > 0) addTurned(SurfaceChart::turned(radius, -half, radius, half), patch);
             });
  };
  switch (shape.getNodeType()) {
    case fcl::GEOM_SPHERE:
      return visitSegment(double(static_cast<const fcl::Sphere<S>&>(shape).radius), 0);
    case fcl::GEOM_CAPSULE: {
      const auto& capsule = static_cast<const fcl::Capsule<S>&>(shape);
      return visitSegment(double(capsule.radius), double(capsule.lz) / 2);
    }
    case fcl::GEOM_BOX: {
      const Vector half = static_cast<const fcl::Box<S>&>(shape).side.template cast<double>() / 2;
      return visitSet(
          [=](const Vector& x) { return surfaceOfBox(x, half); },
          [=](const Vector& n) -> Vector {
            return n.unaryExpr([](double c) { return c < 0 ? -1. : 1.; }).cwiseProduct(half);
          },
          [=](const auto& patch) {
            for (int k = 0; k < 6; ++k) {
              const Vector middle = (k < 3 ? 1 : -1) * half[k % 3] * Vector::Unit(k % 3),
                           u = half[(k + 1) % 3] * Vector::Unit((k + 1) % 3),
                           v = half[(k + 2) % 3] * Vector::Unit((k + 2) % 3);
              const Vector a = middle - u - v, c = middle + u + v;
              patch(SurfaceChart::flat(), a, Vector(middle + u - v), c);
              patch(SurfaceChart::flat(), a, c, Vector(middle - u + v));
            }
          });
    }
    case fcl::GEOM_CYLINDER: {
      const auto& cylinder = static_cast<const fcl::Cylinder<S>&>(shape);
      const double radius = double(cylinder.radius), half = double(cylinder.lz) / 2;
      const shape_sets::Cylinder set(radius, half);
      return visitSet([=](const Vector& x) { return surfaceOfCylinder(x, radius, half); },
                      [&](const Vector& n) { return set.support(n); },
                      [=](const auto& patch) {
                        addDisk(radius, -half, patch);
                        addTurned(SurfaceChart::turned(radius, -half, radius, half), patch);
                        addDisk(radius, half, patch);
                      });
    }
    case fcl::GEOM_CONE: {
      const auto& cone = static_cast<const fcl::Cone<S>&>(shape);
      const double radius = double(cone.radius), half = double(cone.lz) / 2;
      const shape_sets::Cone set(radius, half);
      return visitSet([=](const Vector& x) { return surfaceOfCone(x, radius, half); },
                      [&](const Vector& n) { return set.support(n); },
                      [=](const auto& patch) {
                        addDisk(radius, -half, patch);
                        addTurned(SurfaceChart::turned(0, half, radius, -half), patch);
                      });
    }
    case fcl::GEOM_ELLIPSOID: {
      const Vector radii =
          static_cast<const fcl::Ellipsoid<S>&>(shape).radii.template cast<double>();
      const shape_sets::Ellipsoid set(radii);
      return visitSet([=](const Vector& x) { return surfaceOfEllipsoid(x, radii); },
                      [&](const Vector& n) { return set.support(n); },
                      [=](const auto& patch) {
                        for (const double sign : {1., -1.})
                          addRound(SurfaceChart::round(Vector::Zero(), radii), sign, patch);
                      });
    }
    case fcl::GEOM_CONVEX: {
      const ConvexFaces<S> faces(static_cast<const fcl::Convex<S>&>(shape));
      return visitSet(
          faces, [&](const Vector& n) { return faces.support(n); },
          [&](const auto& patch) {
            for (const auto& t : faces.triangles()) patch(SurfaceChart::flat(), t[0], t[1], t[2]);
          });
    }
    default: return;
  }
}

}  // namespace adaptive_bvh
