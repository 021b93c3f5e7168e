#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <vector>

#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/cone.h>
#include <fcl/geometry/shape/convex.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/ellipsoid.h>
#include <fcl/geometry/shape/halfspace.h>
#include <fcl/geometry/shape/plane.h>
#include <fcl/geometry/shape/sphere.h>

#include "support/exact_geometry.h"

namespace adaptive_bvh_test {

/// The judge of shapes, in long double: how far a point is, by the shape's formula, and how far the
/// shape reaches along a direction. It shares no code with the
/// library. The method for a triangle is another one; that for a point and an ellipsoid, Newton's
/// on the textbook's equation, is the same.
///
/// The distance of a point to a convex set is a convex function of the point. So the distance of a
/// triangle is found by shrinking intervals, along a side and from there parallel to another one.
struct JudgedShape {
  using Real = exact::Real;
  using Point = exact::Point;

  const char* name;
  std::shared_ptr<fcl::CollisionGeometryd> geometry;
  std::function<Real(const Point&)> distance;  ///< in the shape's frame; 0 inside
  std::function<Real(const Point&)> reach;     ///< the largest n x of the shape; may be infinite

  Real distanceTo(const exact::Triangle& t) const {
    return least([&](Real s) {
      const Point from = t[0] + s * (t[1] - t[0]), along = (1 - s) * (t[2] - t[0]);
      return least([&](Real r) { return distance(from + r * along); });
    });
  }
  /// How far the shape must move along n, of length 1, to get past the triangle.
  Real way(const exact::Triangle& t, const Point& n) const {
    return std::max({n.dot(t[0]), n.dot(t[1]), n.dot(t[2])}) + reach(-n);
  }

 private:
  template <typename F>
  static Real least(const F& f) {
    const Real ratio = (std::sqrt(Real(5)) - 1) / 2;
    Real low = 0, high = 1, a = high - ratio, b = low + ratio, at_a = f(a), at_b = f(b);
    Real best = std::min({f(0), f(1), at_a, at_b});
    for (int i = 0; i < 75 && best > 0; ++i) {
      if (at_a <= at_b) {
        high = b, b = a, at_b = at_a;
        a = high - ratio * (high - low), at_a = f(a);
      } else {
        low = a, a = b, at_a = at_b;
        b = low + ratio * (high - low), at_b = f(b);
      }
      best = std::min({best, at_a, at_b});
    }
    return best;
  }
};

namespace judged_shapes {

using exact::Point;
using exact::Real;

/// Of a point (r, z) to the rectangle or triangle that a cylinder or cone sweeps.
inline Real toProfile(Real r, Real z, const std::vector<std::pair<Real, Real>>& profile) {
  bool is_inside = true;
  Real best = std::numeric_limits<Real>::infinity();
  for (std::size_t i = 0; i + 1 < profile.size(); ++i) {  // counterclockwise, from axis to axis
    const Real r0 = profile[i].first, z0 = profile[i].second, u = profile[i + 1].first - r0,
               v = profile[i + 1].second - z0;
    if (u * (z - z0) - v * (r - r0) < 0) is_inside = false;
    const Real s =
        std::min(std::max(((r - r0) * u + (z - z0) * v) / (u * u + v * v), Real(0)), Real(1));
    best = std::min(best, std::hypot(r0 + s * u - r, z0 + s * v - z));
  }
  return is_inside ? Real(0) : best;
}

/// The root of sum (a x / (a^2 + t))^2 = 1, by Newton's method from below on a convex function.
inline Real toEllipsoid(const Point& x, const Point& a) {
  if (x.cwiseQuotient(a).squaredNorm() <= 1) return 0;
  Real t = 0;
  for (int i = 0; i < 200; ++i) {
    Real sum = -1, slope = 0;
    for (int k = 0; k < 3; ++k) {
      const Real below = a[k] * a[k] + t, part = a[k] * x[k] / below;
      sum += part * part;
      slope -= 2 * part * part / below;
    }
    const Real next = t - sum / slope;
    if (!(next > t)) break;
    t = next;
  }
  Point off;
  for (int k = 0; k < 3; ++k) off[k] = x[k] * t / (a[k] * a[k] + t);
  return off.norm();
}

inline JudgedShape sphere(double radius) {
  const Real r = radius;
  return {"sphere", std::make_shared<fcl::Sphered>(radius),
          [=](const Point& x) { return std::max(Real(0), x.norm() - r); },
          [=](const Point& n) { return r * n.norm(); }};
}

inline JudgedShape capsule(double radius, double length) {
  const Real r = radius, half = Real(length) / 2;
  return {"capsule", std::make_shared<fcl::Capsuled>(radius, length),
          [=](const Point& x) {
            const Real z = std::max(Real(0), std::fabs(x[2]) - half);
            return std::max(Real(0), Point(x[0], x[1], z).norm() - r);
          },
          [=](const Point& n) { return half * std::fabs(n[2]) + r * n.norm(); }};
}

inline JudgedShape box(const fcl::Vector3d& side) {
  const Point half = exact::of(side) / 2;
  return {
      "box", std::make_shared<fcl::Boxd>(side),
      [=](const Point& x) { return Point((x.cwiseAbs() - half).cwiseMax(Point::Zero())).norm(); },
      [=](const Point& n) { return n.cwiseAbs().dot(half); }};
}

inline JudgedShape cylinder(double radius, double length) {
  const Real r = radius, h = Real(length) / 2;
  return {"cylinder", std::make_shared<fcl::Cylinderd>(radius, length),
          [=](const Point& x) {
            return toProfile(std::hypot(x[0], x[1]), x[2], {{0, -h}, {r, -h}, {r, h}, {0, h}});
          },
          [=](const Point& n) { return h * std::fabs(n[2]) + r * std::hypot(n[0], n[1]); }};
}

inline JudgedShape cone(double radius, double length) {
  const Real r = radius, h = Real(length) / 2;
  return {
      "cone", std::make_shared<fcl::Coned>(radius, length),
      [=](const Point& x) {
        return toProfile(std::hypot(x[0], x[1]), x[2], {{0, -h}, {r, -h}, {0, h}});
      },
      [=](const Point& n) { return std::max(h * n[2], -h * n[2] + r * std::hypot(n[0], n[1])); }};
}

inline JudgedShape ellipsoid(const fcl::Vector3d& radii) {
  const Point a = exact::of(radii);
  return {"ellipsoid", std::make_shared<fcl::Ellipsoidd>(radii),
          [=](const Point& x) { return toEllipsoid(x, a); },
          [=](const Point& n) { return n.cwiseProduct(a).norm(); }};
}
/// The hull of the six points on the axes, moved.
inline JudgedShape octahedron(const fcl::Vector3d& half, const fcl::Vector3d& shift) {
  auto vertices = std::make_shared<std::vector<fcl::Vector3d>>();
  for (int k = 0; k < 3; ++k)
    for (const double side : {1., -1.})
      vertices->push_back(shift + side * half[k] * fcl::Vector3d::Unit(k));
  auto faces = std::make_shared<std::vector<int>>();
  std::vector<exact::Triangle> judged;
  for (int i = 0; i < 8; ++i) {
    int corners[3] = {i & 1, 2 + (i >> 1 & 1), 4 + (i >> 2 & 1)};
    if ((i ^ i >> 1 ^ i >> 2) & 1) std::swap(corners[0], corners[1]);  // outward
    faces->insert(faces->end(), {3, corners[0], corners[1], corners[2]});
    judged.push_back({exact::of((*vertices)[std::size_t(corners[0])]),
                      exact::of((*vertices)[std::size_t(corners[1])]),
                      exact::of((*vertices)[std::size_t(corners[2])])});
  }
  return {"octahedron", std::make_shared<fcl::Convexd>(vertices, 8, faces),
          [=](const Point& x) {
            bool is_inside = true;
            Real best = std::numeric_limits<Real>::infinity();
            for (const exact::Triangle& t : judged) {
              if ((t[1] - t[0]).cross(t[2] - t[0]).dot(x - t[0]) > 0) is_inside = false;
              best = std::min(best, exact::distance(t, x));
            }
            return is_inside ? Real(0) : best;
          },
          [=](const Point& n) {
            Real most = -std::numeric_limits<Real>::infinity();
            for (const fcl::Vector3d& v : *vertices) most = std::max(most, n.dot(exact::of(v)));
            return most;
          }};
}

inline JudgedShape flat(const fcl::Vector3d& normal, double offset, bool is_solid) {
  std::shared_ptr<fcl::CollisionGeometryd> geometry;
  if (is_solid)
    geometry = std::make_shared<fcl::Halfspaced>(normal, offset);
  else
    geometry = std::make_shared<fcl::Planed>(normal, offset);
  // As FCL stores it.
  const auto* half_space = dynamic_cast<const fcl::Halfspaced*>(geometry.get());
  const auto* plane = dynamic_cast<const fcl::Planed*>(geometry.get());
  const Point n = exact::of(is_solid ? half_space->n : plane->n);
  const Real length = n.norm(), d = Real(is_solid ? half_space->d : plane->d) / length;
  return {is_solid ? "half-space" : "plane", geometry,
          [=](const Point& x) {
            const Real height = n.dot(x) / length - d;
            return is_solid ? std::max(height, Real(0)) : std::fabs(height);
          },
          [=](const Point& m) {
            const Real cosine = m.dot(n) / length, sine = m.cross(n).norm() / length;
            // No length takes a body out of a half-space along another direction.
            const bool is_along = sine < 1e-12L && (!is_solid || cosine > 0);
            return is_along ? cosine * d : std::numeric_limits<Real>::infinity();
          }};
}

}  // namespace judged_shapes
}  // namespace adaptive_bvh_test
