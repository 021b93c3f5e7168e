#pragma once

#include <algorithm>
#include <cmath>

#include <fcl/common/types.h>

namespace adaptive_bvh {

/// A part of the surface of a shape, as the image of a flat one: of triangles of parameters.
class SurfaceChart {
 public:
  using Vector = fcl::Vector3d;

  /// A parameter is a point itself.
  static SurfaceChart flat() { return {Kind::Flat, Vector::Zero(), Vector::Zero()}; }
  /// A parameter is a point of the unit sphere; it is scaled by the radii and moved.
  static SurfaceChart round(const Vector& center, const Vector& radii) {
    return {Kind::Round, center, radii};
  }
  /// A disk around the z axis. A parameter is x, y, and 1 on the rim, else 0. Triangles with two
  /// corners on the rim reach up to it.
  static SurfaceChart disk(double radius, double z) {
    return {Kind::Disk, Vector(radius, 0, z), Vector::Zero()};
  }
  /// A line (radius, z) turned around the z axis, from one point to another. A parameter is a share
  /// of the line, and an angle.
  static SurfaceChart turned(double radius0, double z0, double radius1, double z1) {
    return {Kind::Turned, Vector(radius0, 0, z0), Vector(radius1, 0, z1)};
  }

  bool operator==(const SurfaceChart& other) const {
    return kind_ == other.kind_ && a_ == other.a_ && b_ == other.b_;
  }

  Vector operator()(const Vector& parameter) const {
    if (kind_ == Kind::Flat) return parameter;
    if (kind_ == Kind::Disk) return {parameter[0], parameter[1], a_[2]};
    if (kind_ == Kind::Round) return a_ + b_.cwiseProduct(parameter);
    const Vector p = a_ + parameter[0] * (b_ - a_);
    return {p[0] * std::cos(parameter[1]), p[0] * std::sin(parameter[1]), p[2]};
  }
  /// A parameter on the line between two; those of a triangle cut there cover it.
  Vector between(const Vector& p, const Vector& q, double share) const {
    const Vector linear = p + share * (q - p);
    if (kind_ == Kind::Disk) {
      const bool is_rim = p[2] + q[2] == 2;
      const double out = is_rim ? a_[0] / std::hypot(linear[0], linear[1]) : 1;
      return {out * linear[0], out * linear[1], is_rim ? 1. : 0.};
    }
    return kind_ == Kind::Round ? Vector(linear.normalized()) : linear;
  }
  /// For which edge of a triangle of parameters to cut.
  double length(const Vector& p, const Vector& q) const {
    if (kind_ == Kind::Round) return b_.maxCoeff() * (q - p).norm();
    return ((*this)(q) - (*this)(p)).norm();
  }
  /// How far a point of the patch over a triangle of parameters is at most from the triangle with
  /// the same corners: docs/bounds.md, 19.
  double deviation(const Vector& p, const Vector& q, const Vector& r) const {
    if (kind_ == Kind::Flat) return 0;
    if (kind_ == Kind::Disk)
      return kSlack * (rimDeviation(p, q) + rimDeviation(q, r) + rimDeviation(r, p));
    return kSlack * (kind_ == Kind::Round ? roundDeviation(p, q, r) : turnedDeviation(p, q, r));
  }

 private:
  enum class Kind { Flat, Round, Turned, Disk };
  SurfaceChart(Kind kind, const Vector& a, const Vector& b) : kind_(kind), a_(a), b_(b) {}

  /// The patch of the unit sphere is the triangle moved outward along radii. A point of it with the
  /// barycentric coordinates l has the squared radius 1 - sum l_i l_j e_ij^2, with the edges e: at
  /// least 1 less a third of the longest one's square.
  double roundDeviation(const Vector& p, const Vector& q, const Vector& r) const {
    const double square =
        std::max({(q - p).squaredNorm(), (r - q).squaredNorm(), (p - r).squaredNorm()}) / 3;
    return b_.maxCoeff() * square / (1 + std::sqrt(std::max(0., 1 - square)));
  }
  /// The height of the arc over an edge whose ends are on the rim.
  double rimDeviation(const Vector& p, const Vector& q) const {
    if (p[2] + q[2] != 2) return 0;
    const double half = std::hypot(q[0] - p[0], q[1] - p[1]) / 2;
    return half * half / (a_[0] + std::sqrt(std::max(0., (a_[0] - half) * (a_[0] + half))));
  }
  /// By the second derivatives: none along the line, the slope of the radius for both, the radius
  /// around the axis.
  double turnedDeviation(const Vector& p, const Vector& q, const Vector& r) const {
    const auto range = [&](int k) {
      return std::max({p[k], q[k], r[k]}) - std::min({p[k], q[k], r[k]});
    };
    const double slope = b_[0] - a_[0], angle = range(1);
    const double radius =
        std::max({a_[0] + p[0] * slope, a_[0] + q[0] * slope, a_[0] + r[0] * slope});
    return std::abs(slope) * range(0) * angle / 4 + radius * angle * angle / 8;
  }

  static constexpr double kSlack = 1 + 1e-9;

  Kind kind_;
  Vector a_, b_;
};

}  // namespace adaptive_bvh
