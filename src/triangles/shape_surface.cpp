#include "triangles/shape_surface.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace adaptive_bvh {
namespace {

using Vector = fcl::Vector3d;
using Profile = Eigen::Vector2d;  ///< distance from the axis, and z

/// A point that is nearer than this part of the coordinates is on the surface.
constexpr double kOnSurface = 1e-8;

/// A box along the axes, around the origin, in any number of dimensions.
template <typename Point>
struct BoxSurface {
  double distance;
  Point nearest, outward;

  BoxSurface(const Point& x, const Point& half) {
    const Point beyond = x.cwiseAbs() - half;
    const auto side = [&](int k) { return x[k] < 0 ? -1. : 1.; };
    outward = Point::Zero();
    nearest = x;
    int farthest;
    distance = beyond.maxCoeff(&farthest);
    if (distance > 0) {
      nearest = x.cwiseMin(half).cwiseMax(-half);
      outward = (x - nearest).stableNormalized();
      distance = (x - nearest).stableNorm();
    } else {
      nearest[farthest] = side(farthest) * half[farthest];
      for (int k = 0; k < x.size(); ++k)
        if (k == farthest || (distance == 0 && beyond[k] == 0)) outward[k] = side(k);
      outward.normalize();
    }
  }
};

/// A shape around the z axis, from what is found in the plane of x and the axis. On the axis it is
/// as if x were a little along the x axis.
class AroundAxis {
 public:
  explicit AroundAxis(const Vector& x) : profile_(std::hypot(x[0], x[1]), x[2]) {
    if (profile_[0] > 0) away_ = Vector(x[0] / profile_[0], x[1] / profile_[0], 0);
  }
  const Profile& profile() const { return profile_; }
  Vector operator()(const Profile& p) const { return {p[0] * away_[0], p[0] * away_[1], p[1]}; }

 private:
  Profile profile_;
  Vector away_ = Vector::UnitX();
};

}  // namespace

ShapeSurface surfaceOfRoundedSegment(const Vector& x, double radius, double half) {
  const Vector core(0, 0, std::clamp(x[2], -half, half)), from = x - core;
  const double length = from.stableNorm();
  const Vector outward = length > 0 ? Vector(from / length) : Vector::UnitX();
  return {length - radius, core + radius * outward, outward};
}

ShapeSurface surfaceOfBox(const Vector& x, const Vector& half) {
  const BoxSurface<Vector> found(x, half);
  return {found.distance, found.nearest, found.outward};
}

ShapeSurface surfaceOfHalfSpace(const Vector& x, const Vector& n, double d) {
  const double height = n.dot(x) - d;
  return {height, x - height * n, n};
}
ShapeSurface surfaceOfPlane(const Vector& x, const Vector& n, double d) {
  const ShapeSurface above = surfaceOfHalfSpace(x, n, d);
  if (above.distance >= 0) return above;
  return {-above.distance, above.nearest, -n};
}

ShapeSurface surfaceOfCylinder(const Vector& x, double radius, double half) {
  const AroundAxis around(x);
  const BoxSurface<Profile> found(around.profile(), Profile(radius, half));
  return {found.distance, around(found.nearest), around(found.outward)};
}

ShapeSurface surfaceOfCone(const Vector& x, double radius, double half) {
  const AroundAxis around(x);
  const Profile &at = around.profile(), rim(radius, -half);
  const Profile up(-radius, 2 * half), side = Profile(2 * half, radius).normalized();
  // The side, from the rim to the tip, and the base.
  const double share = std::clamp((at - rim).dot(up) / up.squaredNorm(), 0., 1.);
  const Profile on_side = rim + share * up, on_base(std::min(at[0], radius), -half);
  const double to_side = (at - on_side).norm(), to_base = (at - on_base).norm();
  const bool is_inside = at[1] >= -half && side.dot(at - rim) <= 0, is_side = to_side < to_base;
  const Profile& nearest = is_side ? on_side : on_base;
  const double distance = std::min(to_side, to_base);
  // On the side and on the base as it is, since x - nearest has few digits near them.
  Profile outward = is_side ? side : Profile(0, -1);
  const bool is_tip = is_side && share == 1;
  if (is_tip || nearest == rim) {
    if (distance > kOnSurface * std::max(at.cwiseAbs().maxCoeff(), distance))
      outward = (is_inside ? Profile(nearest - at) : Profile(at - nearest)) / distance;
    else
      outward = is_tip ? Profile(0, 1) : Profile((side + Profile(0, -1)).normalized());
  }
  return {is_inside ? -distance : distance, around(nearest), around(outward)};
}

namespace {

/// The root u of G(u) = sum (r_i z_i / (u + r_i - 1))^2 = 1 with u > 0; 0 where there is none. By
/// Newton's method on 1 / sqrt(G), which is concave, from below: every step stays below the root
/// (J. J. More, D. C. Sorensen, "Computing a Trust Region Step", 1983).
double ellipsoidRoot(const ScaledEllipsoid& scaled) {
  constexpr int kMostSteps = 200;
  const auto& [shortest, z, r, excess] = scaled;
  double u = 0;
  for (int k = 0; k < 3; ++k) u = std::max(u, r[k] * z[k] - excess[k]);
  for (int i = 0; i < kMostSteps; ++i) {
    double sum = 0, slope = 0;
    for (int k = 0; k < 3; ++k) {
      if (!(z[k] > 0)) continue;
      const double part = r[k] * z[k] / (u + excess[k]);
      sum += part * part;
      slope += part * part / (u + excess[k]);
    }
    const double next = u + sum * (std::sqrt(sum) - 1) / slope;
    if (!(next > u)) break;
    u = next;
  }
  return u;
}

}  // namespace

ShapeSurface surfaceOfEllipsoid(const Vector& x, const Vector& radii) {
  const ScaledEllipsoid scaled(x, radii);
  const auto& [shortest, z, r, excess] = scaled;
  const double u = ellipsoidRoot(scaled);
  Vector on_ball = Vector::Zero();  // the nearest point, by its radii
  for (int k = 0; k < 3; ++k)
    if (z[k] > 0) on_ball[k] = r[k] * z[k] / (u + excess[k]);
  if (u == 0) {  // so deep that the nearest point is off the plane that x is in
    on_ball[shortest] = 0;
    on_ball[shortest] = std::sqrt(std::max(0., 1 - on_ball.squaredNorm()));
  }
  on_ball.normalize();
  const auto signs = x.unaryExpr([](double c) { return c < 0 ? -1. : 1.; });
  const Vector nearest = on_ball.cwiseProduct(radii).cwiseProduct(signs);
  const Vector outward =
      nearest.cwiseQuotient(radii).cwiseQuotient(radii / radii[shortest]).normalized();
  const double distance = (x - nearest).norm();
  return {z.squaredNorm() < 1 ? -distance : distance, nearest, outward};
}

namespace {

/// From the nearest point of a convex set to x, which is 2^-44 of the size off: so where x is near,
/// that has few digits, and it is found anew from farther out, each time with a thousand times as
/// many. Nearer than 2^-40, as if x were inside.
Vector outwardOf(const Vector& x, const Vector& nearest, double distance, const ConvexSet& set) {
  constexpr double kTouching = 0x1p-40, kFar = 1e-4, kFarther = 1e3;
  Vector outward = (x - nearest).stableNormalized();
  const Vector extent = set.support(outward) - set.support(-outward);
  const double size = std::max(x.lpNorm<Eigen::Infinity>(), extent.lpNorm<Eigen::Infinity>());
  if (distance <= kTouching * size) return -penetrationOf({x, x, x}, set).normal;
  for (double far = distance; far < kFar * size;) {
    far *= kFarther;
    const Vector y = nearest + far * outward;
    const ConvexGap gap = convexGap({y, y, y}, set);
    outward = (y - gap.points.second).stableNormalized();
  }
  return outward;
}

}  // namespace

ShapeSurface surfaceOfConvexSet(const Vector& x, const ConvexSet& set) {
  const TrianglePoints<double> point = {x, x, x};
  const ConvexGap gap = convexGap(point, set);
  if (gap.distance > 0) {
    const Vector& nearest = gap.points.second;
    return {gap.distance, nearest, outwardOf(x, nearest, gap.distance, set)};
  }
  const Penetration way = penetrationOf(point, set);
  return {-way.depth, x - way.depth * way.normal, -way.normal};
}

}  // namespace adaptive_bvh
