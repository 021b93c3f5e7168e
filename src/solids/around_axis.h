#pragma once

#include <algorithm>
#include <cmath>

#include "solids/solid.h"

// Helpers that cylinders, cones and boxes share. Their axis is the z axis.
namespace adaptive_bvh {

/// The surface point nearest to x of an axis-aligned box around the origin with the half sides
/// `half`, in any number of dimensions. `distance` is negative inside; `outward` is the unit
/// outward direction there, on an edge or a corner the mean of the adjacent ones.
template <typename Point>
struct BoxSurface {
  double distance;
  Point nearest, outward;

  BoxSurface(const Point& x, const Point& half) {
    const Point beyond = x.cwiseAbs() - half;
    const auto side = [&](int k) { return x[k] < 0 ? -1. : 1.; };
    outward = Point::Zero();
    nearest = x;
    int nearest_side;  // if x is inside: the axis of the nearest face
    distance = beyond.maxCoeff(&nearest_side);
    if (distance > 0) {
      nearest = x.cwiseMin(half).cwiseMax(-half);
      outward = (x - nearest).stableNormalized();
      distance = (x - nearest).stableNorm();
    } else {
      nearest[nearest_side] = side(nearest_side) * half[nearest_side];
      for (int k = 0; k < x.size(); ++k)
        if (k == nearest_side || (distance == 0 && beyond[k] == 0)) outward[k] = side(k);
      outward.normalize();
    }
  }
};

using Profile = Eigen::Vector2d;  ///< (distance from the z axis, z)

/// Reduces a problem about a shape around the z axis to the half-plane that contains x and the
/// axis: profile() is x in this plane, and operator() maps a result back. For x on the axis, the
/// half-plane contains the positive x axis.
class AroundAxis {
 public:
  explicit AroundAxis(const fcl::Vector3d& x) : profile_(std::hypot(x[0], x[1]), x[2]) {
    if (profile_[0] > 0) away_ = fcl::Vector3d(x[0] / profile_[0], x[1] / profile_[0], 0);
  }
  const Profile& profile() const { return profile_; }
  fcl::Vector3d operator()(const Profile& p) const {
    return {p[0] * away_[0], p[0] * away_[1], p[1]};
  }

 private:
  Profile profile_;
  fcl::Vector3d away_ = fcl::Vector3d::UnitX();  ///< horizontal unit vector from the axis to x
};

/// Distance of x from the z axis.
inline double axisDistance(const fcl::Vector3d& x) { return std::sqrt(x[0] * x[0] + x[1] * x[1]); }

/// The point of a circle around the z axis that is farthest along a direction.
inline fcl::Vector3d onCircle(const fcl::Vector3d& direction, double radius, double z) {
  const double length = std::hypot(direction[0], direction[1]);
  if (!(length > 0)) return {radius, 0, z};
  return {radius * (direction[0] / length), radius * (direction[1] / length), z};
}

/// Candidate directions, perpendicular to an edge, of the shortest translation that takes a disk at
/// height `half`, or its reflection at -half, past the edge. Let c be the horizontal component and
/// s the height of the edge, both divided by its length; u a horizontal unit vector perpendicular
/// to the edge; w the unit vector perpendicular to both, with w_z = c > 0. The length of the
/// translation along cos(t) u + sin(t) w is
///   half c |sin t| + radius sqrt(1 - c^2 sin^2 t) + cos(t) u v + sin(t) w v.
struct RimAndEdge {
  double radius, half;  ///< of the disk

  /// Tries the candidates for an edge that begins at v. Vertical edges have no such u; the
  /// directions of their corners suffice.
  template <typename Search>
  void tryDirections(const fcl::Vector3d& v, const fcl::Vector3d& edge, Search& shortest) const {
    constexpr double kUpright = 0x1p-40;
    const double length = edge.norm(), across = axisDistance(edge);
    if (!(across > kUpright * length)) return;
    const fcl::Vector3d u = fcl::Vector3d(-edge[1], edge[0], 0) / across,
                        w = (edge / length).cross(u);
    shortest.tryBoth(u);
    shortest.tryBoth(w);
    const double along_u = u.dot(v), along_w = w.dot(v);
    const double c = across / length, s = edge[2] / length;
    // The shortest is on the side, u or -u, whose product with v is negative. `side`: sign of
    // sin(t).
    const fcl::Vector3d from = along_u > 0 ? fcl::Vector3d(-u) : u;
    for (const double side : {-1., 1.}) {
      const double tangent = leastTangent(half * c + side * along_w, std::abs(along_u), c, s);
      if (tangent > 0) shortest.tryDirection(from + (side * tangent) * w);
    }
  }

 private:
  /// The tangent x > 0 of the angle t that minimizes the length: where the derivative of the length
  /// divided by cos(t), g(x) = d + a x - radius c^2 x / sqrt(1 + s^2 x^2), s^2 + c^2 = 1, changes
  /// from negative to positive. 0 if there is none. g is convex, so Newton's method approaches the
  /// root from the right without passing it.
  double leastTangent(double d, double a, double c, double s) const {
    constexpr int kMostSteps = 60;
    const double k = radius * c * c, s2 = s * s;
    double x = (k / std::abs(s) - d) / a;  // right of the root: x / sqrt(1 + s2 x^2) < 1 / |s|
    if (a > k) x = std::min(x, -d / (a - k));
    if (!(x > 0) || !std::isfinite(x)) return 0;
    for (int i = 0; i < kMostSteps; ++i) {
      const double square = 1 + s2 * x * x, root = std::sqrt(square);
      const double slope = a - k / (square * root);
      if (!(slope > 0)) return 0;
      const double next = x - (d + a * x - k * x / root) / slope;
      if (!(next > 0)) return 0;
      if (!(next < x * (1 - 0x1p-50))) break;
      x = next;
    }
    return x;
  }
};

}  // namespace adaptive_bvh
